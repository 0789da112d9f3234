#include "protocol/view/codec_difference.hpp"

#include "protocol/limits.hpp"
#include "protocol/view/codec_planes.hpp"

namespace windsplat::protocol {

DifferenceView read_difference(const Json& json, const std::string& pointer, Faults& faults) {
  DifferenceView difference;
  const std::size_t before = faults.count();
  ObjectReader reader(json, pointer, faults);
  reader.text("dataset", difference.dataset, 1);
  reader.integer("step", difference.step, {0, limits::step_max});
  reader.finish();
  if (before == faults.count() && !difference.dataset && !difference.step) {
    faults.add(pointer, "must name a dataset, a step or both; null shows the fields as they are");
  }
  return difference;
}

Json difference_to_json(const std::optional<DifferenceView>& difference) {
  if (!difference) return nullptr;
  return Json{{"dataset", text_or_null(difference->dataset)},
              {"step", difference->step ? Json(*difference->step) : Json(nullptr)}};
}

}  // namespace windsplat::protocol
