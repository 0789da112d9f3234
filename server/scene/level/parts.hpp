// Parts of a level: the box of its samples within the picture's pyramid, where the whole does not
// fit into memory (docs/design/bricks.md). View + camera + description -> box -> what is read of a
// field.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "protocol/view.hpp"
#include "server/data/model/box.hpp"
#include "server/data/model/coarsen.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// What of the data a picture is drawn from. It follows from view, description and memory limit.
struct DrawnPart {
  std::array<int, 3> halvings{0, 0, 0};  // of the axes of the data
  std::optional<data::Box> box;          // samples of that level; nullopt: all of them
  std::array<int, 3> wanted{0, 0, 0};    // halvings that would suffice for the picture
};

// A field that a view shows, and how it is reduced.
struct ShownField {
  std::string field;
  data::Coarsening coarsening;
  // Lines at full detail of which the middles of their kernels alone are read: the draw of groups
  // that are kernels, whose boxes are data::strided_box() of those of the samples.
  bool middles = false;
};

// What a field is drawn from.
struct Needed {
  std::string field;
  data::Derivation how;
};

// Whether a view can be drawn from a part: not what is computed from the whole, as light and
// surfaces are.
bool may_use_part(const protocol::View& view);

// The samples of a level that the picture may show, of a rectilinear lattice without a slice: those
// of every brick of the engine that is not culled, in units of `quantum` samples along each axis.
// The first unit if none is in sight. O(units at the surface of the pyramid).
data::Box box_in_sight(const protocol::View& completed, const Camera& camera, const Lattice& whole,
                       const std::array<int, 3>& halvings, const std::array<int, 3>& quantum);

// Boxes begin and end at multiples of these, or with the data: bricks of kernels of every stride,
// and whole groups of the kernels that are drawn at a coarser level.
// dims: of the data.
std::array<int, 3> least_quantum(const protocol::View& completed, const std::array<int, 3>& dims,
                                 const std::array<int, 3>& halvings);

// The box of the level that holds what is in sight, rounded to bricks of the store, or to as little
// as is needed to take at most 45 % of what a loader leaves of the memory limit, so that the box
// before it fits too.
// nullopt: it does not, or a field has no such level.
std::optional<data::Box> box_for(const protocol::View& completed, const Camera& camera,
                                 const Lattice& whole, const std::array<int, 3>& halvings,
                                 const std::vector<ShownField>& shown,
                                 const data::Dataset& dataset);

// What is read of a field for a box of samples of the level that is drawn; nullopt: that is not
// stored.
std::optional<data::Derivation> part_of_field(const data::Dataset& dataset, const ShownField& shown,
                                              const data::Box& box);

}  // namespace windsplat::scene
