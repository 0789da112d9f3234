// Subjects -> error against run time; each finished point is stored in a folder.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/thread_pool.hpp"
#include "server/study/calibration.hpp"
#include "server/study/extremes/extremes.hpp"
#include "server/study/machine.hpp"
#include "server/study/scenes.hpp"
#include "server/study/stability.hpp"
#include "server/study/sweep.hpp"
#include "server/study/types.hpp"

namespace windsplat::study {

// A picture of the report and its difference from the reference, both as displayed.
struct Shown {
  std::string title;
  std::vector<std::uint8_t> rgb;
  std::vector<std::uint8_t> difference_rgb;  // amplified ten times, in sRGB codes; empty: the
                                             // reference
};

struct SceneReport {
  std::string name;
  protocol::View view;
  int width = 0;
  int height = 0;
  bool integral = true;       // kind of the reference: integral, or extrapolated from slabs
  double truth_estimate = 0;  // RMS of the error of an extrapolated reference itself
  double truth_seconds = 0;   // time to compute the reference; NaN: unknown
  double tolerance = 0;       // tolerance of the integral
  std::int64_t pieces = 0;
  std::int64_t evaluations = 0;
  std::vector<Point> points;
  std::vector<Curve> curves;
  double reconstruction_ripple = 0;  // 0: no medium; NaN: bent lattice or slice
  std::vector<Encoded> encoded;
  std::vector<Shown> pictures;
  std::optional<Calibration> calibration;  // for calibrated subjects
};

struct Report {
  Machine machine;
  bool quick = false;
  int runs = timed_runs;  // timed runs of each point
  double seconds = 0;     // duration of this run
  std::size_t measured = 0;
  std::size_t skipped = 0;  // points of earlier runs
  std::vector<SceneReport> scenes;
  std::vector<Stiffness> stability;
  std::optional<Extremes> extremes;
};

struct Progress {
  std::string scene;
  std::string doing;
  double done = 0;  // fraction of the work of this run, 0..1
};

struct Options {
  std::filesystem::path folder;
  bool quick = false;
  Truth truth;           // empty: the reference is extrapolated from slabs
  double tolerance = 0;  // tolerance of `truth`
  bool calibrate = true;
};

using Listener = std::function<void(const Progress&)>;

// Measures the points that are not yet in the folder. Errors: cancelled (the folder then holds
// every finished point); internal (a reference that is not finite); those of the scenes, the engine
// and the files.
Result<Report> run_study(const std::vector<Subject>& subjects, const Options& options,
                         ThreadPool& pool, const CancelToken& cancel, const Listener& listen);

// A report of extreme cases only (extremes.hpp), for a folder that is made. Errors: those of
// run_extremes(); internal (the folder).
Result<Report> study_extremes(const std::vector<std::string>& group_names,
                              const std::filesystem::path& folder, ThreadPool& pool,
                              const CancelToken& cancel, const GroupListener& listen);

}  // namespace windsplat::study
