// A picture with the figure over it as a document whose texts are texts and lines are lines.
#pragma once

#include <cstdint>
#include <span>

#include "server/annotate/figure.hpp"
#include "server/base/error.hpp"
#include "server/image/encode.hpp"

namespace windsplat::annotate {

// A figure whose left edge lies at a column of the picture; what lies beyond its size is cut off.
struct Part {
  const Figure& figure;
  int left = 0;
};
// A picture with the figures over it; without parts the picture alone.
struct Page {
  std::span<const std::uint8_t> rgb;  // 8-bit sRGB
  int width = 0, height = 0;
  std::span<const Part> parts;
  double dots_per_inch = 300;
};
// As those of one figure, below.
Result<image::Bytes> encode_pdf(const Page& page);
Result<image::Bytes> encode_svg(const Page& page);

// `rgb`: the picture, 8-bit sRGB, width x height of the figure, with figure.below drawn into it;
// only figure.above is drawn over it. The document is `dots_per_inch` pixels to the inch, and the
// same bytes for the same arguments. Errors: internal, out_of_memory.
// PDF 1.5 (ISO 32000-1), with the font embedded.
Result<image::Bytes> encode_pdf(std::span<const std::uint8_t> rgb, const Figure& figure,
                                double dots_per_inch);
// SVG 1.1 with the picture as a PNG; texts are set in DejaVu Sans, or what the reader has in its
// place.
Result<image::Bytes> encode_svg(std::span<const std::uint8_t> rgb, const Figure& figure,
                                double dots_per_inch);

}  // namespace windsplat::annotate
