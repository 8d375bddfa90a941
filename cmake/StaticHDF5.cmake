# HDF5::HDF5 and ZLIB::ZLIB as static libraries with hidden symbols, for the wheel: h5py brings an HDF5 of its own into
# the same process, and a wheel should not ask for Debian's. After find_package(HDF5) and find_package(ZLIB).
#
# Debian's libhdf5.a is compiled for executables, not for shared libraries: the only thing in it that cannot be linked
# into one is its direct access to libc's stdout and stderr. So the copy that we link asks for two variables of ours
# instead (cmake/hdf5_streams.c).
find_library(AGAIL_HDF5_ARCHIVE NAMES libhdf5.a PATHS /usr/lib/x86_64-linux-gnu/hdf5/serial REQUIRED)
find_library(AGAIL_SZ_ARCHIVE NAMES libsz.a REQUIRED)
find_library(AGAIL_AEC_ARCHIVE NAMES libaec.a REQUIRED)
find_library(AGAIL_Z_ARCHIVE NAMES libz.a REQUIRED)

set(_hdf5_copy ${CMAKE_CURRENT_BINARY_DIR}/static/libhdf5.a)
add_custom_command(
  OUTPUT ${_hdf5_copy}
  COMMAND ${CMAKE_COMMAND} -E make_directory ${CMAKE_CURRENT_BINARY_DIR}/static
  COMMAND ${CMAKE_OBJCOPY} --redefine-sym stderr=agail_hdf5_stderr --redefine-sym stdout=agail_hdf5_stdout
          ${AGAIL_HDF5_ARCHIVE} ${_hdf5_copy}
  DEPENDS ${AGAIL_HDF5_ARCHIVE}
  VERBATIM)
add_custom_target(agail_hdf5_archive DEPENDS ${_hdf5_copy})
add_library(agail_hdf5 STATIC ${CMAKE_CURRENT_LIST_DIR}/hdf5_streams.c)
add_dependencies(agail_hdf5 agail_hdf5_archive)
target_include_directories(agail_hdf5 SYSTEM INTERFACE ${HDF5_C_INCLUDE_DIRS})
# The archive needs the two variables of agail_hdf5, hence once more behind it.
target_link_libraries(agail_hdf5 INTERFACE ${_hdf5_copy} $<TARGET_FILE:agail_hdf5> ${AGAIL_SZ_ARCHIVE}
                                           ${AGAIL_AEC_ARCHIVE} ${AGAIL_Z_ARCHIVE} m ${CMAKE_DL_LIBS})
set(AGAIL_HDF5 agail_hdf5)
set(AGAIL_ZLIB ${AGAIL_Z_ARCHIVE})
