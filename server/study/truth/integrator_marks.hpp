// The part of a pixel that a line with a mark covers, for the brute-force integral
// (integrator.hpp).
#pragma once

#include "server/study/truth/integrator_kernels.hpp"

namespace windsplat::truth {

// Of the opacity of the line: where it has light, and with its halo.
struct MarkShare {
  Real lit = 0;
  Real with_halo = 0;
};

// u: from the tail to the head on the screen; p: the pixel from the tail; w: the nearest position
// along the line, from 0 to 1.
MarkShare mark_share(const scene::VectorLayer& layer, const Vec& u, const Vec& p, Real w);

}  // namespace windsplat::truth
