// A ray -> the kernel positions whose lines or splats it may meet.
#pragma once

#include <functional>

#include "server/base/cancel.hpp"
#include "server/engine/reference/kernels.hpp"
#include "server/frame/ray_kernels.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::frame {

// Calls visit() for every position of the layers that lies within the reach of its kernels of the
// ray, and for some others, in the order of the samples. False: cancelled.
bool visit_near(const scene::Scene& scene, const engine::reference::View& view,
                const engine::reference::LayerGroup& layers, const PictureRay& ray,
                const CancelToken& cancel,
                const std::function<void(const engine::reference::KernelPosition&)>& visit);

}  // namespace windsplat::frame
