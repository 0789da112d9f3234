// A figure as pixels, composited with pictures in linear light.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/annotate/figure.hpp"
#include "server/base/error.hpp"

namespace windsplat::annotate {

// Bytes of an overlay of that size.
std::uint64_t overlay_bytes(int width, int height);

class Overlay {
 public:
  // Errors: out_of_memory.
  static Result<Overlay> of(const Figure& figure);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  // Whether any of `count` pixels from column x of row y is covered.
  [[nodiscard]] bool covers(int x, int y, int count) const;
  // Composites the pixels of `rgba` (linear, premultiplied, 4 floats each) that lie from column x
  // of row y with what is below and above them.
  void composite(int x, int y, int count, float* rgba) const;

 private:
  // The columns of a row that have anything.
  struct Span {
    int begin = 0, end = 0;
  };

  int width_ = 0, height_ = 0;
  std::vector<std::uint32_t> below_, above_;  // 8-bit sRGB, premultiplied, alpha highest
  std::vector<Span> spans_;                   // by row
};

}  // namespace windsplat::annotate
