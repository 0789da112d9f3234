// A pixel of a picture -> the sample that contributes most to its light.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/engine/reference/kernels.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::frame {

// The line of a sample, or its part of one medium; or a segment of a line that is followed through
// the field (a streamlet, or a line through a seed); or a place of an isosurface or section.
struct Picked {
  std::optional<std::size_t> medium;   // the number of the layer in scene.scalars
  std::optional<std::size_t> surface;  // in scene.surfaces; neither: a line
  std::array<int, 3> sample{};  // in scene.lattice; of a segment that nearest to its middle; unset
                                // of surfaces
  engine::reference::Vec place{};  // world units: of the sample; of others the place seen
  // Of the field of the layer; of vectors the magnitude, of a segment that it is drawn with: of a
  // streamlet that of its sample, of a line through a seed that in the middle of the segment. Of a
  // surface the value that colours it there, NaN if it is masked or the surface has one colour.
  double value = 0;
  double share = 0;  // of the pixel's opacity, which includes the body's
  double depth = 0;  // of its light: view depth, world units
  // In the picture, pixels: the middle of the line, or the sample; of a segment the nearest point;
  // of a surface the middle of the pixel.
  std::array<double, 2> at{};
};

// What contributes less to the opacity of a pixel is not seen: half a step of 8 bits.
inline constexpr double picked_least = 1.0 / 512;

// The line, part of a medium or surface that contributes most to the opacity of the pixel that
// contains (x, y): its own opacity times the transmittance before it, along the ray of the pixel's
// middle, by the formulas of method `reference` (an overlapping medium is divided by extinction).
// Nothing if none contributes picked_least. Contours are not picked. The scene is at the level of
// the data. Visits the rows of samples that the ray may meet, on a curved lattice every sample,
// every segment and every triangle. Errors: cancelled.
Result<std::optional<Picked>> pick(const scene::Scene& scene, double x, double y,
                                   const CancelToken& cancel);

}  // namespace windsplat::frame
