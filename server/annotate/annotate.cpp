#include "server/annotate/annotate.hpp"

#include <algorithm>

#include "protocol/limits.hpp"
#include "server/annotate/box.hpp"
#include "server/annotate/contour_labels.hpp"
#include "server/annotate/legend.hpp"
#include "server/annotate/marks.hpp"
#include "server/image/tone_map.hpp"
#include "server/scene/colormap.hpp"

namespace windsplat::annotate {
namespace {

Color srgb(const std::array<float, 3>& linear) {
  return {image::srgb_from_linear(linear[0]), image::srgb_from_linear(linear[1]),
          image::srgb_from_linear(linear[2]), 1};
}

// Luminance of linear light (ITU-R BT.709).
double luminance(const std::array<float, 3>& linear) {
  return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
}

}  // namespace

Style style_of(const Subject& subject, const protocol::AnnotationStyleView& part) {
  const protocol::AnnotationsView& view = subject.completed.view().annotations;
  const scene::Camera& camera = subject.scene.camera;
  const double size = std::min(view.size * part.size, protocol::limits::annotation_size_max);
  // Of a picture of 1280 x 720; a narrower one has smaller texts.
  const double unit =
      size * std::min(static_cast<double>(camera.height) / 720, camera.width / 960.0);
  constexpr double middle = 0.18;  // between dark and light, linear
  const bool dark = luminance(subject.scene.background) < middle;
  Style style;
  style.text = 14 * unit;
  style.line = std::max(1.2 * unit, 0.5);
  style.color = dark ? Color{0.93, 0.95, 0.98, 1} : Color{0.08, 0.10, 0.13, 1};
  if (const auto& named = part.text_color ? part.text_color : view.text_color) {
    if (const auto own = scene::parse_color(*named)) style.color = srgb(*own);
  }
  const double lightness = 0.3 * style.color.red + 0.6 * style.color.green + 0.1 * style.color.blue;
  style.quiet = style.color;
  style.quiet.alpha = 0.7;
  style.rim = lightness > 0.5 ? Color{0.04, 0.05, 0.07, 0.75} : Color{0.98, 0.98, 0.98, 0.75};
  return style;
}

bool any(const protocol::AnnotationsView& annotations) {
  return annotations.box || annotations.axes || annotations.north || annotations.scale_bar ||
         annotations.legend || annotations.title || annotations.step_time ||
         annotations.contour_labels;
}

std::uint64_t working_bytes(const protocol::AnnotationsView& annotations,
                            const scene::Scene& scene) {
  return annotations.contour_labels ? contour_label_bytes(scene) : 0;
}

Figure figure_of(const Subject& subject) {
  const protocol::AnnotationsView& shown = subject.completed.view().annotations;
  const auto style = [&](const protocol::AnnotationStyleView& part) {
    return style_of(subject, part);
  };
  Figure figure;
  figure.width = subject.scene.camera.width;
  figure.height = subject.scene.camera.height;
  if (shown.box) add_box(subject, style(shown.box_style), figure);
  if (shown.north) add_north(subject, style(shown.north_style), figure);
  if (shown.scale_bar) add_scale_bar(subject, style(shown.scale_bar_style), figure);
  if (shown.legend) add_legend(subject, style(shown.legend_style), figure);
  if (shown.title || shown.step_time) {
    add_heading(subject, style(shown.title_style), style(shown.step_time_style), figure);
  }
  // Last: their texts are left out where something else is written.
  if (shown.axes) add_axes(subject, style(shown.axes_style), figure);
  if (shown.contour_labels) add_contour_labels(subject, style({}), figure);
  return figure;
}

}  // namespace windsplat::annotate
