#include "server/scene/lines/mark.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include "server/scene/camera.hpp"
#include "server/scene/colormap.hpp"

namespace windsplat::scene {

namespace {

LineShape shape_of(protocol::MarkShape shape) {
  switch (shape) {
    case protocol::MarkShape::line:
      return LineShape::line;
    case protocol::MarkShape::taper:
      return LineShape::taper;
    case protocol::MarkShape::arrow:
      return LineShape::arrow;
    case protocol::MarkShape::comet:
      return LineShape::comet;
  }
  return LineShape::line;
}

constexpr double default_desaturation = 0.7;
constexpr double default_darkening = 0.85;

// Darker than middle grey, L* = 50.
bool is_dark(const std::string& background) {
  const auto [red, green, blue] = parse_color(background).value();
  return 0.2126 * red + 0.7152 * green + 0.0722 * blue < 0.184;
}

}  // namespace

// docs/benchmarks/direction.md has the measurements behind the limit.
bool shows_white_heads(const protocol::VectorColorView& color) {
  constexpr double least_contrast = 0.045;
  constexpr int count = 64;
  const bool constant = color.by == protocol::ColorBy::constant;
  const auto colors = constant ? std::vector{parse_color(color.constant).value()}
                               : color_map_linear(color.map, count);
  return desaturation_contrast(colors, default_desaturation) >= least_contrast;
}

void complete_heads(protocol::VectorView& vector, const std::string& background) {
  std::optional<double>& white = vector.head_desaturation;
  std::optional<double>& dark = vector.mark.tail_darkening;
  const bool unshaped = vector.mark.shape == protocol::MarkShape::line;
  const bool plain = unshaped && !vector.trace;
  // Along a line through a seed the magnitude varies, which its colours tell: a dark tail would
  // change them over the whole of its length.
  const bool seeded = vector.trace && vector.trace->seeds;
  bool hued = unshaped && vector.color.true_colors && !seeded;
  if (plain && !white && !dark && is_dark(background) && !shows_white_heads(vector.color)) {
    white = 0;
    hued = true;
  }
  const bool comet = vector.mark.shape == protocol::MarkShape::comet;
  if (!white) white = default_desaturation;
  if (!dark) dark = comet || hued ? default_darkening : 0.0;
}

void draw_true_colors(protocol::VectorView& completed) {
  if (completed.color.true_colors) return;
  completed.color.true_colors = true;
  const bool unshaped = completed.mark.shape == protocol::MarkShape::line;
  const bool seeded = completed.trace && completed.trace->seeds;
  if (unshaped && !seeded && completed.mark.tail_darkening == 0.0) {
    completed.mark.tail_darkening = default_darkening;
  }
}

void set_radii(const protocol::VectorView& from, int height, VectorLayer& layer) {
  const double scale = height / reference_height;
  layer.r1 = from.r1 * scale;
  layer.r2 = from.r2 * scale;
  layer.opacity = from.opacity;
  if (layer.r2 >= 1) return;
  const double half = 0.5 * (layer.r1 + layer.r2);
  layer.r1 = std::max(0.0, half - 0.5);
  layer.r2 = std::max(1.0, half + 0.5);
  layer.opacity *= std::min(1.0, 2.0 * half);
}

LineMark mark_of(const protocol::VectorView& from, int height) {
  const double scale = height / reference_height;
  LineMark mark;
  mark.shape = shape_of(from.mark.shape);
  mark.halo = from.mark.halo * scale;
  mark.tail_light = 1 - from.mark.tail_darkening.value();
  if (mark.shape == LineShape::arrow) {
    mark.head_width = from.mark.head_width * scale;
    mark.head_length = from.mark.head_length * scale;
  }
  return mark;
}

}  // namespace windsplat::scene
