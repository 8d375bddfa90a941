// NumPy arrays that own their numbers.
#pragma once

#include <nanobind/ndarray.h>

#include <algorithm>
#include <initializer_list>
#include <numeric>
#include <span>

namespace agail {

template <class T>
using Array = nanobind::ndarray<nanobind::numpy, T>;
template <class T>
using InputArray = nanobind::ndarray<const T, nanobind::c_contig, nanobind::device::cpu>;

// Uninitialised.
template <class T>
Array<T> make_array(std::initializer_list<std::size_t> shape) {
  const std::size_t size =
      std::accumulate(shape.begin(), shape.end(), std::size_t{1}, std::multiplies<>());
  auto* data = new T[std::max<std::size_t>(size, 1)];
  const nanobind::capsule owner(data,
                                [](void* pointer) noexcept { delete[] static_cast<T*>(pointer); });
  return Array<T>(data, shape, owner);
}

template <class T, class From>
Array<T> copy_array(const From* data, std::initializer_list<std::size_t> shape) {
  Array<T> array = make_array<T>(shape);
  std::transform(data, data + array.size(), array.data(),
                 [](const From& value) { return static_cast<T>(value); });
  return array;
}

}  // namespace agail
