// What was computed and is held for each part that a view may add to lines and clouds.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "server/annotate/figure.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::frame {

// streamlets: through the samples; seeds: lines through seeds.
enum class ScenePart {
  ground,
  surfaces,
  streamlets,
  seeds,
  light,
  region,
  difference,
  annotations
};
constexpr std::size_t parts_count = 8;

// Of an absent part both numbers are 0.
struct PartCount {
  bool shown = false;
  // ground: pixels for which it is searched; surfaces: triangles; streamlets, seeds: straight
  // pieces; light: samples and other points with a factor of their own; region: samples of the data
  // outside of its ranges and polygons, which are neither loaded into the scene nor drawn;
  // difference: values that were subtracted; annotations: lines, areas, colour strips and texts.
  std::int64_t count = 0;
  // ground: see parts_of(); surfaces: triangles and vertices; streamlets, seeds: vertices; light:
  // factors; region, difference: the fields that are drawn instead of those of the data, which are
  // the same for both; annotations: pixels.
  std::int64_t bytes = 0;
};
using PartCounts = std::array<PartCount, parts_count>;  // by ScenePart

// figure: of the picture; null: without annotations. ground_bytes: of the grounds that are kept for
// this and earlier pictures, counted with the lines of the Earth if this picture has a ground.
PartCounts parts_of(const scene::CompletedView& completed, const scene::Scene& scene,
                    const annotate::Figure* figure, std::size_t ground_bytes);

}  // namespace windsplat::frame
