// A curved lattice -> the grid of its sunlight, found once.
#pragma once

#include <string>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::light {

// Appends all that determines the places of the samples of a lattice: those of the geometry of the
// view, and which part and level of the data it is. Numbers are appended with all their bytes, as
// clients choose them: two views with the same digest could be found.
void append_lattice(const protocol::GeometryView& geometry, const scene::Scene& scene,
                    std::string& key);
void append(double number, std::string& key);
void append(const std::string& text, std::string& key);

// grid_around() the lattice of the scene, which takes a pass over its samples. Remembered by the
// dataset for all views with this lattice, whatever their step, media and sun. Errors: cancelled,
// by Dataset::cancellation().
Result<scene::Lattice> kept_grid(const protocol::GeometryView& geometry, const scene::Scene& scene,
                                 data::Dataset& dataset);

}  // namespace windsplat::light
