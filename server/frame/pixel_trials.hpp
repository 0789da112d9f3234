// Errors of some pixels of a picture: composited in the order of method `kernel` and in slabs,
// against the exact order by depth.
#pragma once

#include <optional>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/frame/light_changes.hpp"
#include "server/quality/content.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::frame {

// Limits on what is tried: places that draw something, and positions of the lattice visited plus
// kernels met by each ray, after which no other place is tried.
inline constexpr int trial_places_most = 512;
inline constexpr double trial_work_most = 4e6;
inline constexpr double place_work_most = 1e6;  // of one place

struct PixelTrials {
  std::optional<quality::Trials> trials;  // empty: too few places could be tried, or cancelled
  int places = 0;                         // that drew something
  double work = 0;
};
// `through`: samples that the picture shows.
PixelTrials pixel_trials(const scene::Scene& scene, const std::vector<RayThrough>& through,
                         const CancelToken& cancel = {});

}  // namespace windsplat::frame
