#include "server/frame/pair/pair.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/annotate/paint/document.hpp"
#include "server/base/check.hpp"

namespace windsplat::frame {
namespace {

constexpr std::uint8_t gap_gray = 128;  // sRGB

image::Bytes joined_pixels(const std::array<Frame, 2>& frames, int width) {
  constexpr std::size_t channels = 3;
  const std::size_t row = channels * static_cast<std::size_t>(width);
  const std::size_t panel = channels * static_cast<std::size_t>(frames[0].width);
  const auto height = static_cast<std::size_t>(frames[0].height);
  image::Bytes out(row * height, gap_gray);
  for (std::size_t y = 0; y < height; ++y) {
    std::copy_n(frames[0].bytes.data() + y * panel, panel, out.data() + y * row);
    std::copy_n(frames[1].bytes.data() + y * panel, panel, out.data() + (y + 1) * row - panel);
  }
  return out;
}

}  // namespace

int gap_of_pair(int height) { return std::max(2, height / 180); }

Result<Encoding> raw_of_pair(const Encoding& encoding) {
  if (encoding.format == Format::npy) {
    return make_error(ErrorKind::invalid,
                      "an .npy file holds one picture: draw the two one after the other");
  }
  Encoding raw = encoding;
  if (raw.format == Format::jpeg) raw.format = Format::png;
  raw.raw = true;
  return raw;
}

Result<image::Bytes> encode_pair(const std::array<Frame, 2>& frames, const Encoding& encoding,
                                 const CancelToken& cancel) {
  const auto raw = raw_of_pair(encoding);
  if (!raw) return raw.error();
  const int height = frames[0].height;
  WINDSPLAT_CHECK(frames[0].width == frames[1].width && height == frames[1].height);
  const int width = 2 * frames[0].width + gap_of_pair(height);
  image::Bytes rgb = joined_pixels(frames, width);
  if (encoding.raw) return rgb;
  std::vector<annotate::Part> parts;
  for (const Frame& frame : frames) {
    if (frame.figure)
      parts.push_back({*frame.figure, &frame == &frames[0] ? 0 : width - frame.width});
  }
  const annotate::Page page{rgb, width, height, parts,
                            encoding.dots_per_inch.value_or(document_dots_per_inch)};
  switch (encoding.format) {
    case Format::jpeg:
      return image::encode_jpeg(rgb, width, height, encoding.quality, encoding.subsampling);
    case Format::pdf:
      return annotate::encode_pdf(page);
    case Format::svg:
      return annotate::encode_svg(page);
    case Format::png:
    case Format::npy:
      break;
  }
  return image::encode_png(rgb, width, height, cancel, encoding.dots_per_inch);
}

}  // namespace windsplat::frame
