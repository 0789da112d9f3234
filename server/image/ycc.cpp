// Rows of pixels -> sRGB values of 16 bits by table -> luma and chroma, in loops that vectorise.
#include "server/image/ycc.hpp"

#include <algorithm>
#include <bit>

#include "server/base/check.hpp"
#include "server/image/tone_map.hpp"

namespace windsplat::image {
namespace {

using Value = std::int16_t;  // an sRGB value, 0..255, in units of 1/128

constexpr int chunk = 64;  // pixels of a row that are worked on together
constexpr int value_bits = 7;
constexpr int weight_bits = 14;
constexpr std::int32_t weight_one = 1 << weight_bits;

// Linear values shifted up by 1/64 have 1024 bins an octave: finer than 1/4 of a code everywhere,
// though the table is small enough to stay close. A value is that of its bin's middle; it is not
// rounded to a code before luma and chroma are made of it.
class ValueTable {
 public:
  static constexpr float shift = 1.0F / 64;
  static constexpr std::uint32_t first = std::bit_cast<std::uint32_t>(shift);
  static constexpr int bin_bits = 13;  // of 23
  static constexpr std::uint32_t last =
      (std::bit_cast<std::uint32_t>(1 + shift) - first) >> bin_bits;

  ValueTable() {
    for (std::uint32_t bin = 0; bin <= last; ++bin) {
      const std::uint32_t middle = first + (bin << bin_bits) + (1U << (bin_bits - 1));
      const double linear = static_cast<double>(std::bit_cast<float>(middle)) - shift;
      values_[bin] = static_cast<Value>((255 << value_bits) * srgb_from_linear(linear) + 0.5);
    }
  }

  [[nodiscard]] const Value* values() const { return values_.data(); }

