// A thin layer over HDF5's C API: handles that close themselves, errors as exceptions, and no trust
// in what a file claims. HDF5 itself is only seen in hdf5.cc. Debian's library is not thread-safe:
// one thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace agail::hdf5 {

// One of HDF5's ids, released by `close`.
class Handle {
 public:
  using Close = int (*)(std::int64_t);
  Handle() = default;
  Handle(std::int64_t id, Close close) : id_(id), close_(close) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }
  ~Handle() { release(); }
  // Releases it now. False if that failed: what HDF5 had still to write is not in the file.
  bool release() { return id_ < 0 || close_ == nullptr || close_(std::exchange(id_, -1)) >= 0; }
  std::int64_t id() const { return id_; }
  bool valid() const { return id_ >= 0; }

 private:
  std::int64_t id_ = -1;
  Close close_ = nullptr;
};

enum class Kind { kNothing, kGroup, kDataset, kOther };
enum class Number { kInteger, kReal, kBoolean };
enum class Type { kFloat32, kFloat64, kInt64, kUint8, kBoolean };

struct DatasetInfo {
  std::vector<std::size_t> shape;
  Number number = Number::kReal;
  std::size_t bytes = 0;  // of one value
};

// A group of a file; the file's root is one. What is wrong with the file is an InputError that
// names the place.
class Group {
 public:
  // Where this is, for messages: "demos.hdf5: episode_3".
  std::string where(const std::string& name = {}) const;

  std::vector<std::string> names() const;  // of everything in it
  Kind kind(const std::string& name) const;
  Group group(const std::string& name) const;

  // Numbers of a plain dataset. Refuses types that are not numbers, storage outside of the file and
  // sizes that the file cannot hold; so `shape` is safe to allocate.
  DatasetInfo describe(const std::string& name) const;
  // All of them, row-major, converted. `values` has the size that describe() tells.
  void read(const std::string& name, std::span<double> values) const;

  std::vector<std::string> attribute_names() const;
  // Nothing if there is none, or one of another kind, an infinite number or NaN included.
  std::optional<std::string> text_attribute(const std::string& name) const;
  std::optional<std::int64_t> integer_attribute(const std::string& name) const;
  std::optional<std::uint64_t> unsigned_attribute(const std::string& name) const;  // 2^63 or more
  std::optional<double> real_attribute(const std::string& name) const;
  std::optional<bool> boolean_attribute(const std::string& name) const;

  Group create_group(const std::string& name);
  void write(const std::string& name, const std::vector<std::size_t>& shape, Type type,
             const void* values);
  void write_attribute(const std::string& name, const std::string& text);
  void write_attribute(const std::string& name, std::int64_t number);
  void write_attribute(const std::string& name, std::uint64_t number);
  void write_attribute(const std::string& name, double number);
  // A name of its own: a literal text would be taken for a bool.
  void write_boolean_attribute(const std::string& name, bool value);

 private:
  friend class File;
  bool read_number(const std::string& name, Number number, std::int64_t type, void* value) const;
  void write_scalar(const std::string& name, std::int64_t type, const void* value);
  Handle handle_;
  std::string file_;
  std::string path_;  // inside the file, "" for the root
  std::size_t file_bytes_ = 0;
};

// A file that goes when this does.
class TemporaryPath {
 public:
  explicit TemporaryPath(std::string path = {}) : path_(std::move(path)) {}
  TemporaryPath(TemporaryPath&& other) noexcept : path_(std::exchange(other.path_, {})) {}
  TemporaryPath& operator=(TemporaryPath&& other) noexcept {
    path_.swap(other.path_);
    return *this;
  }
  ~TemporaryPath();
  const std::string& get() const { return path_; }

 private:
  std::string path_;
};

class File {
 public:
  static File open(const std::string& path);
  // A file that lies in memory; `name` is for messages.
  static File from_image(std::span<const std::uint8_t> bytes, const std::string& name);
  // A new file, in place of what is there. Equal contents give equal bytes.
  static File create(const std::string& path);
  // A new file under a temporary name. (An image in memory will not do: HDF5 leaves the mark of an
  // open file in it.)
  static File create_temporary();

  Group& root() { return root_; }
  // Of a new file: SystemError unless everything is written. Nothing else can be done with it then.
  void close();
  // The same, and the bytes of a temporary file.
  std::vector<std::uint8_t> close_and_take();

 private:
  static File wrap(Handle handle, const std::string& name);
  TemporaryPath temporary_;
  Handle handle_;
  Group root_;
};

}  // namespace agail::hdf5
