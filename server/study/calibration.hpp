// Subject -> how well the errors that frames are told keep to the truth, at views that nothing was
// measured of.
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

// How pictures of a subject may look: as it is, its lines alone, its medium alone, ten times as
// dense, with lines of a few pixels; those of them that it has.
struct Look {
  std::string name;
  protocol::View view;  // complete
};
std::vector<Look> looks_of(const Subject& subject);

// The view from the n-th place of a fixed sequence: any azimuth, 20 degrees below to 80 above the
// horizon, zoom 0.6 to 4. Errors: those of place_dataset.
Result<protocol::View> seen_from(const protocol::View& view, data::Dataset& dataset,
                                 std::uint64_t n);

struct CalibrationPlan {
  int width = 0;  // of the pictures, pixels
  int height = 0;
  int surveyed = 2;  // views, of each look
  int held_out = 6;
};

// Pictures twice as wide and high as the subject's: smaller settings have few of their own.
CalibrationPlan calibration_plan(const Subject& subject, bool quick);

// One setting at one held-out view.
struct Compared {
  std::size_t look = 0;
  std::size_t view = 0;  // of the look's held-out ones
  std::size_t setting = 0;
  double error = 0;  // true, linear RMSE
  quality::Forecast forecast;
  quality::Forecast prior;  // what would be told if nothing had been surveyed
};

// A frame of a held-out view as the view's own method draws it, and what a finer run said of it.
struct MeasuredFrame {
  std::size_t look = 0;
  bool slab = true;
  double error = 0;  // true
  double measured = 0;
};

// A JPEG of a held-out view.
struct ComparedEncoding {
  std::size_t look = 0;
  int quality = 0;
  bool full_chroma = true;
  double error = 0;     // true, against the picture before its chroma was halved
  double forecast = 0;  // after one JPEG of the look was measured
  double prior = 0;
};

// What quality::pick() chose for an error at held-out views.
struct Aimed {
  double max_error = 0;
  std::size_t frames = 0;
  std::size_t promised = 0;       // whose choice was forecast to keep it
  std::size_t promised_kept = 0;  // and did
  std::size_t possible = 0;       // that some setting keeps it for
  std::size_t possible_kept = 0;  // and what was chosen did
};

// The extrapolated truth of a view against the integral, at the subject's own size.
struct TruthCheck {
  std::size_t look = 0;
  double apart = 0;     // RMS
  double estimate = 0;  // of the extrapolated one's own error
};

struct Calibration {
  CalibrationPlan plan;
  std::vector<std::string> looks;
  std::vector<Compared> compared;
  std::vector<MeasuredFrame> measured;
  std::vector<ComparedEncoding> encodings;
  std::vector<Aimed> aimed;
  std::vector<TruthCheck> checks;
  double seconds = 0;
};

// Surveys some views of each look, as a server does while nobody asks, and compares what it then
// forecasts with the true errors of other views. The truth is extrapolated from slabs of 1/4 and
// 1/8 of a cell, of every sample; `truth`, where it is given, is the integral that checks it, on
// one view of each look. The same each time but for what depends on times. Calls progress(views
// done). Errors: cancelled; those of scenes, surveys, the engine and `truth`.
Result<Calibration> calibrate(const Subject& subject, const CalibrationPlan& plan,
                              const Truth& truth, ThreadPool& pool, const CancelToken& cancel,
                              const std::function<void(int)>& progress);

// Settings that err alike.
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

// Of estimates and the truth. Both count from quality::error_least on.
struct Agreement {
  std::size_t count = 0;
  double within_two = 0;  // share whose estimate is within a factor of 2
  double median = 0;      // of estimate over truth
  double bounded = 0;     // share whose truth is at most the bound that the estimate promises
};

Agreement agreement(const Calibration& calibration,
                    const std::function<bool(const Compared&)>& counts);
Agreement agreement(const Calibration& calibration);
Agreement agreement_of_priors(const Calibration& calibration);
Agreement agreement_of_measured(const Calibration& calibration);
Agreement agreement_of_encodings(const Calibration& calibration);

}  // namespace windsplat::study
