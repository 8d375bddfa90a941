#include "agail/base/build_info.h"

namespace agail {

std::string cpu_features() {
#if defined(__x86_64__)
  std::string features = "x86-64";
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx2")) features += " avx2";
  if (__builtin_cpu_supports("fma")) features += " fma";
  if (__builtin_cpu_supports("avx512f")) features += " avx512f";
  return features;
#else
  return "other";
#endif
}

}  // namespace agail