 private:
  std::array<Value, last + 1> values_{};
};

const Value* value_table() {
  static const ValueTable table;
  return table.values();
}

inline std::uint32_t bin_of(float linear) {
  const float above_zero = linear > 0.0F ? linear : 0.0F;  // also of NaN
  const float x = above_zero < 1.0F ? above_zero : 1.0F;
  return (std::bit_cast<std::uint32_t>(x + ValueTable::shift) - ValueTable::first) >>
         ValueTable::bin_bits;
}

struct Row {
  std::array<Value, chunk> red;
  std::array<Value, chunk> green;
  std::array<Value, chunk> blue;
};

// `count` pixels over the background.
void fill_row(const float* __restrict rgba, int count, const std::array<float, 3>& background,
              const Value* table, Row& row) {
  std::array<std::uint32_t, chunk> red;
  std::array<std::uint32_t, chunk> green;
  std::array<std::uint32_t, chunk> blue;
  const auto [r, g, b] = background;
  for (int i = 0; i < count; ++i) {
    const float* pixel = rgba + std::ptrdiff_t{4} * i;
    const float transmittance = 1.0F - pixel[3];
    red[i] = bin_of(pixel[0] + transmittance * r);
    green[i] = bin_of(pixel[1] + transmittance * g);
    blue[i] = bin_of(pixel[2] + transmittance * b);
  }
  for (int i = 0; i < count; ++i) {
    row.red[i] = table[red[i]];
    row.green[i] = table[green[i]];
    row.blue[i] = table[blue[i]];
  }
}

constexpr std::int32_t weight(double share) {
  return static_cast<std::int32_t>(share * weight_one + (share < 0 ? -0.5 : 0.5));
}

// ITU-T T.871 (JFIF), section 7. Green's weights are what the others leave, so that grey has the
// luma of its value and no chroma.
inline std::uint8_t luma(Value red, Value green, Value blue) {
  constexpr std::int32_t r = weight(0.299);
  constexpr std::int32_t b = weight(0.114);
  constexpr std::int32_t g = weight_one - r - b;
  constexpr std::int32_t half = 1 << (weight_bits + value_bits - 1);
  return static_cast<std::uint8_t>((r * red + g * green + b * blue + half) >>
                                   (weight_bits + value_bits));
}

// Blue-difference of (near, far) = (blue, red), red-difference of (red, blue).
template <int FarMillionths>
inline std::uint8_t chroma(Value near, Value green, Value far) {
  constexpr std::int32_t n = weight_one / 2;
  constexpr std::int32_t f = -weight(FarMillionths * 1e-6);
  constexpr std::int32_t g = -n - f;
  // One unit under a half: the greatest chroma, 255.5, is code 255.
  constexpr std::int32_t middle =
      (128 << (weight_bits + value_bits)) + (1 << (weight_bits + value_bits - 1)) - 1;
  const std::int32_t sum = n * near + g * green + f * far + middle;
  return static_cast<std::uint8_t>(sum >> (weight_bits + value_bits));
}

void store_luma(const Row& row, int count, std::uint8_t* __restrict to) {
  for (int i = 0; i < count; ++i) to[i] = luma(row.red[i], row.green[i], row.blue[i]);
}

void store_chroma(const Row& row, int count, std::uint8_t* __restrict blue,
                  std::uint8_t* __restrict red) {
  constexpr int of_red = 168736;  // 0.299 / 1.772
  constexpr int of_blue = 81312;  // 0.114 / 1.402
  for (int i = 0; i < count; ++i) {
    blue[i] = chroma<of_red>(row.blue[i], row.green[i], row.red[i]);
    red[i] = chroma<of_blue>(row.red[i], row.green[i], row.blue[i]);
  }
}

void halve(const std::array<Value, chunk>& upper, const std::array<Value, chunk>& lower, int count,
           std::array<Value, chunk>& means) {
  for (int i = 0; i < count; ++i) {
    const std::int32_t sum = upper[2 * i] + upper[2 * i + 1] + lower[2 * i] + lower[2 * i + 1];
    means[i] = static_cast<Value>((sum + 2) >> 2);
  }
}

void repeat_last(Row& row, int count) {
  row.red[count] = row.red[count - 1];
  row.green[count] = row.green[count - 1];
  row.blue[count] = row.blue[count - 1];
}

std::uint8_t* at(const YccPicture::Plane& plane, int x, int y) {
  return plane.samples + static_cast<std::ptrdiff_t>(y) * plane.width + x;
}

}  // namespace

void YccPicture::reset(int width, int height, Subsampling subsampling,
                       const std::array<float, 3>& background) {
  WINDSPLAT_CHECK(width > 0 && height > 0);
  width_ = width;
  height_ = height;
  subsampling_ = subsampling;
  background_ = background;
  const int mcu = mcu_side();
  const int columns = (width + mcu - 1) / mcu;
  const int rows = (height + mcu - 1) / mcu;
  Row row;
  const std::array<float, 4> nothing{};
  fill_row(nothing.data(), 1, background, value_table(), row);
  std::array<std::uint8_t, 3> codes{};
  store_luma(row, 1, &codes[0]);
  store_chroma(row, 1, &codes[1], &codes[2]);
  for (std::size_t p = 0; p < planes_.size(); ++p) {
    const int side = p == 0 ? mcu : 8;
    planes_[p].width = columns * side;
    planes_[p].height = rows * side;
    storage_[p].assign(static_cast<std::size_t>(planes_[p].width) * planes_[p].height, codes[p]);
    planes_[p].samples = storage_[p].data();
  }
}

void YccPicture::put(const Part& part) {
  const bool halved = subsampling_ == Subsampling::s420;
  WINDSPLAT_CHECK(part.x >= 0 && part.y >= 0 && part.width > 0 && part.height > 0);
  WINDSPLAT_CHECK(part.x + part.width <= width_ && part.y + part.height <= height_);
  WINDSPLAT_CHECK(!halved || (part.x % 2 == 0 && part.y % 2 == 0 &&
                              (part.width % 2 == 0 || part.x + part.width == width_) &&
                              (part.height % 2 == 0 || part.y + part.height == height_)));
  const Value* table = value_table();
  std::array<Row, 2> rows;
  Row means;
  for (int y = 0; y < part.height; y += 2) {
    const int lines = std::min(2, part.height - y);
    for (int x = 0; x < part.width; x += chunk) {
      const int count = std::min(chunk, part.width - x);
      for (int line = 0; line < lines; ++line) {
        const float* from =
            part.rgba + static_cast<std::size_t>(y + line) * part.stride + std::ptrdiff_t{4} * x;
        fill_row(from, count, background_, table, rows[line]);
        const int py = part.y + y + line;
        store_luma(rows[line], count, at(planes_[0], part.x + x, py));
        if (halved) continue;
        store_chroma(rows[line], count, at(planes_[1], part.x + x, py),
                     at(planes_[2], part.x + x, py));
      }
      if (!halved) continue;
      for (int line = 0; line < lines && count % 2 != 0; ++line) repeat_last(rows[line], count);
      const Row& lower = rows[lines - 1];
      const int pairs = (count + 1) / 2;
      halve(rows[0].red, lower.red, pairs, means.red);
      halve(rows[0].green, lower.green, pairs, means.green);
      halve(rows[0].blue, lower.blue, pairs, means.blue);
      const int cx = (part.x + x) / 2;
      const int cy = (part.y + y) / 2;
      store_chroma(means, pairs, at(planes_[1], cx, cy), at(planes_[2], cx, cy));
    }
  }
  pad(part);
}

void YccPicture::pad(const Part& part) {
  const bool right = part.x + part.width == width_;
  const bool bottom = part.y + part.height == height_;
  if (!right && !bottom) return;
  for (std::size_t p = 0; p < planes_.size(); ++p) {
    const Plane& plane = planes_[p];
    const int scale = p == 0 ? 1 : mcu_side() / 8;
    const int x = part.x / scale;
    const int x_end = (part.x + part.width + scale - 1) / scale;
    const int y_end = (part.y + part.height + scale - 1) / scale;
    for (int y = part.y / scale; right && y < y_end; ++y) {
      std::fill(at(plane, x_end, y), at(plane, plane.width, y), *at(plane, x_end - 1, y));
    }
    const int count = (right ? plane.width : x_end) - x;
    for (int y = y_end; bottom && y < plane.height; ++y) {
      std::copy_n(at(plane, x, y_end - 1), count, at(plane, x, y));
    }
  }
}

}  // namespace windsplat::image
