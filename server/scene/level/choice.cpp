#include "server/scene/level/choice.hpp"

#include <algorithm>
#include <array>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "protocol/view/shown.hpp"
#include "server/data/model/stored.hpp"
#include "server/scene/build.hpp"
#include "server/scene/lines/mark.hpp"
#include "server/scene/region/select.hpp"
#include "server/scene/section.hpp"

namespace windsplat::scene {

using protocol::absorbs;
using protocol::has_strided_lines;
using protocol::is_drawn_in_full;
using protocol::shows_lines;
using protocol::View;

data::Coarsening drawn(data::Coarsening how, const View& view) {
  how.reduction = data::Reduction::drawn;
  how.stride = view.vector.stride.value();
  return how;
}

std::uint64_t level_bytes(const Lattice& lattice, std::size_t components,
                          const data::Coarsening& how) {
  auto values = static_cast<int>(components);
  if (how.halvings != std::array{0, 0, 0}) values = reduced_components(values, how.reduction);
  std::uint64_t bytes = sizeof(float) * static_cast<std::uint64_t>(values);
  for (std::size_t a = 0; a < 3; ++a) {
    bytes *= static_cast<std::uint64_t>(data::halved(lattice.dims[a], how.halvings[a]));
  }
  return bytes;
}

MergeLimits merge_limits(const View& view) {
  MergeLimits limits;
  if (!shows_lines(view) || has_strided_lines(view)) return limits;  // a halving merges none
  VectorLayer layer;
  set_radii(view.vector, view.image.height, layer);
  limits.samples = std::min(limits.samples, 1 / layer.opacity);
  return limits;
}

namespace {

// A field and how it is reduced.
struct Shown {
  std::string field;
  data::Coarsening coarsening;
};

std::vector<Shown> shown_at(const View& view, const data::Coarsening& how) {
  std::vector<Shown> shown;
  if (shows_lines(view)) {
    shown.push_back({view.vector.field.name, drawn(how, view)});
    if (view.vector.color.by == protocol::ColorBy::scalar) {
      shown.push_back({view.vector.color.field.value(), drawn(how, view)});
    }
  }
  for (const protocol::ScalarView& scalar : *view.scalars) {
    if (absorbs(scalar)) shown.push_back({scalar.field, how});
  }
  return shown;
}

bool keeps_part(const View& view) { return is_cropped(view.region) || !view.region.where.empty(); }

// Whether the levels of all fields fit into memory beside the largest volume from which one is
// reduced, and what a region keeps of it; a stored level is not reduced. It depends on sizes alone,
// so that a view has the same level whatever is resident.
bool are_within_limit(const std::vector<Shown>& shown, const View& view, const Lattice& lattice,
                      const data::Dataset& dataset) {
  const bool kept = keeps_part(view);
  std::set<std::pair<std::string, data::Reduction>> counted;
  std::uint64_t levels = 0;
  std::uint64_t largest = 0;
  for (const auto& [field, how] : shown) {
    if (!counted.emplace(field, how.reduction).second) continue;
    const std::size_t components = dataset.info().find(field)->components.size();
    levels += level_bytes(lattice, components, how);
    largest =
        std::max(largest, kept ? dataset.loading_bytes(field) + level_bytes(lattice, components, {})
                               : dataset.bytes_beside_level(field, how));
  }
  // Of a loader that reads chunks of a level.
  const std::uint64_t reading = dataset.info().stored ? std::uint64_t{8} << 20 : 0;
  return dataset.is_within_limit(levels + largest + reading);
}

// Whether every sample of all fields fits into memory.
bool fits_in_full(const std::vector<Shown>& shown, const data::Dataset& dataset) {
  std::vector<std::string> fields;
  fields.reserve(shown.size());
  for (const Shown& one : shown) fields.push_back(one.field);
  return dataset.fits_in_full(fields);
}

// Whether the view can be drawn from stored levels in place of every sample: not what asks for
// these, shows them themselves, as slices and streamlets do, or a part of them. The reference draws
// no merged samples.
bool may_use_stored(const View& view, const Lattice& lattice, const data::Dataset& dataset) {
  const data::DatasetInfo& info = dataset.info();
  const auto& media = *view.scalars;
  const bool strided = std::any_of(media.begin(), media.end(),
                                   [](const protocol::ScalarView& of) { return of.stride > 1; });
  const bool traced = shows_lines(view) && protocol::has_streamlets(view);
  const bool wants_all = view.method.detail == protocol::Detail::full ||
                         view.method.name == protocol::MethodName::reference;
  return !wants_all && info.stored != nullptr && !dataset.subtrahend() && !lattice.places &&
         lattice.dims == info.grid.dims() && !view.geometry.slice && !view.geometry.plane &&
         !strided && !traced && !keeps_part(view);
}

// The coarsest stored level of which no axis is halved more often than in `level`, or the first
// coarser one that fits into memory; the coarsest of all if none does.
std::array<int, 3> stored_level_for(const View& view, const Lattice& lattice,
                                    const std::array<int, 3>& level, const data::Dataset& dataset) {
  const auto& levels = dataset.info().stored->levels;
  std::size_t n = 0;
  const auto is_allowed = [&](const std::array<int, 3>& stored) {
    return stored[0] <= level[0] && stored[1] <= level[1] && stored[2] <= level[2];
  };
  while (n + 1 < levels.size() && is_allowed(levels[n + 1])) ++n;
  for (n = std::max<std::size_t>(n, 1); n < levels.size(); ++n) {
    const auto shown = shown_at(view, coarsening_of(lattice, levels[n]));
    if (are_within_limit(shown, view, lattice, dataset)) return levels[n];
  }
  return levels.back();
}

// The fraction of the requested detail that the picture can show. If there is memory for the
// volumes but not for their levels, every sample is drawn; if there is not, a coarser stored level.
// The report of the frame says so.
std::array<int, 3> level_for(const View& view, const Camera& camera, const Lattice& lattice,
                             int coarser, const data::Dataset& dataset) {
  constexpr std::array full{0, 0, 0};
  const auto slice = slice_of(view.geometry, lattice);
  std::array<int, 3> level = full;
  if (!is_drawn_in_full(view)) {
    level = coarser_level(lattice, slice, choose_level(camera, lattice, slice, merge_limits(view)),
                          coarser);
    const auto fits = [&] {
      return are_within_limit(shown_at(view, coarsening_of(lattice, level)), view, lattice,
                              dataset);
    };
    if (level != full && fits()) return level;
  }
  if (!may_use_stored(view, lattice, dataset)) return full;
  if (fits_in_full(shown_at(view, coarsening_of(lattice, full)), dataset)) return full;
  if (is_drawn_in_full(view) && has_strided_lines(view)) {
    // At these levels the lines are the same.
    while (2 << level[0] <= *view.vector.stride) {
      for (int& h : level) ++h;
    }
  }
  return stored_level_for(view, lattice, level, dataset);
}

}  // namespace

std::array<int, 3> level_of(const CompletedView& completed, const data::Dataset& dataset) {
  return level_for(completed.view(), completed.camera(), completed.lattice(), completed.coarser(),
                   dataset);
}

std::array<int, 3> level_of(const ViewOutline& outline, const data::Dataset& dataset) {
  if (outline.bent) return {0, 0, 0};
  return level_for(outline.view, outline.camera, outline.lattice, 0, dataset);
}

std::array<int, 3> level_at(const CompletedView& completed, int height,
                            const data::Dataset& dataset) {
  Camera camera = completed.camera();
  camera.height = height;
  return level_for(completed.view(), camera, completed.lattice(), 0, dataset);
}

}  // namespace windsplat::scene
