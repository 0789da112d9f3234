// View + dataset -> Scene: defaults filled in, fields loaded, camera and tables resolved.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

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

// Every default of the view filled in for this dataset, nothing loaded but what ranges need.
// Errors: invalid with a pointer (no such field, step, colour map; up parallel to the view; eye on
// the target).
Result<protocol::View> complete_view(const protocol::View& view, data::Dataset& dataset);

// The same, and where the dataset's samples stand for it.
struct Completed {
  protocol::View view;
  std::shared_ptr<const Placed> placed;
  // How often more than the picture asks for the data is halved, where the view leaves that open
  // (detail.hpp, coarser_level).
  int coarser = 0;
};
Result<Completed> complete_and_place(const protocol::View& view, data::Dataset& dataset);

// The view a viewer starts with: complete_view of {"dataset": id}.
Result<protocol::View> default_view(data::Dataset& dataset);

// A completed view made ready for the engine. Loads only the fields that the view shows. A view by
// itself is checked against the dataset once more.
Result<Scene> build_scene(const Completed& completed, data::Dataset& dataset);
Result<Scene> build_scene(const protocol::View& completed, data::Dataset& dataset);

// How many times larger the finest cells are in the picture than those that are averaged: below 1
// not every sample is drawn. 0 where every sample always is.
Result<double> detail_shown(const Completed& completed);

// The fields that a view, completed or not, may load of a dataset: each once, without those that
// are not there. Loads nothing.
std::vector<std::string> fields_of(const protocol::View& view, const data::DatasetInfo& info);

// What a completed view shows of its dataset at any step, without loading it: the names of fields,
// and how coarse.
struct Shown {
  std::vector<std::string> fields;
  data::Coarsening coarsening;
};
Result<Shown> shown_by(const Completed& completed);

// The values of geometry.heightField.
struct Heights {
  std::string name;
  std::string units;
  std::shared_ptr<const data::Volume> values;
};

// Where samples stand in the world (docs/design/rendering-model.md, "World space"). `heights`
// replace the vertical coordinate. Errors: bad_data (coordinates that do not ascend), invalid with
// a pointer into /geometry (a mapping, placement or height field that this grid does not allow).
Result<Lattice> place_lattice(const data::Grid& grid, const protocol::GeometryView& geometry,
                              const Heights* heights = nullptr);

// The same for a dataset. Loads the height field if there is one; a bent lattice is remembered by
// the dataset.
Result<std::shared_ptr<const Placed>> place_dataset(const protocol::GeometryView& geometry,
                                                    data::Dataset& dataset);

// Mean width of the lattice's cells along an axis, world units.
double cell_size(const Lattice& lattice, std::size_t axis);

// A field of that kind by its name. Errors: invalid at `pointer`.
Result<const data::FieldInfo*> find_field(const data::DatasetInfo& info, const std::string& name,
                                          data::FieldKind kind, const std::string& pointer);

// The view's layer of the grid, if it shows but one.
std::optional<Slice> slice_of(const protocol::GeometryView& geometry);

// What can be said of a geometry without loading or placing anything: the height field is a scalar,
// the grid has what the mapping needs, the slice lies within it.
Result<void> check_geometry(const protocol::GeometryView& geometry, const data::DatasetInfo& info);

// An orbit about the volume's centre, degrees; azimuth 0 looks north, positive moves the eye
// eastward; zoom 1 frames the whole box. Sets camera.eye, target and height of a view.
void orbit(protocol::View& view, const Lattice& lattice, double azimuth, double elevation,
           double zoom);

// Named starting points: "default", "winds" (no medium), "clouds" (no lines), "top", "south".
std::vector<std::string> preset_names();
Result<void> apply_preset(protocol::View& completed, const Lattice& lattice,
                          const std::string& preset);

}  // namespace windsplat::scene
