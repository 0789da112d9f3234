// Parts of linear premultiplied RGBA -> planes of 8-bit YCbCr for JPEG encoding.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/image/encode.hpp"
#include "server/image/ycc_rows.hpp"

namespace windsplat::image {

// Pixels of a picture: linear premultiplied RGBA, 4 floats per pixel, `stride` floats per row.
struct Part {
  int x = 0;  // position of its upper left pixel in the picture
  int y = 0;
  int width = 0;
  int height = 0;
  const float* rgba = nullptr;
  std::size_t stride = 0;
};

// JFIF's YCbCr (ITU-R BT.601, full range) of sRGB values. Chroma of 4:2:0 is the mean of 2 x 2
// pixels. Planes reach to whole MCUs; past the picture they repeat its last column and row.
class YccPicture {
 public:
  struct Plane {
    std::uint8_t* samples = nullptr;  // row 0 on top, no gap between rows
    int width = 0;                    // whole MCUs
    int height = 0;
  };

  // Sets every pixel to the linear background. Keeps storage for up to retained_pixels.
  void reset(int width, int height, Subsampling subsampling,
             const std::array<float, 3>& background);

  // Composites pixels over the background of reset(). Disjoint parts may be written concurrently;
  // with 4:2:0 they must begin at even columns and rows.
  void put(const Part& part);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] Subsampling subsampling() const { return subsampling_; }
  [[nodiscard]] int mcu_side() const { return subsampling_ == Subsampling::s420 ? 16 : 8; }
  // Y, Cb, Cr.
  [[nodiscard]] const std::array<Plane, 3>& planes() const { return planes_; }

 private:
  // Converts `count` pixels of `part`, starting at its column x, and writes `stored` columns.
  void put_full(const Part& part, int x, int count, int stored);
  void put_halved(const Part& part, int x, int count, int stored);
  void repeat_last_row(int x, int x_end);

  int width_ = 0;
  int height_ = 0;
  Subsampling subsampling_ = Subsampling::s420;
  Background background_;
  std::array<Plane, 3> planes_{};
  std::array<std::vector<std::uint8_t>, 3> storage_;
};

}  // namespace windsplat::image
