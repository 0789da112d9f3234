// A subject -> the settings to measure and their curves; a setting -> its run time and error.
#pragma once

#include <span>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/thread_pool.hpp"
#include "server/engine/render.hpp"
#include "server/study/scenes.hpp"
#include "server/study/types.hpp"

namespace windsplat::study {

inline constexpr int timed_runs = 9;
inline constexpr int quick_runs = 3;        // runs of a quick study
inline constexpr double unit_slack = 1e-3;  // allowed excess of a stable picture over [0, 1]

struct Sweep {
  std::vector<Setting> settings;  // unique
  std::vector<Curve> curves;      // points are indices of settings
};

// Method kernel and method slab, each with every compositing operator, over their parameters;
// without lines no span, without a medium one operator (all yield the same picture). `quick`: fewer
// of each.
Sweep plan_sweep(const Subject& subject, bool quick);

// One rendering of the setting, at its own size. Errors: those of scene_at() and the engine.
Result<engine::Image> draw(const Subject& subject, const Setting& setting, ThreadPool& pool,
                           const CancelToken& cancel);

// Renders the setting once to warm up and `runs` times timed, and compares the picture, resampled
// to the size of the reference, with it.
Result<Measurement> measure(const Subject& subject, const Setting& setting, const Picture& truth,
                            ThreadPool& pool, const CancelToken& cancel, int runs = timed_runs);

// The picture as it is displayed: 8-bit sRGB over the background.
std::vector<std::uint8_t> displayed(std::span<const float> rgba, int width, int height,
                                    const std::array<float, 3>& background);
std::vector<float> to_floats(const Picture& picture);

// The reference of the subject without an integral: slabs of thickness 1/4 and 1/8 with the leading
// term of their error removed, I + (I_1/8 - I_1/4) / 3. `estimate` is the RMS of that term.
struct Extrapolated {
  Picture picture;
  double estimate = 0;
};
Result<Extrapolated> extrapolate(const Subject& subject, ThreadPool& pool,
                                 const CancelToken& cancel);

// RMSE over RGBA of a uniform white medium, of optical depth 1 through the middle, on the lattice
// of the subject and from its view direction, relative to -expm1(-rho L): the ripple of overlapping
// footprints. It is not part of the errors relative to the integral, which has the same footprints,
// nor a lower bound on them. NaN for a bent lattice and for a slice, which are not boxes with a
// uniform medium.
Result<double> reconstruction_ripple(const Subject& subject, ThreadPool& pool,
                                     const CancelToken& cancel);

// The error of the encoding only, in linear light and by FLIP, of the picture of the subject.
struct Encoded {
  int quality = 0;
  double rmse = 0;
  double psnr = 0;
  double flip = 0;
  std::size_t bytes = 0;
};
Result<std::vector<Encoded>> measure_encoding(const Subject& subject, ThreadPool& pool,
                                              const CancelToken& cancel);

}  // namespace windsplat::study
