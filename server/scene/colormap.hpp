// Colour maps by name: a few sRGB control points each, interpolated in OKLab.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace windsplat::scene {

struct ColorMap {
  std::string name;
  std::string kind;  // "sequential", "diverging", "cyclic"
};

const std::vector<ColorMap>& color_maps();
[[nodiscard]] bool has_color_map(std::string_view name);

// `count` entries of a known map, linear RGB.
std::vector<std::array<float, 3>> color_map_linear(std::string_view name, int count);
// The same as sRGB codes, for legends.
std::vector<std::array<unsigned char, 3>> color_map_srgb(std::string_view name, int count);

// How far in OKLab nine tenths of the colours (linear RGB) are at least from themselves,
// desaturated by `part` towards their greatest channel; 0.02 is about the least difference that is
// seen.
double desaturation_contrast(const std::vector<std::array<float, 3>>& colors, double part);

// "#rrggbb" to linear RGB; nullopt if malformed.
std::optional<std::array<float, 3>> parse_color(std::string_view text);
float srgb_from_linear(float linear);
float linear_from_srgb(float srgb);

}  // namespace windsplat::scene
