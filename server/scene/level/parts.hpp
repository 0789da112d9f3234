// Parts of a level: the samples within the picture's pyramid, where the whole does not fit into
// memory (docs/design/bricks.md). View + camera + description -> a box, or boxes of a grid -> what
// is read of a field.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "protocol/view.hpp"
#include "server/data/model/box.hpp"
#include "server/data/model/box_grid.hpp"
#include "server/data/model/coarsen.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// What of the data a picture is drawn from. It follows from view, description and memory limit.
struct DrawnPart {
  std::array<int, 3> halvings{0, 0, 0};  // of the axes of the data
  std::optional<data::HeldPart> held;    // samples of that level; nullopt: all of them
  std::array<int, 3> wanted{0, 0, 0};    // halvings that would suffice for the picture
};

// A field that a view shows, and how it is reduced.
struct ShownField {
  std::string field;
  data::Coarsening coarsening;
  // Lines at full detail of which the middles of their kernels alone are read: the draw of groups
  // that are kernels, whose boxes are data::strided_box() of those of the samples.
  bool middles = false;
  // Of these, that all are held where other fields have a part, since they take little.
  bool all = false;
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
// lines_apart: all lines are held, and not those of a part.
std::array<int, 3> least_quantum(const protocol::View& completed, const std::array<int, 3>& dims,
                                 const std::array<int, 3>& halvings, bool lines_apart);

// The boxes of `size` samples of which box_in_sight() is the bounds, if they are at most `most`:
// those that the picture may show.
std::optional<data::BoxGrid> boxes_in_sight(const protocol::View& completed, const Camera& camera,
                                            const Lattice& whole,
                                            const std::array<int, 3>& halvings,
                                            const std::array<int, 3>& size, int most);

// What of the level holds what is in sight: the bricks of the store in sight if they are at most
// half of the box around them, or that box; otherwise the box rounded to as little as is needed, or
// smaller boxes of a grid. It takes at most 45 % of what a loader leaves of the memory limit, so
// that the part before it fits too. nullopt: it does not, or a field has no such level.
std::optional<data::HeldPart> part_for(const protocol::View& completed, const Camera& camera,
                                       const Lattice& whole, const std::array<int, 3>& halvings,
                                       const std::vector<ShownField>& shown,
                                       const data::Dataset& dataset);

bool holds_all_lines(const std::vector<ShownField>& shown);

// What is read of a field for a part of the samples of the level that is drawn; nullopt: that is
// not stored.
std::optional<data::Derivation> part_of_field(const data::Dataset& dataset, const ShownField& shown,
                                              const data::HeldPart& part);

}  // namespace windsplat::scene
