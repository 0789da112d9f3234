// Products of powers, fitted to generated data (docs/design/quality-control.md).
#include "server/quality/laws.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "server/quality/coefficients.hpp"

namespace windsplat::quality {
namespace {

double logarithm(double value, double least, double most = 1e30) {
  return std::log(std::clamp(value, least, most));
}

const Law& law_of(const Kind& kind, Cause cause) {
  const std::size_t content = kind.lines && kind.medium ? 2 : kind.medium ? 1 : 0;
  return laws[3 * static_cast<std::size_t>(cause) + content];
}

}  // namespace

const Scatter& error_scatter(const Kind& kind, Cause cause) { return law_of(kind, cause).scatter; }

Cause cause_of(const Setting& setting, const Viewpoint& viewpoint) {
  const bool merges = viewpoint.detail > 0 && viewpoint.detail < 1;
  if (setting.coarser > 0 || (merges && setting.half_level == 0)) return Cause::merged;
  if (setting.half_level > 0) return Cause::smaller;
  return setting.method == protocol::MethodName::slab ? Cause::slab : Cause::kernel;
}

namespace {

// The light of the medium that a picture of fewer pixels has lost when it is shown at the full
// size: what is between its pixels, and, since its size is whole pixels, what its proportions move.
double lost_between_pixels(const Content& content, const Setting& setting,
                           const Viewpoint& viewpoint) {
  const double cell = std::max(content.step_cell, 1e-30);
  const auto width = static_cast<double>(viewpoint.width);
  const double high = viewpoint.pixels_high;
  const PictureSize size = size_at({viewpoint.width, viewpoint.pixels_high}, setting);
  const double few = size.height;
  const double merged = setting.coarser > 0 ? std::exp2(setting.coarser - 1) : 0;
  const double half_pixel = std::hypot(0.5 / (few * cell), merged);
  std::size_t k = 1;
  while (k + 1 < bends_count && bend_distances[k] < half_pixel) ++k;
  const auto log_bend = [&](std::size_t i) { return logarithm(content.bends[i], 1e-6); };
  const double from = std::log(bend_distances[k - 1]);
  const double to = std::log(bend_distances[k]);
  const double at = std::log(std::min(half_pixel, bend_distances.back()));
  const double slope =
      at < from ? 2 : (log_bend(k) - log_bend(k - 1)) / (to - from);  // smooth below
  const double bend = std::exp(log_bend(k - 1) + slope * (at - from));
  const double other = size.width / few / (width / high) - 1;
  const double aside = std::abs(other) * width / high / std::sqrt(12.0);  // RMS over the picture
  return std::hypot(0.5 * bend, content.incline * aside / cell);
}

}  // namespace

Features features_of(const Kind& kind, const Setting& setting, const Viewpoint& viewpoint) {
  constexpr double radius_height = 720;  // height of the picture for which the radius is given
  const Content content = viewpoint.content.value_or(Content());
  const double pixels = viewpoint.pixels_high;
  const bool merges = viewpoint.detail > 0 && viewpoint.detail < 1;
  Features out{
      static_cast<double>(setting.half_level),
      static_cast<double>(setting.coarser),
      setting.method == protocol::MethodName::slab ? 1.0 : 0.0,
      merges ? 1.0 : 0.0,
      viewpoint.detail > 0 ? logarithm(viewpoint.detail, 0.2, 5) : 0,
      logarithm(content.cell * pixels, 0.1, 300),
      logarithm(content.finest_cell / std::max(content.cell, 1e-30), 0.02),
  };
  std::size_t n = 7;
  if (kind.lines) {
    out[n + 0] = logarithm(content.lines, 1e-3);
    out[n + 1] = logarithm(content.layers, 0.03, 100);
    out[n + 2] = logarithm(content.length * pixels, 0.3);
    out[n + 3] = logarithm(kind.radius * pixels / radius_height, 0.1);
    out[n + 4] = std::log(content.shade + 0.01);
    out[n + 5] = content.gaps;
  }
  n += 6;
  if (kind.medium) {
    out[n + 0] = logarithm(content.depth, 1e-3, 1e3);
    out[n + 1] = logarithm(content.cell_depth, 1e-5, 1e2);
    out[n + 2] = std::log(content.tint + 0.003);
    out[n + 3] = logarithm(content.step, 1e-5);
    out[n + 4] = logarithm(content.bends[2], 1e-5);
    out[n + 5] = logarithm(content.bends[3], 1e-5);
    out[n + 6] = logarithm(content.order, 1e-7);
    out[n + 7] = logarithm(content.step_cell * pixels, 0.1);
    out[n + 8] = logarithm(lost_between_pixels(content, setting, viewpoint), 1e-6);
  }
  n += 9;
  if (kind.lines && kind.medium) out[n] = logarithm(content.line_depth, 1e-5, 1e2);
  return out;
}

namespace {

// Few lines and a thin medium add little light, and many layers of lines and an opaque medium vary
// little: errors are greatest in between. Lines and cells below a pixel blend.
Terms terms_of(const Features& features) {
  Terms out{};
  std::copy(features.begin(), features.end(), out.begin());
  const double cell = features[5];
  const double lines = features[7];
  const double layers = features[8];
  const double length = features[9];
  const double width = features[10];
  const double depth = features[13];
  const double cell_depth = features[14];
  const std::array<double, terms_count - features_count> products{
      cell * cell,     layers * layers, lines * cell,           depth * depth,
      length * length, width * width,   cell_depth * cell_depth};
  std::copy(products.begin(), products.end(), out.begin() + features_count);
  return out;
}

// By the law of the main cause alone.
double error_of_cause(const Kind& kind, const Setting& setting, const Viewpoint& viewpoint) {
  const Cause cause = cause_of(setting, viewpoint);
  const Law& law = law_of(kind, cause);
  Features features = features_of(kind, setting, viewpoint);
  for (std::size_t i = 0; i < features_count; ++i) {
    features[i] = std::clamp(features[i], law.least[i], law.most[i]);
  }
  const Terms terms = terms_of(features);
  double log_error = std::inner_product(terms.begin(), terms.end(), law.slope.begin(), law.base);
  if (cause == Cause::slab && kind.medium) {
    log_error += order_of_slabs * std::log(kind.thickness / setting.thinner);
  }
  return std::exp(std::min(log_error, 0.0));
}

// Of a picture of full size and every sample. Lines in a thin medium have the error of lines alone.
double error_of_method(const Kind& kind, const Setting& whole, const Viewpoint& viewpoint) {
  const double error = error_of_cause(kind, whole, viewpoint);
  if (!kind.lines || !kind.medium || cause_of(whole, viewpoint) != Cause::kernel) return error;
  Kind lines = kind;
  lines.medium = false;
  const double depth = viewpoint.content.value_or(Content()).depth;
  return std::max(error, std::exp(-depth) * error_of_cause(lines, whole, viewpoint));
}

}  // namespace

Expected expected_error(const Kind& kind, const Setting& setting, const Viewpoint& viewpoint) {
  // A smaller picture and merged samples have the error of the method too. It is independent of
  // theirs for a medium; the laws of lines are fitted to the whole error.
  const Setting whole{setting.method, 0, 0, setting.thinner};
  double error = error_of_method(kind, whole, viewpoint);
  if (setting != whole) {
    const double power = kind.lines ? 4 : 2;
    const double other = error_of_cause(kind, setting, viewpoint);
    error = std::pow(std::pow(other, power) + std::pow(error, power), 1 / power);
  }
  return {std::clamp(std::hypot(error, kind.rule / setting.thinner, kind.stop), error_least, 1.0),
          law_of(kind, cause_of(setting, viewpoint)).scatter};
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
