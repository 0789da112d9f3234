// Completed view + dataset -> Scene: tables, camera, placement and the fields to show.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/level/parts.hpp"
#include "server/scene/level/stand_in.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// Loads only the fields that the view shows. Errors: those of loading; invalid (camera).
Result<Scene> build_scene(const CompletedView& completed, data::Dataset& dataset,
                          StandIn stand_in = StandIn::none);
// Completes the view first.
Result<Scene> build_scene(const protocol::View& view, data::Dataset& dataset);

// The size of the finest cells in the picture relative to the size below which cells are merged:
// below 1, not every sample is drawn. 0 if every sample is always drawn.
double detail_shown(const CompletedView& completed);

// What of the data this picture is drawn from: every sample if levels do not fit into the memory
// limit of the dataset.
DrawnPart part_of(const CompletedView& completed, const data::Dataset& dataset);
DrawnPart part_of(const ViewOutline& outline, const data::Dataset& dataset);
// Number of halvings of each axis of the data for a picture of another height, in pixels, of the
// view without additional halvings.
std::array<int, 3> level_at(const CompletedView& completed, int height,
                            const data::Dataset& dataset);

// What a completed view needs of the dataset at any step, determined without loading.
struct Needs {
  std::vector<Needed> fields;
  std::string places;  // the auxiliary variant of the places of a section; empty: none
};
Result<Needs> needs_of(const CompletedView& completed, const data::Dataset& dataset);

}  // namespace windsplat::scene
