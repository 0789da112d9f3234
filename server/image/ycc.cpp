// Parts of a picture -> rows of codes -> planes, padded to whole MCUs.
#include "server/image/ycc.hpp"

#include <algorithm>

#include "server/base/check.hpp"
#include "server/base/trim_storage.hpp"

namespace windsplat::image {
namespace {

constexpr std::size_t row_floats = std::size_t{4} * row_pixels;

std::uint8_t* at(const YccPicture::Plane& plane, int x, int y) {
  return plane.samples + static_cast<std::ptrdiff_t>(y) * plane.width + x;
}

// Returns row_pixels pixels of a row; if fewer are left, a copy padded with the last one.
class RowReader {
 public:
  const float* operator()(const float* row, int count) {
    if (count == row_pixels) return row;
    float* to = std::copy_n(row, 4 * count, filled_.data());
    const float* last = to - 4;
    for (int i = count; i < row_pixels; ++i) to = std::copy_n(last, 4, to);
    return filled_.data();
  }

 private:
  alignas(64) std::array<float, row_floats> filled_;
};

// Pads with the last code; for subsampled chroma that is the mean of the last pair.
void store(const RowCodes& codes, int count, int stored, std::uint8_t* to) {
  std::copy_n(codes.data(), count, to);
  if (stored > count) std::fill_n(to + count, stored - count, codes[count - 1]);
}

}  // namespace

void YccPicture::reset(int width, int height, Subsampling subsampling,
                       const std::array<float, 3>& background) {
  WINDSPLAT_CHECK(width > 0 && height > 0);
  width_ = width;
  height_ = height;
  subsampling_ = subsampling;
  background_ = background_of(background);
  const int mcu = mcu_side();
  const int columns = (width + mcu - 1) / mcu;
  const int rows = (height + mcu - 1) / mcu;
  const std::array<float, row_floats> nothing{};
  YccRow row;
  convert_row(nothing.data(), background_, row);
  const std::array<std::uint8_t, 3> codes{row.luma[0], row.blue[0], row.red[0]};
  for (std::size_t p = 0; p < planes_.size(); ++p) {
    const int side = p == 0 ? mcu : 8;
    planes_[p].width = columns * side;
    planes_[p].height = rows * side;
    const std::size_t samples = static_cast<std::size_t>(planes_[p].width) * planes_[p].height;
    trim_storage(storage_[p], samples, retained_pixels);
    storage_[p].assign(samples, codes[p]);
    planes_[p].samples = storage_[p].data();
  }
}

void YccPicture::put(const Part& part) {
  const bool right = part.x + part.width == width_;
  const bool bottom = part.y + part.height == height_;
  WINDSPLAT_CHECK(part.x >= 0 && part.y >= 0 && part.width > 0 && part.height > 0);
  WINDSPLAT_CHECK(part.x + part.width <= width_ && part.y + part.height <= height_);
  WINDSPLAT_CHECK(subsampling_ == Subsampling::s444 ||
                  (part.x % 2 == 0 && part.y % 2 == 0 && (part.width % 2 == 0 || right) &&
                   (part.height % 2 == 0 || bottom)));
  for (int x = 0; x < part.width; x += row_pixels) {
    const int count = std::min(row_pixels, part.width - x);
    // The last pixels of a row are padded to the end of their MCU.
    const bool last = right && x + count == part.width;
    const int stored = last ? planes_[0].width - (part.x + x) : count;
    if (subsampling_ == Subsampling::s420) {
      put_halved(part, x, count, stored);
    } else {
      put_full(part, x, count, stored);
    }
  }
  if (bottom) repeat_last_row(part.x, right ? planes_[0].width : part.x + part.width);
}

void YccPicture::put_full(const Part& part, int x, int count, int stored) {
  RowReader pixels;
  YccRow codes;
  for (int y = 0; y < part.height; ++y) {
    const float* row = part.rgba + static_cast<std::size_t>(y) * part.stride;
    convert_row(pixels(row + std::ptrdiff_t{4} * x, count), background_, codes);
    store(codes.luma, count, stored, at(planes_[0], part.x + x, part.y + y));
    store(codes.blue, count, stored, at(planes_[1], part.x + x, part.y + y));
    store(codes.red, count, stored, at(planes_[2], part.x + x, part.y + y));
  }
}

void YccPicture::put_halved(const Part& part, int x, int count, int stored) {
  RowReader upper;
  RowReader lower;
  YccPair codes;
  const int cx = (part.x + x) / 2;
  for (int y = 0; y < part.height; y += 2) {
    const bool both = y + 1 < part.height;
    const float* row =
        part.rgba + static_cast<std::size_t>(y) * part.stride + std::ptrdiff_t{4} * x;
    const float* above = upper(row, count);
    convert_pair(above, both ? lower(row + part.stride, count) : above, background_, codes);
    store(codes.upper, count, stored, at(planes_[0], part.x + x, part.y + y));
    if (both) store(codes.lower, count, stored, at(planes_[0], part.x + x, part.y + y + 1));
    const int cy = (part.y + y) / 2;
    store(codes.blue, (count + 1) / 2, (stored + 1) / 2, at(planes_[1], cx, cy));
    store(codes.red, (count + 1) / 2, (stored + 1) / 2, at(planes_[2], cx, cy));
  }
}

void YccPicture::repeat_last_row(int x, int x_end) {
  for (std::size_t p = 0; p < planes_.size(); ++p) {
    const Plane& plane = planes_[p];
    const int scale = p == 0 ? 1 : mcu_side() / 8;
    const std::uint8_t* row = at(plane, x / scale, (height_ - 1) / scale);
    for (int y = (height_ - 1) / scale + 1; y < plane.height; ++y) {
      std::copy_n(row, (x_end - x) / scale, at(plane, x / scale, y));
    }
  }
}

}  // namespace windsplat::image
