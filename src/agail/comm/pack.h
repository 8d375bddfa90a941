// Numbers into a message and out again, in the same order on both sides.
#pragma once

#include <cstring>
#include <type_traits>

#include "agail/base/error.h"
#include "agail/comm/communicator.h"

namespace agail {

class Packer {
 public:
  explicit Packer(Bytes& message) : message_(message) { message_.clear(); }

  template <class T>
  void array(const T* values, std::size_t count) {
    static_assert(std::is_trivially_copyable_v<T>);
    const auto* bytes = reinterpret_cast<const std::byte*>(values);
    message_.insert(message_.end(), bytes, bytes + count * sizeof(T));
  }
  template <class T>
  void number(T value) {
    array(&value, 1);
  }

 private:
  Bytes& message_;
};

class Unpacker {
 public:
  explicit Unpacker(std::span<const std::byte> message) : message_(message) {}

  template <class T>
  void array(T* values, std::size_t count) {
    static_assert(std::is_trivially_copyable_v<T>);
    const std::size_t bytes = count * sizeof(T);
    AGAIL_CHECK(bytes <= message_.size());
    if (bytes > 0) std::memcpy(values, message_.data(), bytes);
    message_ = message_.subspan(bytes);
  }
  template <class T>
  T number() {
    T value{};
    array(&value, 1);
    return value;
  }

 private:
  std::span<const std::byte> message_;
};

}  // namespace agail
