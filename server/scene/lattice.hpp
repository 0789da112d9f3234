// Positions of the samples of a grid in the world (docs/design/rendering-model.md, "World space").
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/data/model/volume.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// The values of geometry.heightField.
struct Heights {
  std::string name;
  std::string units;
  std::shared_ptr<const data::Volume> values;
};

// `heights` replace the vertical coordinate. Errors: bad_data (coordinates that do not ascend),
// invalid with a pointer into /geometry (a mapping, placement or height field that this grid does
// not allow).
Result<Lattice> place_lattice(const data::Grid& grid, const protocol::GeometryView& geometry,
                              const Heights* heights = nullptr);

// Mean width of the lattice's cells along an axis, world units.
double cell_size(const Lattice& lattice, std::size_t axis);

}  // namespace windsplat::scene
