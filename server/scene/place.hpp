// A view's geometry and a dataset -> what is wrong with it, or where its samples stand.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// A dataset's grid as placed (heights are its vertical axis) and where its samples stand.
struct Placed {
  data::Grid grid;
  Lattice lattice;
};

// Loads the height field if there is one; a bent lattice is remembered by the dataset. Errors:
// those of place_lattice() and of loading.
Result<std::shared_ptr<const Placed>> place_dataset(const protocol::GeometryView& geometry,
                                                    data::Dataset& dataset);

// Whether samples stand on a bent lattice: mapped onto a sphere or by a height field.
bool is_bent(const protocol::GeometryView& geometry);

// A field of that kind by its name. Errors: invalid at `pointer`.
Result<const data::FieldInfo*> find_field(const data::DatasetInfo& info, const std::string& name,
                                          data::FieldKind kind, const std::string& pointer);

// The view's layer of the grid, if it shows but one.
std::optional<Slice> slice_of(const protocol::GeometryView& geometry);

// Checks a geometry without loading or placing anything: the height field is a scalar, the grid
// has what the mapping needs, the slice lies within it. Errors: invalid with a pointer.
Result<void> check_geometry(const protocol::GeometryView& geometry, const data::DatasetInfo& info);

}  // namespace windsplat::scene
