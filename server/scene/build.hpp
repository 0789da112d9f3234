// Completed view + dataset -> Scene: tables, camera, placement and the fields that are shown.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// Loads only the fields that the view shows. Errors: those of loading; invalid (camera).
Result<Scene> build_scene(const CompletedView& completed, data::Dataset& dataset);
// Completes the view first.
Result<Scene> build_scene(const protocol::View& view, data::Dataset& dataset);

// How many times larger the finest cells are in the picture than those that are averaged: below 1
// not every sample is drawn. 0 where every sample always is.
double detail_shown(const CompletedView& completed);

// How often each axis of the data is halved for this picture.
std::array<int, 3> level_of(const CompletedView& completed);
std::array<int, 3> level_of(const ViewOutline& outline);

// What a completed view shows of its dataset at any step, without loading it: the names of fields,
// and how coarse.
struct Shown {
  std::vector<std::string> fields;
  data::Coarsening coarsening;
};
Shown shown_by(const CompletedView& completed);

}  // namespace windsplat::scene
