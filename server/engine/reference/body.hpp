// The body of a scene along the ray of a pixel, in double precision.
#pragma once

#include "server/engine/reference/kernels.hpp"
#include "server/engine/reference/ray.hpp"

namespace windsplat::engine::reference {

// The surface at which the ray of the pixel (x, y) enters the body; its opacity is the part of the
// pixel that the body covers, by the distance of its centre from the limb or the edge; 0: not seen.
// At a pixel whose ray passes outside the limb the surface lies at the ray's nearest point to the
// body.
Surface body_surface(const scene::Body& body, const View& view, double x, double y);

}  // namespace windsplat::engine::reference
