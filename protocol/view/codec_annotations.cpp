#include "protocol/view/codec_annotations.hpp"

#include "protocol/limits.hpp"

namespace windsplat::protocol {

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
  reader.number("size", annotations.size,
                {limits::annotation_size_min, limits::annotation_size_max});
  reader.color("textColor", annotations.text_color);
  reader.finish();
  return annotations;
}

Json annotations_to_json(const AnnotationsView& annotations) {
  return Json{
      {"box", annotations.box},
      {"axes", annotations.axes},
      {"north", annotations.north},
      {"scaleBar", annotations.scale_bar},
      {"legend", annotations.legend},
      {"title", annotations.title},
      {"stepTime", annotations.step_time},
      {"size", canonical_number(annotations.size)},
      {"textColor", annotations.text_color ? Json(*annotations.text_color) : Json(nullptr)}};
}

}  // namespace windsplat::protocol
