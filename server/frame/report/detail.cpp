#include "server/frame/report/detail.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "protocol/view/shown.hpp"
#include "server/engine/render.hpp"
#include "server/scene/build.hpp"

namespace windsplat::frame {
namespace {

using Level = std::array<int, 3>;

constexpr std::size_t compared_levels = 2;  // beyond that of the picture
constexpr std::size_t values_a_pixel = 4;

// The place of the level among those stored; their number if it is not one of them.
std::size_t stored_index(const Level& level, const data::Dataset& dataset) {
  const auto& levels = dataset.info().stored->levels;
  return static_cast<std::size_t>(std::find(levels.begin(), levels.end(), level) - levels.begin());
}

// Whether the lines of the scene are those of full detail: the level has one sample of each of
// their kernels, coarser ones may have fewer.
bool has_all_lines(const protocol::View& view, const Level& level) {
  const int group = 1 << *std::max_element(level.begin(), level.end());
  return protocol::has_strided_lines(view) && group <= *view.vector.stride;
}

// Values of a picture, or differences of two, in steps of 2^-15, as pictures of floats take much
// memory. Their errors of rounding, 1e-5 in the mean, are small against the errors of pictures.
using Values = std::vector<std::int16_t>;
constexpr float unit = 32767;

std::int16_t rounded(float value) {
  return static_cast<std::int16_t>(std::lround(unit * std::clamp(value, 0.0F, 1.0F)));
}

std::size_t values_of(const scene::Camera& camera) {
  return values_a_pixel * static_cast<std::size_t>(camera.width) *
         static_cast<std::size_t>(camera.height);
}

// Two pictures, and what is seen of each pixel.
std::uint64_t bytes_to_compare(const scene::Camera& camera) {
  constexpr std::uint64_t of_pixel = (2 * values_a_pixel + 1) * sizeof(std::int16_t);
  return of_pixel * values_of(camera) / values_a_pixel;
}

// Calls take(index in the picture, value) of every value that is drawn.
template <class Take>
Result<void> each_drawn(const scene::Scene& scene, ThreadPool& pool, const CancelToken& cancel,
                        Workspace& workspace, const Take& take) {
  const auto width = static_cast<std::size_t>(scene.camera.width);
  const auto sink = [&](const engine::TilePixels& tile) {
    for (int y = 0; y < tile.height; ++y) {
      const float* const row = tile.rgba + static_cast<std::size_t>(y) * tile.stride;
      const std::size_t first = values_a_pixel * (static_cast<std::size_t>(tile.y + y) * width +
                                                  static_cast<std::size_t>(tile.x));
      for (std::size_t n = 0; n < values_a_pixel * static_cast<std::size_t>(tile.width); ++n) {
        take(first + n, rounded(row[n]));
      }
    }
  };
  const auto work = engine::render(scene, pool, cancel, workspace.space, sink);
  return work ? Result<void>() : work.error();
}

Result<Values> picture_of(const scene::Scene& scene, ThreadPool& pool, const CancelToken& cancel,
                          Workspace& workspace) {
  Values out(values_of(scene.camera));
  const auto drawn = each_drawn(scene, pool, cancel, workspace,
                                [&](std::size_t at, std::int16_t value) { out[at] = value; });
  if (!drawn) return drawn.error();
  return out;
}

// How much of a medium is seen in each pixel beside lines that lie anywhere in it: they hide half
// of it in the mean.
Result<Values> seen_beside_lines(const scene::Scene& scene, ThreadPool& pool,
                                 const CancelToken& cancel, Workspace& workspace) {
  scene::Scene lines = scene;
  lines.scalars.clear();
  Values out(values_of(scene.camera) / values_a_pixel, static_cast<std::int16_t>(unit));
  const auto drawn =
      each_drawn(lines, pool, cancel, workspace, [&](std::size_t at, std::int16_t value) {
        if (at % values_a_pixel != values_a_pixel - 1) return;
        out[at / values_a_pixel] -= static_cast<std::int16_t>(value / 2);
      });
  if (!drawn) return drawn.error();
  return out;
}

// seen: of the pixels; empty: all.
quality::LevelDifferences means_of(const Values& near, const Values& far, const Values& seen) {
  quality::LevelDifferences sums;
  for (std::size_t i = 0; i < near.size(); ++i) {
    const double share = seen.empty() ? 1 : seen[i / values_a_pixel] / double{unit};
    const double squared = share * share;
    sums.near += squared * near[i] * near[i];
    sums.far += squared * far[i] * far[i];
    sums.product += squared * near[i] * far[i];
  }
  const double times = 1 / (double{unit} * unit * static_cast<double>(near.size()));
  return {sums.near * times, sums.far * times, sums.product * times};
}

}  // namespace

std::optional<protocol::DetailReport> data_drawn(const scene::Scene& scene) {
  if (!scene.wanted_level) return std::nullopt;
  protocol::DetailReport out;
  out.wanted.halvings = *scene.wanted_level;
  out.drawn.halvings = scene.level;
  out.missing_bytes = scene.missing_bytes;
  if (const auto& part = scene.lattice.part) {
    out.drawn.box = std::array{part->box.first, part->box.count};
    if (const auto& grid = part->grid) {
      out.drawn.boxes = protocol::LevelBoxes{grid->size, grid->held};
    }
  }
  return out;
}

bool lacks_detail(const std::optional<protocol::DetailReport>& drawn) {
  if (!drawn) return false;
  for (std::size_t a = 0; a < 3; ++a) {
    if (drawn->drawn.halvings[a] > drawn->wanted.halvings[a]) return true;
  }
  return false;
}

Result<std::vector<scene::Scene>> scenes_to_compare(const scene::CompletedView& completed,
                                                    const scene::Scene& scene,
                                                    data::Dataset& dataset) {
  const auto& levels = dataset.info().stored->levels;
  const std::size_t first = stored_index(scene.level, dataset);
  if (first + compared_levels >= levels.size()) return std::vector<scene::Scene>();
  const bool without_lines = has_all_lines(completed.view(), scene.level);
  const auto shown = completed.with([&](protocol::View& view) {
    if (without_lines) view.vector.field = {protocol::FieldChoice::Kind::none, ""};
  });
  if (!shown) return shown.error();
  std::vector<scene::Scene> out;
  for (std::size_t n = 1; n <= compared_levels; ++n) {
    const Level& level = levels[first + n];
    auto built = scene::build_scene(shown->no_finer_than(level), dataset);
    if (!built) {
      const ErrorKind kind = built.error().kind;
      if (kind == ErrorKind::not_resident || kind == ErrorKind::cancelled) return built.error();
      return std::vector<scene::Scene>();
    }
    if (built->level != level) return std::vector<scene::Scene>();
    out.push_back(std::move(*built));
  }
  return out;
}

Result<std::optional<quality::DetailError>> detail_error(const Prepared& prepared,
                                                         const data::Dataset& dataset,
                                                         ThreadPool& pool,
                                                         const CancelToken& cancel,
                                                         Workspace& workspace) {
  using Known = std::optional<quality::DetailError>;
  if (prepared.compared.empty()) return Known();
  const scene::Scene& scene = prepared.scene;
  const auto held = dataset.reserve(bytes_to_compare(scene.camera));
  if (!held) return Known();
  Values near;
  Values seen;
  if (scene.vector && !prepared.compared.front().vector) {
    auto beside = seen_beside_lines(scene, pool, cancel, workspace);
    if (!beside) return beside.error();
    seen = std::move(*beside);
    scene::Scene media = scene;
    media.vector.reset();
    auto picture = picture_of(media, pool, cancel, workspace);
    if (!picture) return picture.error();
    near = std::move(*picture);
  } else {
    const std::vector<float>& drawn = workspace.space.image().rgba;
    near.resize(drawn.size());
    std::transform(drawn.begin(), drawn.end(), near.begin(), rounded);
  }
  auto far = picture_of(prepared.compared[0], pool, cancel, workspace);
  if (!far) return far.error();
  for (std::size_t i = 0; i < near.size(); ++i) {
    near[i] = static_cast<std::int16_t>((*far)[i] - near[i]);
    (*far)[i] = static_cast<std::int16_t>(-(*far)[i]);
  }
  const auto drawn = each_drawn(prepared.compared[1], pool, cancel, workspace,
                                [&](std::size_t at, std::int16_t value) { (*far)[at] += value; });
  if (!drawn) return drawn.error();
  auto error = quality::detail_error(means_of(near, *far, seen),
                                     static_cast<int>(stored_index(scene.level, dataset)));
  error.halvings = scene.level;
  return Known(error);
}

}  // namespace windsplat::frame
