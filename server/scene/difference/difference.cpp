#include "server/scene/difference/difference.hpp"

#include <algorithm>
#include <string>

#include "protocol/limits.hpp"
#include "server/data/derived/difference.hpp"
#include "server/scene/defaults.hpp"
#include "server/scene/refusal.hpp"

namespace windsplat::scene {

Result<data::Dataset> with_difference(const protocol::View& view, const data::Dataset& dataset,
                                      const data::Dataset* other) {
  if (!view.difference) return dataset.minuend();
  const auto& [named, step] = *view.difference;
  if (!named && !step) {
    return invalid_at("/difference",
                      "must name a dataset, a step or both; null shows the fields as they are");
  }
  const data::Dataset& subtracted = other == nullptr ? dataset : *other;
  const auto count = static_cast<int>(subtracted.info().steps.size());
  if (step && *step >= count) {
    return invalid_at("/difference/step", "dataset " + in_double_quotes(subtracted.info().id) +
                                              " has steps 0 to " + std::to_string(count - 1));
  }
  auto difference = dataset.minus(
      subtracted, step ? std::optional(static_cast<std::size_t>(*step)) : std::nullopt);
  if (!difference) return invalid_at("/difference/dataset", difference.error().message);
  return difference;
}

Result<void> check_difference(const protocol::View& view, const data::Dataset& dataset) {
  const auto minus = dataset.subtrahend();
  if (view.difference.has_value() != minus.has_value()) {
    return invalid_at("/difference", view.difference ? "cannot be shown here"
                                                     : "is null, but the fields are differences");
  }
  if (!minus) return {};
  const data::DatasetInfo& other = *minus->info;
  if (!minus->step && static_cast<std::size_t>(view.step) >= other.steps.size()) {
    return invalid_at("/difference/step", "dataset " + in_double_quotes(other.id) +
                                              " has no step " + std::to_string(view.step) +
                                              " to subtract: name one of 0 to " +
                                              std::to_string(other.steps.size() - 1));
  }
  protocol::View differences = view;
  differences.geometry.height_field.reset();
  for (const std::string& field : fields_of(differences, dataset.info())) {
    if (auto same = data::derived::check_same_field(field, dataset.info(), other); !same) {
      return invalid_at("/difference", same.error().message);
    }
  }
  return {};
}

std::size_t last_step(const data::Dataset& dataset) {
  const std::size_t last = dataset.info().steps.size() - 1;
  const auto minus = dataset.subtrahend();
  return minus && !minus->step ? std::min(last, minus->info->steps.size() - 1) : last;
}

std::size_t step_of_defaults(const data::Dataset& dataset) {
  const auto minus = dataset.subtrahend();
  if (!minus) return 0;
  const std::size_t last = last_step(dataset);
  if (!minus->step) return last;
  const bool own = minus->info.get() == &dataset.info();
  return !own || *minus->step < last - std::min(*minus->step, last) ? last : 0;
}

protocol::Range default_difference_range(const data::Volume& volume) {
  constexpr double value_max = protocol::limits::value_max;
  constexpr double least = 1e-29;
  // Values of vectors are never shown as a scalar, so these are not magnitudes.
  const protocol::Range middle = quantiles(volume, 0.005, 0.995);
  const double most =
      std::max(-static_cast<double>(volume.range[0]), static_cast<double>(volume.range[1]));
  double top = std::max(-middle[0], middle[1]);
  // Where hardly anything changes, use the greatest change.
  if (!(top > 1e-3 * most)) top = most;
  if (!(top > least)) return {-1, 1};
  top = std::min(nice_above(top), value_max);
  return {-top, top};
}

std::vector<std::array<double, 2>> default_difference_extinction(const data::FieldInfo& field,
                                                                 const protocol::Range& range,
                                                                 const Lattice& lattice,
                                                                 const std::optional<Slice>& slice,
                                                                 bool map) {
  constexpr double clear_below = 0.2;  // of the greatest change
  const auto from_zero = default_extinction(field, {0, range[1]}, lattice, slice, map);
  const double top = from_zero.back()[1];
  if (map) return {{range[0], top}, {range[1], top}};
  const double clear = clear_below * range[1];
  return {{range[0], top}, {-clear, 0}, {clear, 0}, {range[1], top}};
}

}  // namespace windsplat::scene
