// Highway's choice of an instruction set, in place of that of its library: version 1.0 of the
// library measures the resolution of the clock whenever a program starts, which takes 4 ms. The
// linker leaves out the library unless a newer version of its headers needs more of it.
#include <hwy/highway.h>

#if HWY_ARCH_X86
#include <cpuid.h>
#endif

#include <cstdint>

namespace hwy {

namespace {

#if HWY_ARCH_X86
// Features that __builtin_cpu_supports() of some compilers does not know: conversions of half
// floats and LZCNT (AMD64 Architecture Programmer's Manual, volume 3, appendix E.3).
bool has_half_floats_and_lzcnt() {
  unsigned a = 0;
  unsigned b = 0;
  unsigned c = 0;
  unsigned d = 0;
  constexpr unsigned f16c = 1U << 29U;
  constexpr unsigned lzcnt = 1U << 5U;
  if (__get_cpuid(1, &a, &b, &c, &d) == 0 || (c & f16c) == 0) return false;
  return __get_cpuid(0x80000001, &a, &b, &c, &d) != 0 && (c & lzcnt) != 0;
}

// Each includes those before it; as in ops/set_macros-inl.h of Highway.
std::int64_t found_targets() {
  std::int64_t out = 0;
  if (!__builtin_cpu_supports("ssse3")) return out;
  out |= HWY_SSSE3;
  if (!__builtin_cpu_supports("sse4.2") || !__builtin_cpu_supports("popcnt") ||
      !__builtin_cpu_supports("pclmul") || !__builtin_cpu_supports("aes")) {
    return out;
  }
  out |= HWY_SSE4;
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma") ||
      !__builtin_cpu_supports("bmi") || !__builtin_cpu_supports("bmi2") ||
      !has_half_floats_and_lzcnt()) {
    return out;
  }
  out |= HWY_AVX2;
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
      __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl")) {
    out |= HWY_AVX3;
  }
  return out;
}
#else
std::int64_t found_targets() { return 0; }
#endif

}  // namespace

// The set that the compiler was allowed to use throughout is always present.
std::int64_t SupportedTargets() {
  static const std::int64_t found = found_targets() | HWY_ENABLED_BASELINE;
  return found;
}

ChosenTarget& GetChosenTarget() {
  static ChosenTarget chosen;
  return chosen;
}

}  // namespace hwy
