// View + dataset -> Scene: defaults filled in, fields loaded, camera and tables resolved.
#pragma once

#include <string>
#include <vector>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/data/store.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// Every default of the view filled in for this dataset, nothing loaded but what ranges need.
// Errors: invalid with a pointer (no such field, step, colour map; up parallel to the view; eye on
// the target).
Result<protocol::View> complete_view(const protocol::View& view, data::Dataset& dataset);

// The view a viewer starts with: complete_view of {"dataset": id}.
Result<protocol::View> default_view(data::Dataset& dataset);

// A completed view made ready for the engine. Loads only the fields that the view shows.
Result<Scene> build_scene(const protocol::View& completed, data::Dataset& dataset);

// Where samples stand in the world (INTERFACE: "World").
Result<Lattice> place_lattice(const data::Grid& grid, const protocol::GeometryView& geometry);

// An orbit about the volume's centre, degrees; azimuth 0 looks north, positive moves the eye
// eastward; zoom 1 frames the whole box. Sets camera.eye, target and height of a view.
void orbit(protocol::View& view, const Lattice& lattice, double azimuth, double elevation,
           double zoom);

// Named starting points: "default", "winds" (no medium), "clouds" (no lines), "top", "south".
std::vector<std::string> preset_names();
Result<void> apply_preset(protocol::View& completed, const Lattice& lattice,
                          const std::string& preset);

}  // namespace windsplat::scene
