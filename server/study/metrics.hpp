// Picture and truth -> how far apart they are: in linear light, and as an eye sees it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace windsplat::study {

// Whether every value is finite and within [0, 1], but for `slack`.
bool within_unit(std::span<const float> rgba, double slack);

// Mean of LDR-FLIP (Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", HPG
// 2020) of two sRGB pictures, 3 bytes a pixel, at 67 pixels a degree: 0 alike, 1 as far apart as
// can be.
double mean_flip(std::span<const std::uint8_t> reference_rgb,
                 std::span<const std::uint8_t> test_rgb, int width, int height);

// A picture made larger or smaller: bilinear between pixel centres, constant beyond the outer ones.
std::vector<float> resample(std::span<const float> rgba, int width, int height, int to_width,
                            int to_height);

// RMSE in linear light of two sRGB pictures: what an encoding costs.
double linear_rmse(std::span<const std::uint8_t> rgb, std::span<const std::uint8_t> decoded);

}  // namespace windsplat::study
