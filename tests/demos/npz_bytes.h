// Bytes of .npz files, made by hand.
#pragma once

#include <zlib.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace agail {

// A number, `width` bytes from the lowest on.
inline void put(std::string& out, std::uint64_t value, int width) {
  for (int i = 0; i < width; ++i) out += i < 8 ? static_cast<char>(value >> (8 * i) & 0xff) : '\0';
}

// An array as numpy writes it.
inline std::string npy(const std::string& type, const std::string& shape, const std::string& data) {
  const std::string header =
      "{'descr': '" + type + "', 'fortran_order': False, 'shape': " + shape + ", }\n";
  std::string out = "\x93NUMPY";
  put(out, 1, 2);
  put(out, header.size(), 2);
  return out + header + data;
}

// Stored members, as numpy.savez writes them; the Python tests have files of numpy's own.
inline std::string zip(const std::vector<std::pair<std::string, std::string>>& members) {
  std::string out;
  std::string directory;
  for (const auto& [name, data] : members) {
    const auto checksum = crc32_z(0, reinterpret_cast<const Bytef*>(data.data()), data.size());
    std::string common;
    for (const auto& [value, width] : std::vector<std::pair<std::uint64_t, int>>{{20, 2},
                                                                                 {0, 2},
                                                                                 {0, 2},
                                                                                 {0, 4},
                                                                                 {checksum, 4},
                                                                                 {data.size(), 4},
                                                                                 {data.size(), 4},
                                                                                 {name.size(), 2},
                                                                                 {0, 2}})
      put(common, value, width);
    put(directory, 0x02014b50, 4);
    put(directory, 20, 2);
    directory += common;
    put(directory, 0, 10);
    put(directory, out.size(), 4);
    directory += name;
    put(out, 0x04034b50, 4);
    out += common + name + data;
  }
  const std::size_t start = out.size();
  out += directory;
  put(out, 0x06054b50, 4);
  put(out, 0, 4);
  put(out, members.size(), 2);
  put(out, members.size(), 2);
  put(out, directory.size(), 4);
  put(out, start, 4);
  put(out, 0, 2);
  return out;
}

}  // namespace agail
