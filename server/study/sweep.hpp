// A subject -> the settings to measure and the curves they form; a setting -> what it costs and
// errs.
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
inline constexpr int quick_runs = 3;        // of a quick study
inline constexpr double unit_slack = 1e-3;  // how far beyond [0, 1] a stable picture may go

struct Sweep {
  std::vector<Setting> settings;  // no two alike
  std::vector<Curve> curves;      // points are indices of settings
};

// Method kernel and method slab, each with every compositing, over its knobs; without lines no
// span, without a medium one compositing (they are the same picture). `quick`: fewer of each.
Sweep plan_sweep(const Subject& subject, bool quick);

// The setting's picture once, at its own size. Errors: those of scene_at and the engine.
Result<engine::Image> draw(const Subject& subject, const Setting& setting, ThreadPool& pool,
                           const CancelToken& cancel);

// Draws the setting once to warm up and `runs` times by the clock, and compares the picture,
// brought to the truth's size, with the truth.
Result<Measurement> measure(const Subject& subject, const Setting& setting, const Picture& truth,
                            ThreadPool& pool, const CancelToken& cancel, int runs = timed_runs);

// The picture as it is displayed: 8-bit sRGB over the background.
std::vector<std::uint8_t> displayed(std::span<const float> rgba, int width, int height,
                                    const std::array<float, 3>& background);
std::vector<float> to_floats(const Picture& picture);

// The truth of the subject where no integral is at hand: slabs of thickness 1/4 and 1/8 with their
// error's leading term removed, I + (I_1/8 - I_1/4) / 3. `estimate` is the RMS of that term.
struct Extrapolated {
  Picture picture;
  double estimate = 0;
};
Result<Extrapolated> extrapolate(const Subject& subject, ThreadPool& pool,
                                 const CancelToken& cancel);

// RMSE over RGBA of a uniform white medium, optical depth 1 through the middle, on the subject's
// lattice in the subject's direction, against -expm1(-rho L): what overlapping footprints ripple.
// Not in the errors against the integral, which is of the same footprints, and so no floor of them.
// Not a number for a bent lattice and a slice: neither is a box with an even medium.
Result<double> reconstruction_ripple(const Subject& subject, ThreadPool& pool,
                                     const CancelToken& cancel);

// An encoding's own error, in linear light and by FLIP, of the subject's picture.
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
