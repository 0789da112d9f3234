// Scene -> the picture that every method is measured against: the volume rendering integral itself,
// pixel by pixel, in double precision. Slow and plain; pure, and the same for any number of
// threads.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/base/thread_pool.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::engine::reference {

struct Options {
  double tolerance = 1e-10;  // absolute error of a pixel's premultiplied colour that is aimed at
};

struct Picture {
  int width = 0;
  int height = 0;
  std::vector<double> rgba;      // linear premultiplied, row 0 on top
  std::int64_t pieces = 0;       // that rays were cut into
  std::int64_t evaluations = 0;  // of the medium at a place of a ray
};

// The medium is rho(x) = sum_i rho_i K(|A_i^-1 (x - x_i)|) / C, A_i with a cell's edges as columns,
// and likewise its emission; the lines are sheets at their depth. No tolerance leaves anything out
// (min_magnitude says which lines there are), and Compositing does not matter. In perspective a
// splat whose centre is nearer than camera.near is not there, and rays begin at camera.near.
//
// progress (may be empty) is called with the rows done so far, from any worker. Errors: cancelled.
Result<Picture> render(const scene::Scene& scene, ThreadPool& pool, const CancelToken& cancel,
                       const Options& options = {}, const std::function<void(int)>& progress = {});

// K(r), r in cells: the 3-D kernel whose integral along a line at distance r from its middle is the
// splat's footprint g(r) (its inverse Abel transform). K >= 0, and 0 from r = 1.37 on.
double kernel_3d(double r);

}  // namespace windsplat::engine::reference
