// What an array of values takes of a field, and how it is read.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "server/api/measure/subject.hpp"
#include "server/base/error.hpp"
#include "server/data/model/volume.hpp"
#include "server/scene/region/samples.hpp"

namespace windsplat::api {

// What is read: a box of samples, every so many of which are taken.
struct Selection {
  scene::Crop crop;
  std::array<int, 3> stride{1, 1, 1};
  std::array<std::size_t, 3> count{};  // of the samples that are taken: x, y, z
  bool one_level = false;              // the array has no dimension z
  std::size_t components = 1;
  std::size_t step = 0;

  [[nodiscard]] std::size_t values() const { return components * count[0] * count[1] * count[2]; }
};

// The volume that a selection is copied from; null: it is read in pieces, without the rest of the
// step. Errors: invalid, if these would be more than 16 GiB; those of loading.
Result<std::shared_ptr<const data::Volume>> whole_for(const Subject& subject,
                                                      const Selection& selection);

// Copies the values of a selection to `to`, in the order component, z, y, x; those of columns that
// it does not keep are NaN. `whole`: from whole_for(). Errors: cancelled, those of loading.
Result<void> copy_selected(const std::shared_ptr<const data::Volume>& whole, const Subject& subject,
                           const Selection& selection, std::uint8_t* to);

}  // namespace windsplat::api
