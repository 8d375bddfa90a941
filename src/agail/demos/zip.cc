#include "agail/demos/zip.h"

#include <zlib.h>

#include <algorithm>
#include <limits>

#include "agail/base/error.h"

namespace agail {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kBestCompression = 1032;  // of deflate

struct Reader {
  const Bytes& bytes;
  const std::string& where;

  [[noreturn]] void fail() const {
    throw InputError(where + " is a damaged .npz file; save it again");
  }

  std::uint64_t number(std::size_t at, std::size_t width) const {
    if (at > bytes.size() || bytes.size() - at < width) fail();
    std::uint64_t value = 0;
    for (std::size_t i = width; i > 0; --i) value = value << 8 | bytes[at + i - 1];
    return value;
  }
};

// The end record stands in the last 64 KiB, after which only a comment may come.
std::size_t find_end(const Reader& reader) {
  constexpr std::size_t kSize = 22;
  const std::size_t total = reader.bytes.size();
  for (std::size_t back = kSize; back <= std::min(total, kSize + 65535); ++back)
    if (reader.number(total - back, 4) == 0x06054b50) return total - back;
  throw InputError(reader.where + " is not a .npz file; write it with numpy.savez");
}

Bytes inflated(const Reader& reader, std::size_t begin, std::size_t stored, std::size_t size) {
  if (size / kBestCompression > stored || stored > std::numeric_limits<uInt>::max() ||
      size > std::numeric_limits<uInt>::max())
    reader.fail();
  Bytes out(size);
  z_stream stream{};
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) throw SystemError("zlib cannot start");
  stream.next_in = const_cast<Bytef*>(reader.bytes.data() + begin);  // zlib does not write there
  stream.avail_in = static_cast<uInt>(stored);
  stream.next_out = out.data();
  stream.avail_out = static_cast<uInt>(size);
  const int status = inflate(&stream, Z_FINISH);
  const bool complete = status == Z_STREAM_END && stream.total_out == size;
  inflateEnd(&stream);
  if (!complete) reader.fail();
  return out;
}

}  // namespace

std::map<std::string, Bytes> unzip(const Bytes& bytes, const std::string& where) {
  const Reader reader{bytes, where};
  const std::size_t end = find_end(reader);
  const std::uint64_t count = reader.number(end + 10, 2);
  std::size_t at = reader.number(end + 16, 4);
  std::map<std::string, Bytes> members;
  for (std::uint64_t i = 0; i < count; ++i) {
    if (reader.number(at, 4) != 0x02014b50) reader.fail();
    const std::uint64_t method = reader.number(at + 10, 2);
    const std::uint64_t checksum = reader.number(at + 16, 4);
    const std::size_t stored = reader.number(at + 20, 4);
    const std::size_t size = reader.number(at + 24, 4);
    const std::size_t name_size = reader.number(at + 28, 2);
    const std::size_t header = reader.number(at + 42, 4);
    if (stored == 0xffffffff || size == 0xffffffff || header == 0xffffffff)
      throw InputError(where + " has members above 4 GiB; save the episodes in several files");
    reader.number(at + 46 + name_size, 0);
    const std::string name(bytes.begin() + static_cast<std::ptrdiff_t>(at + 46),
                           bytes.begin() + static_cast<std::ptrdiff_t>(at + 46 + name_size));
    at += 46 + name_size + reader.number(at + 30, 2) + reader.number(at + 32, 2);

    if (reader.number(header, 4) != 0x04034b50) reader.fail();
    const std::size_t begin =
        header + 30 + reader.number(header + 26, 2) + reader.number(header + 28, 2);
    if (begin > bytes.size() || bytes.size() - begin < stored) reader.fail();
    Bytes contents;
    if (method == 0 && stored == size) {
      contents.assign(bytes.begin() + static_cast<std::ptrdiff_t>(begin),
                      bytes.begin() + static_cast<std::ptrdiff_t>(begin + size));
    } else if (method == 8) {
      contents = inflated(reader, begin, stored, size);
    } else {
      throw InputError(where + ": " + name +
                       " is packed in a way numpy does not use; write it with numpy.savez");
    }
    if (crc32_z(0, contents.data(), contents.size()) != checksum) reader.fail();
    members[name] = std::move(contents);
  }
  return members;
}

}  // namespace agail
