// LDR-FLIP: two sRGB pictures -> their mean perceived difference. Names and constants are those of
// the paper (Andersson et al. 2020): colours are blurred by the contrast sensitivity of the eye,
// compared in a perceptual space, and the difference amplified where edges or points differ.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "server/base/check.hpp"
#include "server/study/metrics.hpp"
#include "server/study/srgb.hpp"

namespace windsplat::study {

namespace {

using Plane = std::vector<double>;
using Color = std::array<double, 3>;

constexpr double pixels_per_degree = 67;

// Color comparison: exponent, and the fraction of the largest difference that is mapped to 0.95.
constexpr double q_c = 0.7;
constexpr double p_c = 0.4;
constexpr double p_t = 0.95;
// Features: their width in degrees, and the exponent.
constexpr double feature_width = 0.082;
constexpr double q_f = 0.5;

struct Size {
  int width;
  int height;
};

// Linear sRGB primaries and D65.
constexpr std::array<Color, 3> xyz_from_rgb{
    {{10135552.0 / 24577794, 8788810.0 / 24577794, 4435075.0 / 24577794},
     {2613072.0 / 12288897, 8788810.0 / 12288897, 887015.0 / 12288897},
     {1425312.0 / 73733382, 8788810.0 / 73733382, 70074185.0 / 73733382}}};

Color times(const std::array<Color, 3>& matrix, const Color& v) {
  Color out{};
  for (std::size_t r = 0; r < 3; ++r) {
    out[r] = matrix[r][0] * v[0] + matrix[r][1] * v[1] + matrix[r][2] * v[2];
  }
  return out;
}

std::array<Color, 3> inverse(const std::array<Color, 3>& m) {
  const auto minor = [&](std::size_t r, std::size_t c) {
    const std::size_t r1 = (r + 1) % 3;
    const std::size_t r2 = (r + 2) % 3;
    const std::size_t c1 = (c + 1) % 3;
    const std::size_t c2 = (c + 2) % 3;
    return m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
  };
  const double determinant = m[0][0] * minor(0, 0) + m[0][1] * minor(0, 1) + m[0][2] * minor(0, 2);
  std::array<Color, 3> out{};
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c) out[r][c] = minor(c, r) / determinant;
  }
  return out;
}

Color white() { return times(xyz_from_rgb, {1, 1, 1}); }

// YCxCz: opponent channels that are linear in light.
Color ycxcz_from_linear(const Color& rgb) {
  static const Color reference = white();
  const Color xyz = times(xyz_from_rgb, rgb);
  const double x = xyz[0] / reference[0];
  const double y = xyz[1] / reference[1];
  const double z = xyz[2] / reference[2];
  return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

Color linear_from_ycxcz(const Color& color) {
  static const Color reference = white();
  static const std::array<Color, 3> rgb_from_xyz = inverse(xyz_from_rgb);
  const double y = (color[0] + 16) / 116;
  const double x = y + color[1] / 500;
  const double z = y - color[2] / 200;
  return times(rgb_from_xyz, {x * reference[0], y * reference[1], z * reference[2]});
}

// L*a*b* with the chroma of dark colours reduced (Hunt).
Color hunt_lab_from_linear(const Color& rgb) {
  static const Color reference = white();
  const Color xyz = times(xyz_from_rgb, rgb);
  Color f{};
  for (std::size_t c = 0; c < 3; ++c) {
    constexpr double delta = 6.0 / 29;
    const double t = xyz[c] / reference[c];
    f[c] = t > delta * delta * delta ? std::cbrt(t) : t / (3 * delta * delta) + 4.0 / 29;
  }
  const double lightness = 116 * f[1] - 16;
  return {lightness, 0.01 * lightness * 500 * (f[0] - f[1]),
          0.01 * lightness * 200 * (f[1] - f[2])};
}

double hyab(const Color& a, const Color& b) {
  return std::abs(a[0] - b[0]) + std::hypot(a[1] - b[1], a[2] - b[2]);
}

// Filters rows, then columns, by a kernel of odd length each; beyond the border the outermost
// pixels are repeated.
Plane convolve(const Plane& in, Size size, const std::vector<double>& along_x,
               const std::vector<double>& along_y) {
  const int width = size.width;
  const int height = size.height;
  const auto pass = [&](const Plane& from, const std::vector<double>& kernel, bool rows) {
    const auto radius = static_cast<int>(kernel.size() / 2);
    Plane to(from.size());
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        double sum = 0;
        for (int k = -radius; k <= radius; ++k) {
          const int sx = rows ? std::clamp(x + k, 0, width - 1) : x;
          const int sy = rows ? y : std::clamp(y + k, 0, height - 1);
          sum += kernel[static_cast<std::size_t>(radius) + k] *
                 from[static_cast<std::size_t>(sy) * width + sx];
        }
        to[static_cast<std::size_t>(y) * width + x] = sum;
      }
    }
    return to;
  };
  return pass(pass(in, along_x, true), along_y, false);
}

std::vector<double> sampled(int radius, const std::function<double(double)>& f) {
  std::vector<double> kernel;
  for (int k = -radius; k <= radius; ++k) kernel.push_back(f(k));
  return kernel;
}

double sum_of(const std::vector<double>& kernel) {
  double sum = 0;
  for (const double v : kernel) sum += v;
  return sum;
}

