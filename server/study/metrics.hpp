// Picture and reference -> their difference, in linear light and as perceived.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace windsplat::study {

// Whether every value is finite and within [-slack, 1 + slack].
bool within_unit(std::span<const float> rgba, double slack);

// Mean of LDR-FLIP (Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", HPG
// 2020) of two sRGB pictures, 3 bytes per pixel, at 67 pixels per degree: 0 identical, 1 the
// largest difference.
double mean_flip(std::span<const std::uint8_t> reference_rgb,
                 std::span<const std::uint8_t> test_rgb, int width, int height);

// Resampled picture: bilinear between pixel centres, constant beyond the outer ones.
std::vector<float> resample(std::span<const float> rgba, int width, int height, int to_width,
                            int to_height);

// RMSE in linear light of two sRGB pictures: the error of an encoding.
double linear_rmse(std::span<const std::uint8_t> rgb, std::span<const std::uint8_t> decoded);

}  // namespace windsplat::study
