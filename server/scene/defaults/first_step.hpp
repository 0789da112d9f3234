// Numbers of a view that follow from the first step of a field, kept with the dataset.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/model/digest.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/scene/difference/difference.hpp"
#include "server/scene/place.hpp"
#include "server/scene/region/crop.hpp"

namespace windsplat::scene {

// Numbers that follow from a field at the first step (step_of_defaults) and from `arguments`:
// computed once, so that later steps do not need the first step resident. `placed`: where it is
// part of the grid, they follow from the samples of that part.
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
    auto volume = dataset.derived(field, step_of_defaults(dataset), part);
    if (!volume) return volume.error();
    return make(**volume);
  });
}

}  // namespace windsplat::scene
