// Numbers of a view that follow from one step of a field, kept with the dataset.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/model/digest.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/scene/defaults/stored_samples.hpp"
#include "server/scene/difference/difference.hpp"
#include "server/scene/place.hpp"
#include "server/scene/region/crop.hpp"

namespace windsplat::scene {

// The range of a field of the data that the source has stored; null: it has not.
inline const data::StoredRange* stored_range(const data::Dataset& dataset, const std::string& field,
                                             std::size_t step) {
  const data::DatasetInfo& info = dataset.info();
  const data::FieldInfo* const about = info.find(field);
  if (about == nullptr || dataset.subtrahend()) return nullptr;
  return data::stored_range(info, static_cast<std::size_t>(about - info.fields.data()), step);
}

// The step from which defaults of a field follow, whatever step is shown: step_of_defaults, or, if
// the field is constant or masked there (clouds that have not formed), the first of the last step,
// the middle one and those at a quarter and three quarters at which it is not. At most five steps
// are read, and only once; of later ones none that cannot be read, since a file may be cut off
// before its last step. Errors: those of volume(); cancelled, between steps.
inline Result<std::size_t> step_with_values(data::Dataset& dataset, const std::string& field) {
  const std::size_t first = step_of_defaults(dataset);
  const auto found = dataset.remembered("step/" + field, [&]() -> Result<std::vector<double>> {
    const std::size_t last = last_step(dataset);
    std::vector<std::size_t> tried;
    for (const std::size_t step : {first, last, last / 2, last / 4, last - last / 4}) {
      if (std::find(tried.begin(), tried.end(), step) != tried.end()) continue;
      tried.push_back(step);
      if (dataset.cancellation().cancelled()) {
        return make_error(ErrorKind::cancelled, "request cancelled");
      }
      if (const auto* const stored = stored_range(dataset, field, step)) {
        if (stored->range[1] > stored->range[0]) return std::vector{static_cast<double>(step)};
        continue;
      }
      const auto volume = dataset.volume(field, step);
      const bool unreadable = !volume && volume.error().kind == ErrorKind::bad_data;
      if (unreadable && step != first) continue;
      if (!volume) return volume.error();
      if ((*volume)->range[1] > (*volume)->range[0]) {
        return std::vector{static_cast<double>(step)};
      }
    }
    return std::vector{static_cast<double>(first)};
  });
  if (!found) return found.error();
  return static_cast<std::size_t>(found->front());
}

// Numbers that follow from a field at that step and from `arguments`: computed once, so that later
// steps do not need it resident. `make` takes its DefaultSamples. `placed`: where it is part of the
// grid, they follow from the samples of that part.
template <class Make>
Result<std::vector<double>> from_first_step(data::Dataset& dataset, const char* what,
                                            const std::string& field,
                                            const std::vector<double>& arguments, const Make& make,
                                            const Placed* placed = nullptr) {
  std::string key = what;
  key += '/' + field + '/';
  key += data::digest_of(
      {reinterpret_cast<const char*>(arguments.data()), arguments.size() * sizeof(double)});
  data::Derivation part;
  if (placed != nullptr && placed->crop) {
    part = kept_part(*placed, dataset.info().find(field)->components.size(), {});
    key += data::digest_of(placed->region);
  }
  return dataset.remembered(key, [&]() -> Result<std::vector<double>> {
    const auto step = step_with_values(dataset, field);
    if (!step) return step.error();
    if (part.variant.empty()) {
      const auto stored = stored_samples(dataset, field, *step);
      if (!stored) return stored.error();
      if (*stored) return make(**stored);
    }
    auto volume = dataset.derived(field, *step, part);
    if (!volume) return volume.error();
    return make(DefaultSamples{std::move(*volume)});
  });
}

}  // namespace windsplat::scene