// One term of a contrast sensitivity function in the spatial domain:
// a sqrt(pi / b) exp(-pi^2 r^2 / b), r in degrees.
struct Sensitivity {
  double a, b;
};
constexpr std::array<std::array<Sensitivity, 2>, 3> sensitivity{
    {{{{1, 0.0047}, {0, 1e-5}}},         // achromatic
     {{{1, 0.0053}, {0, 1e-5}}},         // red-green
     {{{34.1, 0.04}, {13.5, 0.025}}}}};  // blue-yellow

Plane seen(const Plane& in, Size size, const std::array<Sensitivity, 2>& terms) {
  constexpr double pi = std::numbers::pi;
  constexpr double widest = 0.04;
  const int radius =
      static_cast<int>(std::ceil(3 * std::sqrt(widest / (2 * pi * pi)) * pixels_per_degree));
  Plane out(in.size(), 0.0);
  double total = 0;
  for (const auto& [a, b] : terms) {
    if (a == 0) continue;
    const auto kernel = sampled(radius, [b = b](double k) {
      const double degrees = k / pixels_per_degree;
      return std::exp(-pi * pi * degrees * degrees / b);
    });
    const double weight = a * std::sqrt(pi / b);
    total += weight * sum_of(kernel) * sum_of(kernel);
    const Plane blurred = convolve(in, size, kernel, kernel);
    for (std::size_t i = 0; i < out.size(); ++i) out[i] += weight * blurred[i];
  }
  for (double& v : out) v /= total;
  return out;
}

// Positive weights add up to 1, negative ones to -1.
std::vector<double> balanced(std::vector<double> kernel) {
  double positive = 0;
  double negative = 0;
  for (const double v : kernel) (v > 0 ? positive : negative) += v;
  for (double& v : kernel) v /= v > 0 ? positive : -negative;
  return kernel;
}

struct Features {
  Plane edges;
  Plane points;
};

Features features(const Plane& luminance, Size size) {
  constexpr double sigma = 0.5 * feature_width * pixels_per_degree;
  const int radius = static_cast<int>(std::ceil(3 * sigma));
  const auto gauss = [](double k) { return std::exp(-k * k / (2 * sigma * sigma)); };
  std::vector<double> smooth = sampled(radius, gauss);
  const double sum = sum_of(smooth);
  for (double& v : smooth) v /= sum;
  const auto edge = balanced(sampled(radius, [&](double k) { return -k * gauss(k); }));
  const auto point =
      balanced(sampled(radius, [&](double k) { return (k * k / (sigma * sigma) - 1) * gauss(k); }));
  const auto strength = [&](const std::vector<double>& kernel) {
    Plane x = convolve(luminance, size, kernel, smooth);
    const Plane y = convolve(luminance, size, smooth, kernel);
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::hypot(x[i], y[i]);
    return x;
  };
  return {strength(edge), strength(point)};
}

struct Seen {
  std::vector<Color> lab;
  Features features;
};

Seen look_at(std::span<const std::uint8_t> rgb, Size size) {
  const std::size_t pixels = rgb.size() / 3;
  std::array<Plane, 3> opponent;
  for (Plane& plane : opponent) plane.resize(pixels);
  Plane luminance(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const Color color =
        ycxcz_from_linear({linear_from_code(rgb[3 * i]), linear_from_code(rgb[3 * i + 1]),
                           linear_from_code(rgb[3 * i + 2])});
    for (std::size_t c = 0; c < 3; ++c) opponent[c][i] = color[c];
    luminance[i] = (color[0] + 16) / 116;
  }
  Seen out;
  out.features = features(luminance, size);
  for (std::size_t c = 0; c < 3; ++c) opponent[c] = seen(opponent[c], size, sensitivity[c]);
  out.lab.reserve(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    Color linear = linear_from_ycxcz({opponent[0][i], opponent[1][i], opponent[2][i]});
    for (double& v : linear) v = std::clamp(v, 0.0, 1.0);
    out.lab.push_back(hunt_lab_from_linear(linear));
  }
  return out;
}

// Most of the output range is used for small differences.
double redistributed(double e, double e_max) {
  const double knee = p_c * e_max;
  return e < knee ? p_t / knee * e : p_t + (e - knee) / (e_max - knee) * (1 - p_t);
}

}  // namespace

double mean_flip(std::span<const std::uint8_t> reference_rgb,
                 std::span<const std::uint8_t> test_rgb, int width, int height) {
  WINDSPLAT_CHECK(reference_rgb.size() == test_rgb.size() && width > 0 && height > 0);
  WINDSPLAT_CHECK(reference_rgb.size() == 3 * static_cast<std::size_t>(width) * height);
  const Seen a = look_at(reference_rgb, {width, height});
  const Seen b = look_at(test_rgb, {width, height});
  const double e_max =
      std::pow(hyab(hunt_lab_from_linear({0, 1, 0}), hunt_lab_from_linear({0, 0, 1})), q_c);
  double sum = 0;
  for (std::size_t i = 0; i < a.lab.size(); ++i) {
    const double color = redistributed(std::pow(hyab(a.lab[i], b.lab[i]), q_c), e_max);
    const double edge = std::abs(a.features.edges[i] - b.features.edges[i]);
    const double point = std::abs(a.features.points[i] - b.features.points[i]);
    const double feature = std::pow(std::max(edge, point) / std::numbers::sqrt2, q_f);
    sum += std::pow(color, 1 - feature);
  }
  return sum / static_cast<double>(a.lab.size());
}

}  // namespace windsplat::study
