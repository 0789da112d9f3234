// Picture and truth -> their difference in linear light.
#pragma once

#include <span>

namespace windsplat::frame {

// Over the four channels of linear premultiplied RGBA. Not-a-number when a value of either is.
struct Difference {
  double rmse = 0;
  double max = 0;
  double psnr = 0;  // dB against a peak of 1; infinite when nothing differs
};

// Both row 0 on top, 4 values a pixel, of one size, not empty.
Difference difference_of(std::span<const float> picture, std::span<const float> truth);
Difference difference_of(std::span<const float> picture, std::span<const double> truth);

// PSNR in dB against a peak of 1.
double psnr_of(double rmse);

}  // namespace windsplat::frame
