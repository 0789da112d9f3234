// Surfaces of a view + dataset -> their triangles and colours.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/scene/completed_view.hpp"
#include "server/surface/shown.hpp"

namespace windsplat::scene {

// Triangles of one surface.
constexpr std::size_t surface_triangles_max = std::size_t{1} << 22U;

// Checks that need no data. Errors: invalid with a pointer into /surfaces.
Result<void> check_surfaces(const protocol::View& view, const data::DatasetInfo& info);

// The field whose values colour a surface; empty: none.
std::string color_field_of(const protocol::SurfaceView& surface);
bool is_seen(const protocol::SurfaceView& surface);
// The fields that surfaces are made from, which may repeat.
std::vector<std::string> surface_fields(const protocol::View& view);

// The same, with the part of a region that is kept of them.
std::vector<std::pair<std::string, data::Derivation>> needed_by_surfaces(
    const CompletedView& completed);

// The triangles follow from field, step, cut and placement; they are kept by the dataset, counted,
// shared and evicted like a level of a volume. Errors: too_large with a pointer (more than
// surface_triangles_max); those of loading; out_of_memory.
Result<std::vector<surface::Shown>> make_surfaces(const CompletedView& completed,
                                                  data::Dataset& dataset);

// Why surfaces of the view have no triangles, one text for each that has none: every sample masked,
// the values of the field, or masked samples where the surface would be. Errors: those of loading.
Result<std::vector<std::string>> why_no_surfaces(const CompletedView& completed,
                                                 data::Dataset& dataset);

}  // namespace windsplat::scene
