// What the linked copy of libhdf5.a has in place of libc's variables: see StaticHDF5.cmake.
#include <stdio.h>

FILE* agail_hdf5_stdout;
FILE* agail_hdf5_stderr;

__attribute__((constructor)) static void set_streams(void) {
  agail_hdf5_stdout = stdout;
  agail_hdf5_stderr = stderr;
}
