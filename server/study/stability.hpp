// The stiffness sweep: one kernel with a line through its medium, rendered by the engine over the
// whole range of optical depths.
#pragma once

#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/thread_pool.hpp"
#include "server/study/types.hpp"

namespace windsplat::study {

// 1e-30 .. 1e30; the last value is the largest, since extinctions of a view are bounded by 1e30 per
// world unit. As a float its transmittance equals that of infinity.
const std::vector<double>& stiffness();

struct Stiffness {
  scene::Compositing compositing = scene::Compositing::analytic;
  double tau = 0;
  double error = 0;  // largest of any channel and line depth, relative to the exact kernel
  double min = 0;    // over channels and line depths
  double max = 0;
  bool bounded = true;    // within [0, 1] except for 1e-3
  bool monotone = true;   // alpha is at least that at the next smaller tau, at every depth of the
                          // line
  double layers_min = 0;  // for stiff_layers cells one behind the other, without a line
  double layers_max = 0;
  bool diverges = false;  // the layers do not reduce the excess of one cell over [0, 1]
};

inline constexpr int stiff_layers = 17;  // odd: an even number of sign changes cancels

// Every compositing operator of method kernel at every optical depth of stiffness(). Exact for one
// kernel (medium c_s, line c_v of opacity a at the fraction x of the cell's depth):
// A = -expm1(-tau) + a exp(-tau), I = c_s A + a exp(-tau x) (c_v - c_s).
Result<std::vector<Stiffness>> stiffness_sweep(ThreadPool& pool, const CancelToken& cancel);

}  // namespace windsplat::study
