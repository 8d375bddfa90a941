// Whatever bytes a demonstration file has, reading it gives demonstrations or an InputError.
//
// A file of our own checksums its structure and data, so most mutations end at a checksum. Seed the
// corpus with files of h5py's default format as well, which has no checksums.
#include <cstddef>
#include <cstdint>
#include <span>

#include "agail/base/error.h"
#include "agail/demos/minari_reader.h"
#include "agail/demos/minari_writer.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const agail::Demonstrations read = agail::read_demonstrations(std::span(data, size), "input");
    // What can be read can be written.
    agail::encode_demonstrations(read);
  } catch (const agail::InputError&) {
  }
  return 0;
}
