// Measurement of errors of pictures: a frame relative to a finer rendering, and a calibration run
// of all settings.
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

// References are drawn from every sample of data with up to this many samples, if these are
// resident; else from the level of the picture, and the errors do not contain those of merging.
inline constexpr double truth_samples_max = 32.0 * 1024 * 1024;

// The viewpoint of a completed view with its scene as asked for; its content is unknown if there is
// no scene or if cancelled.
quality::Viewpoint viewpoint_of(const scene::CompletedView& completed, const scene::Scene* scene,
                                const CancelToken& cancel = {});
// Builds the scene if its data are resident.
quality::Viewpoint viewpoint_of(const scene::CompletedView& completed, const data::Dataset& dataset,
                                const CancelToken& cancel = {});

// Whether the frame will be measured: only pictures of full size, up to retained_pixels.
bool is_measured(const Prepared& prepared);

// Linear RMSE over premultiplied RGBA of the picture in the workspace, which is replaced by the
// differences. The finer rendering uses slabs of half the thickness and of at most half a cell,
// from every sample. The error of slabs is of order 2 in their thickness, so it is r^2 / (r^2 - 1)
// of the difference, r being the ratio of the thicknesses; for other pictures it is the difference.
// Empty if the finer rendering is not possible: merged data of which not every sample is resident,
// or with more than four times the samples drawn, or more slabs than the engine draws. Reads no
// file. `keep`: the picture is kept, as that of every format but JPEG is. Errors: those of the
// engine.
Result<std::optional<double>> measured_error(const Prepared& prepared, data::Dataset& dataset,
                                             ThreadPool& pool, const CancelToken& cancel,
                                             Workspace& workspace, bool keep = false);

// Whether drawing every line and splat is expected to take no longer than measuring the error, from
// the counts of the picture, which depend on nothing else: few kernel positions, or few of them
// left out.
bool is_change_measured(const scene::Scene& scene, const engine::WorkReport& work);

// The change of the picture by the lines and splats that its tolerances leave out: mean over pixels
// of the channel of linear premultiplied RGBA that changes most. The picture in the workspace is
// compared with that of the same scene with every line and splat, drawn by the same method, so that
// the value is exact but for rounding (1e-7 for each update of a pixel). Errors: those of the
// engine.
Result<double> measured_skipped_change(const Prepared& prepared, ThreadPool& pool,
                                       const CancelToken& cancel, Workspace& workspace);

// Draws the view at every setting allowed for it and compares each picture with the reference,
// which is extrapolated from slabs of half and a quarter of the thickness of the view, and of at
// most half and a quarter of a cell; where these would be more slabs than the engine draws, only
// times are measured. Reports each result when it is known, in no particular order. Pictures of
// more than retained_pixels are calibrated at a smaller size, that of `viewpoint`. Times are those
// of drawing only. `content`: of the view, if it is known. Errors: cancelled; not_resident; those
// of scenes.
struct CalibrationSample {
  std::size_t setting = 0;
  quality::Viewpoint viewpoint;
  quality::Measured measured;
};
// Memory of the reference and of the picture compared with it.
inline std::uint64_t calibration_bytes(const protocol::ImageView& image) {
  const auto pixels = static_cast<std::uint64_t>(image.width) * image.height;
  return std::min<std::uint64_t>(pixels, retained_pixels) * 2 * 4 * sizeof(float);
}
inline bool is_worth_calibrating(const protocol::View& view) {  // thumbnails are not calibrated
  return std::min(view.image.width, view.image.height) >= 64;
}
//
// load_for_calibration reads the data of every setting, as far as memory allows: smaller pictures
// and coarser settings show data of other levels of detail. Settings whose data are not resident
// are left out, except the view's own. Errors: cancelled; those of the data of the own setting.
Result<void> load_for_calibration(const scene::CompletedView& completed, data::Dataset& dataset,
                                  const CancelToken& cancel);
Result<void> calibrate(const scene::CompletedView& completed, data::Dataset& dataset,
                       ThreadPool& pool, const CancelToken& cancel, Workspace& workspace,
                       const std::function<void(const CalibrationSample&)>& report,
                       const std::optional<quality::Content>& content = {});

}  // namespace windsplat::frame
