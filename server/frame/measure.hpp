// The error of pictures: a frame against a finer run of itself, and a calibration run of all
// settings.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>

#include "server/base/trim_storage.hpp"
#include "server/frame/frame.hpp"
#include "server/quality/table.hpp"
#include "server/scene/completed_view.hpp"

namespace windsplat::frame {

// Truths are drawn from every sample of data up to this many samples, and of larger data from the
// level that the picture is drawn from.
inline constexpr double truth_samples_max = 32.0 * 1024 * 1024;

// The viewpoint of a completed view.
quality::Viewpoint viewpoint_of(const scene::CompletedView& completed);

// Whether the frame will be measured: pictures of full size alone, up to retained_pixels.
bool is_measured(const Prepared& prepared);

// Linear RMSE over premultiplied RGBA of the workspace's picture, of which the differences are
// left. The finer run is by slabs of half the thickness, of every sample. Slabs err by order 2 in
// their thickness, so by 4/3 of the difference; other pictures by the difference. Empty where the
// finer run is not to be had: averaged data of which not every sample is resident, or which has
// more than four times the samples drawn. Reads no file. Errors: those of the engine.
Result<std::optional<double>> measured_error(const Prepared& prepared, data::Dataset& dataset,
                                             ThreadPool& pool, const CancelToken& cancel,
                                             Workspace& workspace);

// Draws the view at every setting that is allowed for it and compares each with the truth: slabs of
// half and a quarter of the view's thickness, extrapolated. Reports each when it is known, in
// no particular order. Pictures of more than retained_pixels are calibrated smaller;
// `viewpoint` has their size. Times are of drawing alone. Errors: cancelled; not_resident; those
// of scenes.
struct CalibrationSample {
  std::size_t setting = 0;
  quality::Viewpoint viewpoint;
  quality::Measured measured;
};
// Memory of the truth and of the picture that is compared with it.
inline std::uint64_t calibration_bytes(const protocol::ImageView& image) {
  const auto pixels = static_cast<std::uint64_t>(image.width) * image.height;
  return std::min<std::uint64_t>(pixels, retained_pixels) * 2 * 4 * sizeof(float);
}
inline bool is_worth_calibrating(const protocol::View& view) {  // not for thumbnails
  return std::min(view.image.width, view.image.height) >= 64;
}
Result<void> calibrate(const scene::CompletedView& completed, data::Dataset& dataset,
                       ThreadPool& pool, const CancelToken& cancel, Workspace& workspace,
                       const std::function<void(const CalibrationSample&)>& report);

}  // namespace windsplat::frame
