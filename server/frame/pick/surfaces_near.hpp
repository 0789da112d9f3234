// A ray -> where it meets the isosurfaces and sections of a scene.
#pragma once

#include <cstddef>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/engine/reference/kernels.hpp"
#include "server/frame/ray_kernels.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::frame {

struct SheetOnRay {
  std::size_t surface = 0;  // its number in scene.surfaces
  double depth = 0;         // view depth, world units
  // Linear between the corners of the triangle; NaN: masked, or the surface has no values.
  double value = 0;
};

// Every sheet of a surface that the ray meets beyond the near plane, once where triangles touch, in
// ascending depth. Visits all triangles. Not all if cancelled.
std::vector<SheetOnRay> sheets_on_ray(const scene::Scene& scene,
                                      const engine::reference::View& view, const PictureRay& ray,
                                      const CancelToken& cancel);

}  // namespace windsplat::frame
