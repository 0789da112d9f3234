// Picture and reference -> their difference in linear light.
#pragma once

#include <span>

namespace windsplat::frame {

// Over the four channels of linear premultiplied RGBA. NaN if a value of either picture is NaN.
struct Difference {
  double rmse = 0;
  double max = 0;
  double psnr = 0;  // dB relative to a peak of 1; infinite if the pictures are equal
};

// Both pictures have row 0 on top, 4 values per pixel and the same size, and are not empty.
Difference difference_of(std::span<const float> picture, std::span<const float> truth);
Difference difference_of(std::span<const float> picture, std::span<const double> truth);

// PSNR in dB relative to a peak of 1.
double psnr_of(double rmse);

}  // namespace windsplat::frame
