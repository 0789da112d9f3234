#include "server/scene/level/choice.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "protocol/view/shown.hpp"
#include "server/data/model/middles.hpp"
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

// Whether lines at full detail need nothing of their field but the middles of their kernels, and
// these are stored. Layers of one stride, light and colours have the indices of the vectors.
bool may_use_middles(const View& view, const Lattice& lattice, const data::Dataset& dataset) {
  if (!has_strided_lines(view) || view.light || !may_use_stored(view, lattice, dataset)) {
    return false;
  }
  const auto& media = *view.scalars;
  const bool shared = std::any_of(media.begin(), media.end(), [&](const auto& of) {
    return absorbs(of) && of.stride == view.vector.stride;
  });
  if (shared || view.vector.color.by == protocol::ColorBy::scalar) return false;
  const data::DatasetInfo& info = dataset.info();
  const data::FieldInfo* const field = info.find(view.vector.field.name);
  if (field == nullptr) return false;
  const auto index = static_cast<std::size_t>(field - info.fields.data());
  return data::stored_middles(info, index, *view.vector.stride).has_value();
}

}  // namespace

ShownField lines_at(const View& view, const data::Coarsening& how, const Lattice& lattice,
                    const data::Dataset& dataset) {
  ShownField lines{view.vector.field.name, drawn(how, view)};
  if (how.halvings == std::array{0, 0, 0} && may_use_middles(view, lattice, dataset)) {
    constexpr double share_max = 0.1;  // of the memory, of middles that are all held
    const data::Coarsening middles = data::middles_of(lines.coarsening.stride);
    const auto bytes = static_cast<double>(dataset.level_bytes(lines.field, middles));
    const bool all =
        std::any_of(view.scalars->begin(), view.scalars->end(), absorbs) &&
        dataset.fits_beside_boxes(static_cast<std::uint64_t>(bytes / share_max), {lines.field});
    return {lines.field, middles, true, all};
  }
  return lines;
}

std::vector<ShownField> shown_at(const View& view, const data::Coarsening& how,
                                 const Lattice& lattice, const data::Dataset& dataset) {
  std::vector<ShownField> shown;
  if (shows_lines(view)) {
    shown.push_back(lines_at(view, how, lattice, dataset));
    if (view.vector.color.by == protocol::ColorBy::scalar) {
      shown.push_back({view.vector.color.field.value(), drawn(how, view)});
    }
  }
  for (const protocol::ScalarView& scalar : *view.scalars) {
    if (absorbs(scalar)) shown.push_back({scalar.field, how});
  }
  return shown;
}

