// Geometry of a view + dataset -> placement of the samples, or an error.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// The terrain of a placed grid, made by the first picture that shows it.
struct LazyTerrain {
  std::once_flag once;
  std::shared_ptr<const terrain::Terrain> made;  // null: without relief
};

// The placed grid of a dataset (heights as its vertical axis) and the positions of its samples.
struct Placed {
  data::Grid grid;
  Lattice lattice;
  std::shared_ptr<LazyTerrain> terrain = std::make_shared<LazyTerrain>();
};

// Whether the lowest cells of the grid end at the ground or the sea floor, so that an opaque body
// is a terrain: a field gives their heights, and the levels are not those of pressure, which pass
// above and below the ground.
bool has_terrain(const protocol::GeometryView& geometry, const data::DatasetInfo& info);

// The surface below the lowest cells of a curved lattice; null if it lies at one height.
std::shared_ptr<const terrain::Terrain> terrain_of(const protocol::GeometryView& geometry,
                                                   const Placed& placed);

// Loads the height field if there is one; the dataset caches a bent lattice. Errors: those of
// place_lattice() and of loading.
Result<std::shared_ptr<const Placed>> place_dataset(const protocol::GeometryView& geometry,
                                                    data::Dataset& dataset);

// Whether the samples are on a bent lattice: mapped onto a sphere or displaced by a height field.
bool is_bent(const protocol::GeometryView& geometry);

// The field of that kind and name. Errors: invalid at `pointer`.
Result<const data::FieldInfo*> find_field(const data::DatasetInfo& info, const std::string& name,
                                          data::FieldKind kind, const std::string& pointer);

// The layer of the grid that the view shows, if it is a slice; if it is a plane, or lies between
// two layers, the one nearest to it. `lattice`: that of the dataset.
std::optional<Slice> slice_of(const protocol::GeometryView& geometry, const Lattice& lattice);

// Validates a geometry without loading or placing anything: the height field is a scalar, the grid
// supports the mapping, the slice is within the grid. Errors: invalid with a pointer.
Result<void> check_geometry(const protocol::GeometryView& geometry, const data::DatasetInfo& info);

}  // namespace windsplat::scene
