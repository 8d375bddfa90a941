#include "agail/base/archive.h"

namespace agail {

std::size_t size_of(DType type) {
  switch (type) {
    case DType::kF32:
      return 4;
    case DType::kF64:
      return 8;
    case DType::kI64:
      return 8;
    case DType::kU8:
      return 1;
  }
  AGAIL_CHECK(false);
}

const char* name_of(DType type) {
  switch (type) {
    case DType::kF32:
      return "F32";
    case DType::kF64:
      return "F64";
    case DType::kI64:
      return "I64";
    case DType::kU8:
      return "U8";
  }
  AGAIL_CHECK(false);
}

const Tensor& Archive::find(const std::string& name, DType dtype) const {
  const auto it = store_.tensors.find(name);
  if (it == store_.tensors.end()) throw InputError("array '" + name + "' is missing");
  if (it->second.dtype != dtype)
    throw InputError("array '" + name + "' has type " + name_of(it->second.dtype) + ", expected " +
                     name_of(dtype));
  return it->second;
}

}  // namespace agail