namespace {

bool keeps_part(const View& view) { return is_cropped(view.region) || !view.region.where.empty(); }

// Whether the levels of all fields fit into memory beside the largest volume from which one is
// reduced, and what a region keeps of it; a stored level is not reduced. It depends on sizes alone,
// so that a view has the same level whatever is resident.
bool are_within_limit(const std::vector<ShownField>& shown, const View& view,
                      const Lattice& lattice, const data::Dataset& dataset) {
  const bool kept = keeps_part(view);
  std::set<std::pair<std::string, data::Reduction>> counted;
  std::uint64_t levels = 0;
  std::uint64_t largest = 0;
  for (const auto& [field, how, middles, all] : shown) {
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

// Whether what is drawn of all fields at full detail fits into memory.
bool all_detail_fits(const std::vector<ShownField>& shown, const data::Dataset& dataset) {
  std::set<std::string> counted;
  std::uint64_t bytes = 0;
  for (const ShownField& one : shown) {
    if (!counted.insert(one.field).second) continue;
    bytes += one.middles ? dataset.level_bytes(one.field, one.coarsening)
                         : dataset.loading_bytes(one.field);
  }
  return dataset.fits_beside_loader(bytes, {counted.begin(), counted.end()});
}

}  // namespace

bool may_use_stored(const View& view, const Lattice& lattice, const data::Dataset& dataset) {
  const data::DatasetInfo& info = dataset.info();
  const bool traced = shows_lines(view) && protocol::has_streamlets(view);
  return info.stored != nullptr && !dataset.subtrahend() && !lattice.places &&
         lattice.dims == info.grid.dims() && !view.geometry.slice && !view.geometry.plane &&
         !traced && !keeps_part(view);
}

bool may_merge(const View& view) {
  const auto& media = *view.scalars;
  const bool strided = std::any_of(media.begin(), media.end(),
                                   [](const protocol::ScalarView& of) { return of.stride > 1; });
  return view.method.detail != protocol::Detail::full &&
         view.method.name != protocol::MethodName::reference && !strided;
}

namespace {

// What of the data a view is drawn from.
class Choice {
 public:
  Choice(const View& view, const Camera& camera, const Lattice& lattice,
         const data::Dataset& dataset, const std::array<int, 3>& least = {0, 0, 0})
      : view_(view), camera_(camera), lattice_(lattice), dataset_(dataset), least_(least) {}

  // The fraction of the requested detail that the picture can show. If there is memory for the
  // volumes but not for their levels, every sample is drawn; if there is not, what is in sight, or
  // a coarser stored level. The report of the frame says so.
  [[nodiscard]] DrawnPart part(int coarser) const {
    constexpr std::array full{0, 0, 0};
    std::array<int, 3> level = full;
    if (!is_drawn_in_full(view_)) {
      const auto slice = slice_of(view_.geometry, lattice_);
      level = choose_level(camera_, lattice_, slice, merge_limits(view_));
      level = no_finer(coarser_level(lattice_, slice, level, coarser));
      if (level != full && fits(level)) return {level, std::nullopt, level};
    }
    DrawnPart all{full, std::nullopt, level};
    if (!may_use_stored(view_, lattice_, dataset_)) return all;
    if (all_detail_fits(shown(full), dataset_)) return all;
    if (!may_merge(view_)) return {full, held(full), full};
    if (is_drawn_in_full(view_) && has_strided_lines(view_)) {
      const ShownField lines = shown(full).front();
      if (lines.middles) {
        if (auto of_middles = held(full)) return {full, of_middles, full};
      }
      // At these levels the lines are the same.
      while (2 << level[0] <= *view_.vector.stride) {
        for (int& h : level) ++h;
      }
    }
    return stored(no_finer(level));
  }

 private:
  [[nodiscard]] std::vector<ShownField> shown(const std::array<int, 3>& level) const {
    return shown_at(view_, coarsening_of(lattice_, level), lattice_, dataset_);
  }

  [[nodiscard]] std::array<int, 3> no_finer(std::array<int, 3> level) const {
    for (std::size_t a = 0; a < 3; ++a) level[a] = std::max(level[a], least_[a]);
    return level;
  }

  [[nodiscard]] bool fits(const std::array<int, 3>& level) const {
    return are_within_limit(shown(level), view_, lattice_, dataset_);
  }

  [[nodiscard]] std::optional<data::HeldPart> held(const std::array<int, 3>& level) const {
    if (!may_use_part(view_)) return std::nullopt;
    return part_for(view_, camera_, lattice_, level, shown(level), dataset_);
  }

  // The coarsest stored level of which no axis is halved more often than in `level`, or the first
  // coarser one of which the whole, or what is in sight, fits into memory; the coarsest of all if
  // none does. The whole of level 0 does not.
  [[nodiscard]] DrawnPart stored(const std::array<int, 3>& level) const {
    const auto& levels = dataset_.info().stored->levels;
    const auto is_allowed = [&](const std::array<int, 3>& one) {
      return one[0] <= level[0] && one[1] <= level[1] && one[2] <= level[2];
    };
    std::size_t n = 0;
    while (n + 1 < levels.size() && is_allowed(levels[n + 1])) ++n;
    const std::array<int, 3> wanted = levels[n];
    for (; n < levels.size(); ++n) {
      if (n > 0 && fits(levels[n])) return {levels[n], std::nullopt, wanted};
      if (auto of_level = held(levels[n])) return {levels[n], of_level, wanted};
    }
    // Lines that are not stored at coarser levels.
    if (auto of_samples = held(levels.front())) return {levels.front(), of_samples, wanted};
    return {levels.back(), std::nullopt, wanted};
  }

  const View& view_;
  const Camera& camera_;
  const Lattice& lattice_;
  const data::Dataset& dataset_;
  const std::array<int, 3> least_;  // halvings of a level
};

}  // namespace

DrawnPart part_of(const CompletedView& completed, const data::Dataset& dataset) {
  return Choice(completed.view(), completed.camera(), completed.lattice(), dataset,
                completed.least_level())
      .part(completed.coarser());
}

DrawnPart part_of(const ViewOutline& outline, const data::Dataset& dataset) {
  if (outline.bent) return {};
  return Choice(outline.view, outline.camera, outline.lattice, dataset).part(0);
}

std::array<int, 3> level_at(const CompletedView& completed, int height,
                            const data::Dataset& dataset) {
  Camera camera = completed.camera();
  const double aspect = static_cast<double>(camera.width) / camera.height;
  camera.height = height;
  camera.width = std::max(1, static_cast<int>(std::lround(aspect * height)));
  return Choice(completed.view(), camera, completed.lattice(), dataset).part(0).halvings;
}

}  // namespace windsplat::scene
