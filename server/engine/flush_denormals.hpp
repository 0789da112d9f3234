// Treats denormal numbers as zero within a scope: they are some hundred times slower, and their
// contribution is invisible.
#pragma once

#include <cstdint>

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

namespace windsplat::engine {

class FlushDenormals {
 public:
  FlushDenormals() : before_(control()) { set_control(before_ | flush); }
  ~FlushDenormals() { set_control(before_); }
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

 private:
  // The control register of floating point and its bits for denormals as operands and as results.
#if defined(__SSE__)
  using Control = unsigned;
  static constexpr Control flush = 0x8040U;
  static Control control() { return _mm_getcsr(); }
  static void set_control(Control value) { _mm_setcsr(value); }
#elif defined(__aarch64__)
  using Control = std::uint64_t;
  static constexpr Control flush = 1U << 24U;  // FPCR.FZ: both
  static Control control() {
    Control value = 0;
    __asm__ volatile("mrs %0, fpcr" : "=r"(value));
    return value;
  }
  static void set_control(Control value) { __asm__ volatile("msr fpcr, %0" : : "r"(value)); }
#else
  using Control = unsigned;  // denormals are kept
  static constexpr Control flush = 0;
  static Control control() { return 0; }
  static void set_control(Control /*value*/) {}
#endif

  Control before_;
};

}  // namespace windsplat::engine
