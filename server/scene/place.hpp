// Geometry of a view + dataset -> placement of the samples, or an error.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/scene/region/samples.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// What an opaque body shows as the ground or the sea floor, if it is drawn.
enum class GroundFrom {
  none,    // a rectangle or a sphere
  levels,  // the bottom of the lowest cells
  file,    // the heights of the file (data::Ground)
};

// The placed grid of a dataset (heights as its vertical axis) and the positions of its samples.
struct Placed {
  data::Grid grid;
  Lattice lattice;
  GroundFrom ground = GroundFrom::none;
  // Of every column the lowest level with an unmasked height; -1: none. Empty: level 0 everywhere.
  std::vector<int> lowest;
  // Where a region keeps only part of the grid: the whole, and what is kept. Grid and lattice are
  // those of the part.
  std::shared_ptr<const Placed> whole;
  std::optional<Crop> crop;
  std::string region;  // identifies the crop among those of the dataset
};

// The surface of the ground; null if the placement has none, or one at constant height below the
// levels. Counted, shared and evicted like a level of a volume. Errors: out_of_memory,
// not_resident.
Result<std::shared_ptr<const terrain::Terrain>> terrain_of(const protocol::GeometryView& geometry,
                                                           const Placed& placed,
                                                           data::Dataset& dataset);

// Loads the height field if there is one; the dataset caches a bent lattice, and the part of a
// region with columns of its own. Errors: those of place_lattice(), of crop_of() and of loading.
Result<std::shared_ptr<const Placed>> place_dataset(const protocol::GeometryView& geometry,
                                                    data::Dataset& dataset,
                                                    const protocol::RegionView& region = {});

// Whether the samples are on a bent lattice: mapped onto a sphere or displaced by a height field.
bool is_bent(const protocol::GeometryView& geometry);

// The field of that kind and name. Errors: invalid at `pointer`.
Result<const data::FieldInfo*> find_field(const data::DatasetInfo& info, const std::string& name,
                                          data::FieldKind kind, const std::string& pointer);

// The layer of the grid that the view shows, if it is a slice; if it is a plane, or lies between
// two layers, the one nearest to it. `lattice`: that of the dataset.
std::optional<Slice> slice_of(const protocol::GeometryView& geometry, const Lattice& lattice);

// The index of a slice among the samples of a lattice that is part of the data; below 0 or beyond
// the last one: the part lacks it.
double slice_index(const protocol::SliceView& slice, const Lattice& lattice);

// Validates a geometry without loading or placing anything: the height field is a scalar, the grid
// supports the mapping, the slice is within the grid. Errors: invalid with a pointer.
Result<void> check_geometry(const protocol::GeometryView& geometry, const data::DatasetInfo& info);

}  // namespace windsplat::scene
