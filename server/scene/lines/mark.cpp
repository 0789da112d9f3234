#include "server/scene/lines/mark.hpp"

#include <algorithm>

#include "server/scene/camera.hpp"

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

}  // namespace

bool is_marked(const protocol::MarkView& mark) {
  return mark.shape != protocol::MarkShape::line || mark.tail_darkening.value() > 0 ||
         mark.halo > 0;
}

double default_darkening(const protocol::VectorView& vector) {
  constexpr double darkening = 0.85;
  const bool plain = vector.mark.shape == protocol::MarkShape::line && !vector.trace;
  const bool comet = vector.mark.shape == protocol::MarkShape::comet;
  return comet || (plain && vector.color.true_colors) ? darkening : 0.0;
}

void draw_true_colors(protocol::VectorView& completed) {
  if (completed.color.true_colors) return;
  completed.color.true_colors = true;
  if (completed.mark.tail_darkening == 0.0) {
    completed.mark.tail_darkening = default_darkening(completed);
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
