// Colour maps: name -> sRGB control points -> entries interpolated in OKLab, linear or as sRGB
// codes.
#include "server/scene/colormap.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>

#include "server/base/check.hpp"

namespace windsplat::scene {

namespace {

using Rgb = std::array<double, 3>;

enum class Spacing { as_published, uniform };

struct Stops {
  const char* name;
  const char* kind;
  std::vector<std::uint32_t> codes;  // 0xrrggbb
  Spacing spacing = Spacing::uniform;
  std::vector<Rgb> lab{};    // the control points in OKLab
  std::vector<double> at{};  // position of each, 0 to 1
};

// viridis, magma, inferno, plasma (S. van der Walt, N. Smith) and cividis (Nunez, Anderton,
// Renslow) are in the public domain (CC0), sampled at every tenth or ninth. The others are original
// to windsplat; their control points are spaced by perceptual distance, so that equal differences
// of values are equal differences of colour (except compass, whose quarters are fixed bearings).
std::vector<Stops> coded() {
  return {
      {"viridis",
       "sequential",
       {0x440154, 0x482475, 0x414487, 0x355f8d, 0x2a788e, 0x21918c, 0x22a884, 0x44bf70, 0x7ad151,
        0xbddf26, 0xfde725},
       Spacing::as_published},
      {"magma",
       "sequential",
       {0x000004, 0x140e36, 0x3b0f70, 0x641a80, 0x8c2981, 0xb73779, 0xde4968, 0xf7705c, 0xfe9f6d,
        0xfecf92, 0xfcfdbf},
       Spacing::as_published},
      {"inferno",
       "sequential",
       {0x000004, 0x160b39, 0x420a68, 0x6a176e, 0x932667, 0xbc3754, 0xdd513a, 0xf37819, 0xfca50a,
        0xf6d746, 0xfcffa4},
       Spacing::as_published},
      {"plasma",
       "sequential",
       {0x0d0887, 0x41049d, 0x6a00a8, 0x8f0da4, 0xb12a90, 0xcc4778, 0xe16462, 0xf2844b, 0xfca636,
        0xfcce25, 0xf0f921},
       Spacing::as_published},
      {"cividis",
       "sequential",
       {0x00224e, 0x123570, 0x3b496c, 0x575d6d, 0x707173, 0x8a8678, 0xa59c74, 0xc3b369, 0xe1cc55,
        0xfee838},
       Spacing::as_published},
      {"grays", "sequential", {0x000000, 0xffffff}},
      {"clouds", "sequential", {0x8593a6, 0xb4bfcc, 0xdde3ea, 0xffffff}},
      {"ice", "sequential", {0x03071e, 0x12305c, 0x1d63a0, 0x3f9bcd, 0x8fd0e6, 0xeafcff}},
      {"sunset", "sequential", {0x1b1440, 0x53206e, 0x9b2f6f, 0xdb5157, 0xf98f4f, 0xffd98a}},
      {"moss", "sequential", {0x0a1612, 0x17392d, 0x2b6446, 0x5c9457, 0xa9c26b, 0xf4efb0}},
      {"coolwarm",
       "diverging",
       {0x3653b8, 0x6b92e3, 0xa9c5f0, 0xe2e2e2, 0xf0b79d, 0xd9735c, 0xad1f30}},
      {"tealrose",
       "diverging",
       {0x0b6e6e, 0x4ba39b, 0xa3d1c8, 0xf1efe9, 0xeab9bf, 0xd0748c, 0x9a2f5c}},
      // North, east, south, west and north again.
      {"compass",
       "cyclic",
       {0x4a7fe8, 0xe0559f, 0xe3b23c, 0x35b07e, 0x4a7fe8},
       Spacing::as_published},
  };
}

double decode(double srgb) {
  return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
}

double encode(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}

Rgb linear_from_code(std::uint32_t code) {
  return {decode(((code >> 16U) & 255U) / 255.0), decode(((code >> 8U) & 255U) / 255.0),
          decode((code & 255U) / 255.0)};
}

// OKLab (B. Ottosson 2020): linear sRGB -> cone responses -> cube roots -> L, a, b, and back.
Rgb oklab_from_linear(const Rgb& c) {
  const double l = std::cbrt(0.4122214708 * c[0] + 0.5363325363 * c[1] + 0.0514459929 * c[2]);
  const double m = std::cbrt(0.2119034982 * c[0] + 0.6806995451 * c[1] + 0.1073969566 * c[2]);
  const double s = std::cbrt(0.0883024619 * c[0] + 0.2817188376 * c[1] + 0.6299787005 * c[2]);
  return {0.2104542553 * l + 0.7936177850 * m - 0.0040720468 * s,
          1.9779984951 * l - 2.4285922050 * m + 0.4505937099 * s,
          0.0259040371 * l + 0.7827717662 * m - 0.8086757660 * s};
}

Rgb linear_from_oklab(const Rgb& lab) {
  const double l = lab[0] + 0.3963377774 * lab[1] + 0.2158037573 * lab[2];
  const double m = lab[0] - 0.1055613458 * lab[1] - 0.0638541728 * lab[2];
  const double s = lab[0] - 0.0894841775 * lab[1] - 1.2914855480 * lab[2];
  const double l3 = l * l * l;
  const double m3 = m * m * m;
  const double s3 = s * s * s;
  return {4.0767416621 * l3 - 3.3077115913 * m3 + 0.2309699292 * s3,
          -1.2684380046 * l3 + 2.6097574011 * m3 - 0.3413193965 * s3,
          -0.0041960863 * l3 - 0.7034186147 * m3 + 1.7076147010 * s3};
}

double distance(const Rgb& a, const Rgb& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

// Positions of the control points: uniform, or by distance in OKLab; the centre of a diverging map
// stays at 0.5.
std::vector<double> places(const Stops& stops) {
  const std::size_t last = stops.lab.size() - 1;
  std::vector<double> at(last + 1);
  for (std::size_t n = 0; n <= last; ++n) {
    at[n] = static_cast<double>(n) / static_cast<double>(last);
  }
  if (stops.spacing == Spacing::as_published) return at;
  const std::size_t part = stops.kind == std::string_view("diverging") ? last / 2 : last;
  for (std::size_t from = 0; from < last; from += part) {
    std::vector<double> way(part + 1, 0.0);
    for (std::size_t n = 1; n <= part; ++n) {
      way[n] = way[n - 1] + distance(stops.lab[from + n - 1], stops.lab[from + n]);
    }
    const double begin = at[from];
    const double length = at[from + part] - begin;
    for (std::size_t n = 1; n < part; ++n) at[from + n] = begin + length * way[n] / way[part];
  }
  return at;
}

const std::vector<Stops>& tables() {
  static const std::vector<Stops> all = [] {
    std::vector<Stops> list = coded();
    for (Stops& stops : list) {
      for (const std::uint32_t code : stops.codes) {
        stops.lab.push_back(oklab_from_linear(linear_from_code(code)));
      }
      stops.at = places(stops);
    }
    return list;
  }();
  return all;
}

const Stops* find_stops(std::string_view name) {
  for (const Stops& stops : tables()) {
    if (name == stops.name) return &stops;
  }
  return nullptr;
}

// Entries of a known map, converted from linear by `as_entry`.
template <class Entry>
auto interpolate(std::string_view name, int count, const Entry& as_entry) {
  const Stops* stops = find_stops(name);
  WINDSPLAT_CHECK(stops != nullptr && count >= 1);
  const std::vector<Rgb>& lab = stops->lab;
  const std::vector<double>& at = stops->at;
  std::vector<decltype(as_entry(Rgb{}))> entries;
  entries.reserve(static_cast<std::size_t>(count));
  for (int n = 0; n < count; ++n) {
    const double place = count == 1 ? 0.0 : static_cast<double>(n) / (count - 1);
    const auto above = std::upper_bound(at.begin() + 1, at.end() - 1, place);
    const auto below = static_cast<std::size_t>(above - at.begin()) - 1;
    const double t = (place - at[below]) / (at[below + 1] - at[below]);
    Rgb mixed{};
    for (std::size_t a = 0; a < 3; ++a) {
      mixed[a] = lab[below][a] + t * (lab[below + 1][a] - lab[below][a]);
    }
    Rgb linear = linear_from_oklab(mixed);
    for (double& channel : linear) channel = std::clamp(channel, 0.0, 1.0);
    entries.push_back(as_entry(linear));
  }
  return entries;
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

}  // namespace

const std::vector<ColorMap>& color_maps() {
  static const std::vector<ColorMap> maps = [] {
    std::vector<ColorMap> list;
    for (const Stops& stops : tables()) list.push_back({stops.name, stops.kind});
    return list;
  }();
  return maps;
}

bool has_color_map(std::string_view name) { return find_stops(name) != nullptr; }

std::vector<std::array<float, 3>> color_map_linear(std::string_view name, int count) {
  return interpolate(name, count, [](const Rgb& c) -> std::array<float, 3> {
    return {static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2])};
  });
}

std::vector<std::array<unsigned char, 3>> color_map_srgb(std::string_view name, int count) {
  return interpolate(name, count, [](const Rgb& c) {
    std::array<unsigned char, 3> code{};
    for (std::size_t a = 0; a < 3; ++a) {
      code[a] = static_cast<unsigned char>(std::lround(255.0 * encode(c[a])));
    }
    return code;
  });
}

double desaturation_contrast(const std::vector<std::array<float, 3>>& colors, double part) {
  std::vector<double> contrasts;
  for (const auto& color : colors) {
    const Rgb plain{color[0], color[1], color[2]};
    const double top = std::max({plain[0], plain[1], plain[2]});
    Rgb white = plain;
    for (double& channel : white) channel += part * (top - channel);
    contrasts.push_back(distance(oklab_from_linear(plain), oklab_from_linear(white)));
  }
  if (contrasts.empty()) return 0;
  const auto tenth = contrasts.begin() + static_cast<std::ptrdiff_t>(contrasts.size() / 10);
  std::nth_element(contrasts.begin(), tenth, contrasts.end());
  return *tenth;
}

std::optional<std::array<float, 3>> parse_color(std::string_view text) {
  if (text.size() != 7 || text[0] != '#') return std::nullopt;
  std::array<float, 3> color{};
  for (std::size_t a = 0; a < 3; ++a) {
    const int high = hex_digit(text[1 + 2 * a]);
    const int low = hex_digit(text[2 + 2 * a]);
    if (high < 0 || low < 0) return std::nullopt;
    color[a] = static_cast<float>(decode((16 * high + low) / 255.0));
  }
  return color;
}

float srgb_from_linear(float linear) {
  return static_cast<float>(encode(static_cast<double>(linear)));
}

float linear_from_srgb(float srgb) { return static_cast<float>(decode(static_cast<double>(srgb))); }

}  // namespace windsplat::scene
