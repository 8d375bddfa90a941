#include "agail/base/atomic_file.h"

#include <fcntl.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>
#include <system_error>

#include "agail/base/error.h"

namespace agail {
namespace {

namespace fs = std::filesystem;

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

[[noreturn]] void fail(const char* what, const fs::path& path) {
  const int error = errno;
  throw SystemError("cannot " + std::string(what) + " " + path.string() + ": " +
                    std::strerror(error));
}

fs::path folder_of(const fs::path& path) {
  return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

void write_bytes(const fs::path& path, std::span<const std::uint8_t> bytes) {
  const Descriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
  if (file.get() < 0) fail("create", path);
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n = ::write(file.get(), bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail("write", path);
    done += static_cast<std::size_t>(n);
  }
}

// Makes the rename itself durable. Some network file systems cannot (EINVAL); nothing more to do
// there.
void sync_folder(const fs::path& folder) {
  const Descriptor handle(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (handle.get() < 0) fail("open folder", folder);
  if (::fsync(handle.get()) != 0 && errno != EINVAL) fail("sync folder", folder);
}

// `error`: what kept the folder from being made, if anything did.
void require_writable(const fs::path& folder, std::error_code error) {
  if (!error && !fs::is_directory(folder, error) && !error)
    error = std::make_error_code(std::errc::not_a_directory);
  if (!error && ::access(folder.c_str(), W_OK | X_OK) != 0)
    error = std::error_code(errno, std::generic_category());
  if (error)
    throw InputError("cannot create files in " + folder.string() + ": " + error.message() +
                     "; give --out a place that you can write to");
}

}  // namespace

fs::path temporary_name(const fs::path& path) {
  // Random, so that two processes never write into one temporary file: process ids can be equal on
  // machines and in containers that share a file system.
  std::uint64_t number = 0;
  if (::getrandom(&number, sizeof number, 0) != sizeof number) fail("name a file beside", path);
  std::array<char, 17> digits{};
  std::snprintf(digits.data(), digits.size(), "%016llx", static_cast<unsigned long long>(number));
  constexpr std::size_t kMostBytes = 64;  // of the name, which may be as long as names can be
  return folder_of(path) /
         ("." + path.filename().string().substr(0, kMostBytes) + "." + digits.data() + ".tmp");
}

void sync_file(const fs::path& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.get() < 0 || ::fsync(file.get()) != 0) fail("write", path);
}

void write_file_atomically(const fs::path& path, const std::function<void(const fs::path&)>& fill) {
  std::error_code ignored;
  if (!path.has_filename() || fs::is_directory(path, ignored))
    throw InputError("cannot write " + path.string() + ": it is a folder; give a file name");
  const fs::path temporary = temporary_name(path);
  try {
    fill(temporary);
    sync_file(temporary);
    if (::rename(temporary.c_str(), path.c_str()) != 0) fail("write", path);
  } catch (...) {
    ::unlink(temporary.c_str());
    throw;
  }
  sync_folder(folder_of(path));
}

void write_file_atomically(const fs::path& path, std::span<const std::uint8_t> bytes) {
  write_file_atomically(path, [bytes](const fs::path& file) { write_bytes(file, bytes); });
}

void write_file_atomically(const fs::path& path, std::string_view text) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(text.data());
  write_file_atomically(path, std::span(bytes, text.size()));
}

bool create_file_atomically(const fs::path& path, std::string_view text) {
  const fs::path whole = temporary_name(path);
  write_file_atomically(whole, text);
  bool created = ::link(whole.c_str(), path.c_str()) == 0;
  if (!created && errno != EEXIST && ::access(path.c_str(), F_OK) != 0) {
    // A file system without hard links: whoever comes at the same moment is not noticed.
    if (::rename(whole.c_str(), path.c_str()) != 0) fail("write", path);
    created = true;
  }
  ::unlink(whole.c_str());
  sync_folder(folder_of(path));
  return created;
}

void create_output_folder(const fs::path& folder) {
  if (folder.empty()) return create_output_folder(".");
  std::error_code error;
  fs::create_directories(folder, error);
  require_writable(folder, error);
}

void check_output_folder(const fs::path& folder) {
  fs::path nearest = folder;
  while (!nearest.empty() && !is_there(nearest)) nearest = nearest.parent_path();
  require_writable(nearest.empty() ? fs::path(".") : nearest, {});
}

bool is_there(const fs::path& path) {
  std::error_code error;
  const bool found = fs::exists(path, error);
  if (error) throw InputError("cannot open " + path.string() + ": " + error.message());
  return found;
}

std::vector<std::uint8_t> read_file(const fs::path& path, std::size_t max_bytes) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat status {};
  if (file.get() < 0 || ::fstat(file.get(), &status) != 0)
    throw InputError("cannot open " + path.string() + ": " + std::strerror(errno));
  if (S_ISDIR(status.st_mode))
    throw InputError("cannot read " + path.string() + ": it is a folder");
  const auto too_large = [&] {
    return InputError("cannot read " + path.string() + ": larger than " +
                      std::to_string(max_bytes) + " bytes");
  };
  const auto size = static_cast<std::size_t>(status.st_size);
  if (size > max_bytes) throw too_large();

  // One byte more than the size, so that the end of the file is seen; pipes have no size and grow.
  std::vector<std::uint8_t> bytes(size + 1);
  std::size_t done = 0;
  while (true) {
    const ssize_t n = ::read(file.get(), bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail("read", path);
    if (n == 0) break;
    done += static_cast<std::size_t>(n);
    if (done > max_bytes) throw too_large();
    if (done == bytes.size()) bytes.resize(2 * bytes.size());
  }
  bytes.resize(done);
  return bytes;
}

}  // namespace agail
