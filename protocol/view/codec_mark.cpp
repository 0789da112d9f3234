#include "protocol/view/codec_mark.hpp"

#include "protocol/codec_names.hpp"
#include "protocol/limits.hpp"

namespace windsplat::protocol {

MarkView read_mark(const Json& json, const std::string& pointer, Faults& faults) {
  constexpr NumberRange head{limits::mark_head_min, limits::mark_head_max};
  MarkView mark;
  ObjectReader reader(json, pointer, faults);
  reader.choice("shape", mark.shape, mark_shape_names);
  reader.number("headWidth", mark.head_width, head);
  reader.number("headLength", mark.head_length, head);
  reader.number("tailDarkening", mark.tail_darkening, {0, 1});
  reader.number("halo", mark.halo, {0, limits::halo_max});
  reader.finish();
  return mark;
}

Json mark_to_json(const MarkView& mark) {
  return Json{{"shape", name_of(mark.shape, mark_shape_names)},
              {"headWidth", canonical_number(mark.head_width)},
              {"headLength", canonical_number(mark.head_length)},
              {"tailDarkening", number_or_null(mark.tail_darkening)},
              {"halo", canonical_number(mark.halo)}};
}

}  // namespace windsplat::protocol
