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

// Lines, a medium, both.
std::size_t shown(const Kind& kind) { return kind.lines && kind.medium ? 2 : kind.medium ? 1 : 0; }

const Law& law_of(const Kind& kind, Cause cause) {
  return laws[3 * static_cast<std::size_t>(cause) + shown(kind)];
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
// Merged samples lose what is between them.
double lost_light(const Content& content, const Setting& setting, const Viewpoint& viewpoint) {
  const double high = viewpoint.pixels_high;
  const double shape = static_cast<double>(viewpoint.width) / high;
  const PictureSize size = size_at({viewpoint.width, viewpoint.pixels_high}, setting);
  const double few = size.height;
  const double other = size.width / few / shape - 1;
  const double aside = std::abs(other) * shape / std::sqrt(12.0);  // RMS over the picture
  const double moved = at_distance(content.shifts, 0.5 * aside, 1);
  const double bend = at_distance(content.bends, 0.5 / few, 2);
  double merged = 0;
  if (setting.coarser > 0) {
    const auto last = static_cast<int>(cells_apart.size()) - 1;
    merged = content.cell_bends[static_cast<std::size_t>(std::min(setting.coarser - 1, last))];
  }
  return std::hypot(moved, 0.5 * bend, 0.5 * merged) / std::sqrt(shape);
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
    out[n + 4] = logarithm(content.cell_bends[0], 1e-5);
    out[n + 5] = logarithm(content.cell_bends[1], 1e-5);
    out[n + 6] = logarithm(content.order, 1e-7);
    out[n + 7] = logarithm(content.step_cell * pixels, 0.1);
    out[n + 8] = logarithm(lost_light(content, setting, viewpoint), 1e-6);
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

double error_of_merged(const Kind& kind, const Setting& setting, const Viewpoint& viewpoint);

// By the law of the main cause alone.
double error_of_cause(const Kind& kind, const Setting& setting, const Viewpoint& viewpoint) {
  const Cause cause = cause_of(setting, viewpoint);
  if (cause == Cause::merged && kind.lines && kind.lines_stride > 1) {
    return error_of_merged(kind, setting, viewpoint);
  }
  const Law& law = law_of(kind, cause);
  if (cause == Cause::kernel || cause == Cause::slab) {
    return std::exp(law.base) * tried_error(kind, setting, viewpoint);
  }
  Features features = features_of(kind, setting, viewpoint);
  for (std::size_t i = 0; i < features_count; ++i) {
    features[i] = std::clamp(features[i], law.least[i], law.most[i]);
  }
  const Terms terms = terms_of(features);
  return std::exp(
      std::min(std::inner_product(terms.begin(), terms.end(), law.slope.begin(), law.base), 0.0));
}

// Where lines have a stride. They are merged only by the halvings that exceed it, as if there were
// no samples between them; by the others only the medium is.
double error_of_merged(const Kind& kind, const Setting& setting, const Viewpoint& viewpoint) {
  Kind part = kind;
  part.lines_stride = 1;
  Kind medium = part;
  medium.lines = false;
  const double of_medium = kind.medium ? error_of_cause(medium, setting, viewpoint) : 0;
  Setting beyond = setting;
  beyond.coarser -= std::ilogb(kind.lines_stride);
  if (beyond.coarser <= 0) return of_medium;
  Viewpoint of_lines = viewpoint;
  if (of_lines.content) {
    of_lines.content->cell *= kind.lines_stride;
    of_lines.content->finest_cell *= kind.lines_stride;
  }
  return std::max(of_medium, error_of_cause(part, beyond, of_lines));
}

}  // namespace

double tried_error(const Kind& kind, const Setting& setting, const Viewpoint& viewpoint) {
  const bool known = viewpoint.content && viewpoint.content->trials;
  const Trials& trials = known ? *viewpoint.content->trials : typical_trials[shown(kind)];
  if (setting.method == protocol::MethodName::kernel) return trials.kernel;
  // Thinner slabs than the least ones are drawn as these.
  const double thickness = std::max(kind.thickness / setting.thinner, trials.thinnest);
  const double tried = std::max(1.0, trials.thinnest);
  if (thickness >= tried) return trials.slab * std::pow(thickness / tried, 2);  // of order 2
  if (thickness <= 0.5) return trials.half * std::pow(2 * thickness, 2);
  const double share = -std::log2(thickness);
  return std::pow(trials.slab, 1 - share) * std::pow(trials.half, share);
}

double stop_error(const Kind& kind, const Viewpoint& viewpoint) {
  const bool known = viewpoint.content && viewpoint.content->trials;
  return known && kind.medium ? viewpoint.content->trials->stop : kind.stop;
}

Expected expected_error(const Kind& kind, const Setting& setting, const Viewpoint& viewpoint) {
  // A smaller picture and merged samples have the error of the method too. It is independent of
  // theirs for a medium; the laws of lines are fitted to the whole error.
  const Setting whole{setting.method, 0, 0, setting.thinner};
  double error = error_of_cause(kind, whole, viewpoint);
  if (setting != whole) {
    const double power = kind.lines ? 4 : 2;
    double other = error_of_cause(kind, setting, viewpoint);
    if (setting.coarser > 0 && setting.half_level > 0) {
      // No less than that of as many pixels of every sample.
      const Setting every{setting.method, setting.half_level, 0, setting.thinner};
      other = std::max(other, error_of_cause(kind, every, viewpoint));
    }
    error = std::pow(std::pow(other, power) + std::pow(error, power), 1 / power);
  }
  const double whole_error =
      std::hypot(error, kind.rule / setting.thinner, stop_error(kind, viewpoint));
  return {std::clamp(whole_error, error_least, 1.0),
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
