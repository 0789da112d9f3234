#include "protocol/view/codec_annotations.hpp"

#include <array>
#include <string_view>
#include <utility>

#include "protocol/limits.hpp"
#include "protocol/view/codec_planes.hpp"

namespace windsplat::protocol {
namespace {

constexpr NumberRange sizes{limits::annotation_size_min, limits::annotation_size_max};

constexpr std::array styles{std::pair{"boxStyle", &AnnotationsView::box_style},
                            std::pair{"axesStyle", &AnnotationsView::axes_style},
                            std::pair{"northStyle", &AnnotationsView::north_style},
                            std::pair{"scaleBarStyle", &AnnotationsView::scale_bar_style},
                            std::pair{"legendStyle", &AnnotationsView::legend_style},
                            std::pair{"titleStyle", &AnnotationsView::title_style},
                            std::pair{"stepTimeStyle", &AnnotationsView::step_time_style}};

// Beyond the control characters of ASCII, which no text of a view has: those of Unicode (category
// Cc), line and paragraph separators, and what XML 1.0 does not allow. `text`: valid UTF-8.
bool has_control_of_unicode(std::string_view text) {
  for (const char* one : {"\u2028", "\u2029", "\ufffe", "\uffff"}) {
    if (text.find(one) != std::string_view::npos) return true;
  }
  for (std::size_t n = 0; n + 1 < text.size(); ++n) {
    const auto next = static_cast<unsigned char>(text[n + 1]);
    if (static_cast<unsigned char>(text[n]) == 0xc2U && next < 0xa0U) return true;
  }
  return false;
}

AnnotationStyleView read_style(const Json& json, const std::string& pointer, Faults& faults) {
  AnnotationStyleView style;
  ObjectReader reader(json, pointer, faults);
  reader.number("size", style.size, sizes);
  reader.color("textColor", style.text_color);
  reader.finish();
  return style;
}

Json style_to_json(const AnnotationStyleView& style) {
  return Json{{"size", canonical_number(style.size)},
              {"textColor", text_or_null(style.text_color)}};
}

}  // namespace

AnnotationsView read_annotations(const Json& json, const std::string& pointer, Faults& faults) {
  AnnotationsView annotations;
  ObjectReader reader(json, pointer, faults);
  reader.boolean("box", annotations.box);
  reader.boolean("axes", annotations.axes);
  reader.boolean("north", annotations.north);
  reader.boolean("scaleBar", annotations.scale_bar);
  reader.boolean("legend", annotations.legend);
  reader.boolean("title", annotations.title);
  reader.boolean("stepTime", annotations.step_time);
  reader.boolean("contourLabels", annotations.contour_labels);
  reader.number("size", annotations.size, sizes);
  reader.color("textColor", annotations.text_color);
  reader.text("titleText", annotations.title_text, 1);
  if (annotations.title_text && has_control_of_unicode(*annotations.title_text)) {
    faults.add(reader.at("titleText"), "must not contain control characters or line separators");
  }
  for (const auto& [key, style] : styles) {
    if (const Json* one = reader.child(key)) {
      annotations.*style = read_style(*one, reader.at(key), faults);
    }
  }
  reader.finish();
  return annotations;
}

Json annotations_to_json(const AnnotationsView& annotations) {
  Json out{{"box", annotations.box},
           {"axes", annotations.axes},
           {"north", annotations.north},
           {"scaleBar", annotations.scale_bar},
           {"legend", annotations.legend},
           {"title", annotations.title},
           {"stepTime", annotations.step_time},
           {"contourLabels", annotations.contour_labels},
           {"size", canonical_number(annotations.size)},
           {"textColor", text_or_null(annotations.text_color)},
           {"titleText", text_or_null(annotations.title_text)}};
  for (const auto& [key, style] : styles) out[key] = style_to_json(annotations.*style);
  return out;
}

}  // namespace windsplat::protocol
