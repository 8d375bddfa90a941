// Named arrays: what policies, checkpoints and lanes are saved as. Knows nothing of file formats.
#pragma once

#include <cstdint>
#include <cstring>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "agail/base/error.h"

namespace agail {

enum class DType { kF32, kF64, kI64, kU8 };
std::size_t size_of(DType type);
const char* name_of(DType type);  // safetensors' names: F32 F64 I64 U8

struct Tensor {
  DType dtype = DType::kF32;
  std::vector<std::size_t> shape;
  std::vector<std::uint8_t> bytes;  // row-major, little-endian
};

struct TensorStore {
  std::map<std::string, Tensor> tensors;
  std::map<std::string, std::string> metadata;
};

// Walks an object's state in one function that serves both directions:
//   void Adam::archive(Archive& a) { a("first_moment", first_); a("step", step_); }
// When loading, a missing name, another dtype or another size is an InputError that names the
// array.
class Archive {
 public:
  enum class Mode { kSave, kLoad };
  Archive(TensorStore& store, Mode mode) : store_(store), mode_(mode) {}

  bool loading() const { return mode_ == Mode::kLoad; }

  // Arrays of a size that the object already has.
  void operator()(const std::string& name, std::span<float> values) {
    transfer(name, values, DType::kF32);
  }
  void operator()(const std::string& name, std::span<double> values) {
    transfer(name, values, DType::kF64);
  }
  void operator()(const std::string& name, std::span<std::int64_t> values) {
    transfer(name, values, DType::kI64);
  }
  void operator()(const std::string& name, double& value) {
    (*this)(name, std::span<double>(&value, 1));
  }
  void operator()(const std::string& name, std::int64_t& value) {
    (*this)(name, std::span<std::int64_t>(&value, 1));
  }
  // Arrays whose length is part of the state.
  template <class T>
  void resizable(const std::string& name, std::vector<T>& values);

  // Names inside `body` get the prefix "name.".
  template <class F>
  void scope(const std::string& name, F&& body) {
    const std::string outer = prefix_;
    prefix_ += name + ".";
    body(*this);
    prefix_ = outer;
  }

 private:
  template <class T>
  void transfer(const std::string& name, std::span<T> values, DType dtype) {
    const std::size_t bytes = values.size_bytes();
    if (mode_ == Mode::kSave) {
      Tensor& tensor = store_.tensors[prefix_ + name];
      tensor.dtype = dtype;
      tensor.shape = {values.size()};
      tensor.bytes.resize(bytes);
      if (bytes > 0) std::memcpy(tensor.bytes.data(), values.data(), bytes);
    } else {
      const Tensor& tensor = find(prefix_ + name, dtype);
      if (tensor.bytes.size() != bytes)
        throw InputError("array '" + prefix_ + name + "' has " +
                         std::to_string(tensor.bytes.size() / sizeof(T)) + " values, expected " +
                         std::to_string(values.size()));
      if (bytes > 0) std::memcpy(values.data(), tensor.bytes.data(), bytes);
    }
  }
  const Tensor& find(const std::string& name, DType dtype) const;

  TensorStore& store_;
  Mode mode_;
  std::string prefix_;
};

template <class T>
void Archive::resizable(const std::string& name, std::vector<T>& values) {
  if (loading()) {
    DType dtype = DType::kI64;
    if constexpr (std::is_same_v<T, float>) dtype = DType::kF32;
    if constexpr (std::is_same_v<T, double>) dtype = DType::kF64;
    values.resize(find(prefix_ + name, dtype).bytes.size() / sizeof(T));
  }
  (*this)(name, std::span<T>(values));
}

}  // namespace agail
