// Selection of the kernels by CPU features and environment.
#include "server/engine/kernels/dispatch.hpp"

#include <cstdlib>
#include <string>

namespace windsplat::engine::kernels {

namespace {

Result<const Table*> choose() {
  const std::vector<const Table*> usable = usable_tables();
  const char* wanted = std::getenv("WINDSPLAT_TARGET");  // NOLINT(concurrency-mt-unsafe)
  if (wanted == nullptr || *wanted == '\0') return usable.back();
  std::string names;
  for (const Table* table : usable) {
    if (std::string(wanted) == table->name) return table;
    names += names.empty() ? table->name : std::string(", ") + table->name;
  }
  return make_error(ErrorKind::invalid, "WINDSPLAT_TARGET is \"" + printable(wanted) +
                                            "\"; this processor runs " + names);
}

}  // namespace

std::vector<const Table*> usable_tables() {
  std::vector<const Table*> usable{&portable_table()};
#ifdef WINDSPLAT_KERNELS_SSE4
  if (__builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("popcnt") &&
      __builtin_cpu_supports("ssse3")) {
    usable.push_back(&sse4_table());
  }
#endif
#ifdef WINDSPLAT_KERNELS_AVX2
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
      __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2")) {
    usable.push_back(&avx2_table());
  }
#endif
#ifdef WINDSPLAT_KERNELS_AVX512
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
      __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl")) {
    usable.push_back(&avx512_table());
  }
#endif
#ifdef WINDSPLAT_KERNELS_NEON
  usable.push_back(&neon_table());  // part of every arm64 processor
#endif
  return usable;
}

Result<const Table*> chosen_table() {
  static const Result<const Table*> table = choose();
  return table;
}

}  // namespace windsplat::engine::kernels
