// Subject -> accuracy of the errors reported with frames, at views that were not calibrated.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/thread_pool.hpp"
#include "server/quality/table.hpp"
#include "server/study/scenes.hpp"
#include "server/study/types.hpp"

namespace windsplat::study {

// Variants of a subject, as far as they apply: unchanged, lines only, medium only, ten times as
// dense, lines of a few pixels.
struct Variant {
  std::string name;
  protocol::View view;  // complete
};
std::vector<Variant> variants_of(const Subject& subject);

// The view from the n-th viewpoint of a fixed sequence: any azimuth, 20 degrees below to 80 above
// the horizon, zoom 0.6 to 4. Errors: those of place_dataset().
Result<protocol::View> seen_from(const protocol::View& view, data::Dataset& dataset,
                                 std::uint64_t n);

struct CalibrationPlan {
  int width = 0;  // size of the pictures, pixels
  int height = 0;
  int calibrated = 2;  // calibrated views of each variant
  int held_out = 6;
};

// Pictures are twice as wide and high as those of the subject, so that settings with fewer pixels
// have enough.
CalibrationPlan calibration_plan(const Subject& subject, bool quick);

// Result of one setting at one held-out view.
struct Compared {
  std::size_t variant = 0;
  std::size_t view = 0;  // index of a held-out view of the variant
  std::size_t setting = 0;
  double error = 0;  // true error, linear RMSE
  quality::Forecast forecast;
  quality::Forecast prior;  // forecast without calibration
};

// A frame of a held-out view, rendered with the view's own method, with its error measured relative
// to a finer rendering.
struct MeasuredFrame {
  std::size_t variant = 0;
  bool slab = true;
  double error = 0;  // true error
  double measured = 0;
};

// A JPEG of a held-out view.
struct ComparedEncoding {
  std::size_t variant = 0;
  int quality = 0;
  bool full_chroma = true;
  double error = 0;     // true error, relative to the picture with full chroma
  double forecast = 0;  // forecast after one JPEG of the variant was measured
  double prior = 0;
};

// Settings that quality::pick() chose for a maximum error at held-out views.
struct Aimed {
  double max_error = 0;
  std::size_t frames = 0;
  std::size_t promised = 0;       // number of chosen settings forecast to meet the error
  std::size_t promised_kept = 0;  // of these, number that met it
  std::size_t possible = 0;       // number of views for which any setting meets it
  std::size_t possible_kept = 0;  // of these, number for which the chosen one met it
};

// The extrapolated reference of a view compared with the integral, at the size of the subject.
struct TruthCheck {
  std::size_t variant = 0;
  double apart = 0;     // RMS
  double estimate = 0;  // estimated error of the extrapolated reference
};

struct Calibration {
  CalibrationPlan plan;
  std::vector<std::string> variants;
  std::vector<Compared> compared;
  std::vector<MeasuredFrame> measured;
  std::vector<ComparedEncoding> encodings;
  std::vector<Aimed> aimed;
  std::vector<TruthCheck> checks;
  double seconds = 0;
};

// Calibrates some views of each variant, as the server does while idle, and compares the resulting
// forecasts with the true errors of other views. True errors are relative to a reference
// extrapolated from slabs of 1/4 and 1/8 of a cell, from every sample; `truth`, if given, is the
// integral by which one view of each variant is verified. Deterministic except for what depends on
// times. Calls progress(views done). Errors: cancelled; those of scenes, calibration, the engine
// and `truth`.
Result<Calibration> calibrate(const Subject& subject, const CalibrationPlan& plan,
                              const Truth& truth, ThreadPool& pool, const CancelToken& cancel,
                              const std::function<void(int)>& progress);

// Settings whose errors have the same cause.
enum class SettingClass {
  kernel,
  kernel_smaller,
  kernel_coarser,
  slab,
  slab_smaller,
  slab_coarser
};
inline constexpr std::array<SettingClass, 6> setting_classes{
    SettingClass::kernel, SettingClass::kernel_smaller, SettingClass::kernel_coarser,
    SettingClass::slab,   SettingClass::slab_smaller,   SettingClass::slab_coarser};
SettingClass class_of(const quality::Setting& setting);
const char* name_of(SettingClass kind);

// Agreement of estimates with true errors. Errors below quality::error_least count as that value.
struct Agreement {
  std::size_t count = 0;
  double within_two = 0;  // fraction whose estimate is within a factor of 2
  double median = 0;      // median of estimate over true error
  double bounded = 0;     // fraction whose true error is at most the predicted bound
};

Agreement agreement(const Calibration& calibration,
                    const std::function<bool(const Compared&)>& counts);
Agreement agreement(const Calibration& calibration);
Agreement agreement_of_priors(const Calibration& calibration);
Agreement agreement_of_measured(const Calibration& calibration);
Agreement agreement_of_encodings(const Calibration& calibration);

}  // namespace windsplat::study
