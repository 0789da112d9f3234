// Power laws, fitted to calibration runs of the samples in five scenes (docs/benchmarks/error.md).
#include "server/quality/laws.hpp"

#include <algorithm>
#include <cmath>

namespace windsplat::quality {
namespace {

// The conditions at which the laws equal their factors: a picture 480 pixels high, lines a tenth of
// its height long with a radius of 1.4 pixels, a medium of optical depth 1 along the length of a
// line.
constexpr double pixels_high_of_laws = 480;
constexpr double height_of_laws = 10;  // height of the picture in lengths of a line
constexpr double radius_of_laws = 1.4;

// error = factor (height / length)^by_height (pixels high)^by_pixels.
struct Law {
  double factor = 0;
  double by_height = 0;
  double by_pixels = 0;
  Scatter scatter;
};

Law law_of_lines(const Kind& kind, const Setting& setting, bool merged) {
  const bool slab = setting.method == protocol::MethodName::slab;
  if (setting.coarser > 0 || merged) {
    const double factor = kind.medium ? 0.09 : 0.11;
    return {
        factor * std::pow(1.55, std::max(0, setting.coarser - 1)), -0.65, 0.1, {0.35, 0.3, 0.06}};
  }
  if (setting.half_level > 0) {
    const double factor = (slab ? 0.022 : 0.027) * (kind.medium ? 1.05 : 1.5);
    return {factor * std::pow(1.2, setting.half_level - 1), -0.4, 0, {0.45, 0.35, 0.06}};
  }
  if (!slab) {
    return {0.013 * kind.radius / radius_of_laws, -0.1, 0.3, {0.4, 0.45, 0.06}};
  }
  if (!kind.medium) return {error_least, 0, 0, {0.5, 0.3, 0.06}};
  const double thickness = kind.thickness / setting.thinner;
  return {2.8e-4 * std::pow(kind.depth, 0.7) * thickness * thickness, -0.25, 0, {0.6, 0.75, 0.06}};
}

Law law_of_media(const Kind& kind, const Setting& setting, bool merged) {
  const bool slab = setting.method == protocol::MethodName::slab;
  if (setting.coarser > 0 || merged) {
    return {0.032 * std::pow(2.4, std::max(0, setting.coarser - 1)), -0.35, 0, {0.5, 0.4, 0.06}};
  }
  if (setting.half_level > 0) {
    return {6.5e-4 * std::pow(2.0, 0.8 * (setting.half_level - 1)), 0.7, -1.5, {0.7, 0.5, 0.06}};
  }
  if (!slab) return {2.2e-4, -0.1, 0, {0.8, 0.9, 0.06}};
  const double thickness = kind.thickness / setting.thinner;
  return {1e-4 * thickness * thickness, -0.4, 0, {0.7, 0.8, 0.06}};
}

}  // namespace

bool is_merged(const Setting& setting, const Viewpoint& viewpoint) {
  return setting.half_level == 0 && setting.coarser == 0 && viewpoint.detail > 0 &&
         viewpoint.detail < 1;
}

Expected expected_error(const Kind& kind, const Setting& setting, const Viewpoint& viewpoint) {
  const bool merged = is_merged(setting, viewpoint);
  const Law law =
      kind.lines ? law_of_lines(kind, setting, merged) : law_of_media(kind, setting, merged);
  double error = law.factor * std::pow(viewpoint.pixels_high / pixels_high_of_laws, law.by_pixels);
  if (kind.length > 0) {
    error *= std::pow(viewpoint.height / (height_of_laws * kind.length), law.by_height);
  }
  return {std::clamp(std::hypot(error, kind.rule / setting.thinner, kind.stop), error_least, 1.0),
          law.scatter};
}

// Proportional to pixels, with a constant share for samples.
Expected expected_ms(const Kind&, const Setting& setting, const Viewpoint& viewpoint) {
  constexpr double us_per_pixel = 0.06;
  const double pixels = static_cast<double>(viewpoint.width) * viewpoint.pixels_high;
  const double share = 0.35 + 0.65 * std::pow(2.0, -setting.half_level);
  double ms = 1e-3 * us_per_pixel * pixels * share * std::pow(3.0, -setting.coarser);
  if (setting.method == protocol::MethodName::slab) {
    ms *= 4 * (1 + 0.35 * std::log2(static_cast<double>(setting.thinner)));
  }
  return {ms, {1.5, 0.4, 0.15}};
}

}  // namespace windsplat::quality
