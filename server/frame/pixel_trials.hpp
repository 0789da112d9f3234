// Some pixels of a picture: their errors, composited in the order of method `kernel` and in slabs,
// against the exact order by depth; and their change by what tolerances leave out.
#pragma once

#include <cstddef>
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
inline constexpr double place_work_most = 1e6;    // of one place
inline constexpr double skipped_work_most = 2e6;  // for the change by what tolerances leave out

struct PixelTrials {
  std::optional<quality::Trials> trials;  // empty: too few places could be tried, or cancelled
  int places = 0;                         // that drew something
  double work = 0;
  std::size_t grounds = 0;  // rays whose meeting with the body was computed
  // Mean over the picture of the channel of linear premultiplied RGBA that changes most; empty: too
  // few places could be tried, or streamlets are left out, which nothing has traced. 0 without
  // trying if the tolerances are 0.
  std::optional<double> skipped_change;
};

// The scene with every line and splat.
scene::Scene without_tolerances(scene::Scene scene);

// `through`: samples that the picture shows.
PixelTrials pixel_trials(const scene::Scene& scene, const std::vector<RayThrough>& through,
                         const CancelToken& cancel = {});

}  // namespace windsplat::frame
