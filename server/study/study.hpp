// Subjects -> a report of error against run time, point by point into a folder.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/thread_pool.hpp"
#include "server/study/calibration.hpp"
#include "server/study/machine.hpp"
#include "server/study/scenes.hpp"
#include "server/study/stability.hpp"
#include "server/study/sweep.hpp"
#include "server/study/types.hpp"

namespace windsplat::study {

// A picture of the report and how it differs from the truth, both as they are displayed.
struct Shown {
  std::string title;
  std::vector<std::uint8_t> rgb;
  std::vector<std::uint8_t> difference_rgb;  // ten times the distance in sRGB codes; empty: truth
};

struct SceneReport {
  std::string name;
  protocol::View view;
  int width = 0;
  int height = 0;
  bool integral = true;       // the truth: the integral, or extrapolated from slabs
  double truth_estimate = 0;  // of an extrapolated truth's own error, RMS
  double truth_seconds = 0;   // that it took when it was made; not a number: unknown
  double tolerance = 0;       // of the integral
  std::int64_t pieces = 0;
  std::int64_t evaluations = 0;
  std::vector<Point> points;
  std::vector<Curve> curves;
  double reconstruction_ripple = 0;  // 0: there is no medium; not a number: bent lattice or slice
  std::vector<Encoded> encoded;
  std::vector<Shown> pictures;
  std::optional<Calibration> calibration;  // of subjects that are to be calibrated
};

struct Report {
  Machine machine;
  bool quick = false;
  int runs = timed_runs;  // by the clock, of each point
  double seconds = 0;     // this run alone
  std::size_t measured = 0;
  std::size_t skipped = 0;  // points that the folder held already
  std::vector<SceneReport> scenes;
  std::vector<Stiffness> stability;
};

struct Progress {
  std::string scene;
  std::string doing;
  double done = 0;  // of the work that is left when the study begins, 0..1
};

struct Options {
  std::filesystem::path folder;
  bool quick = false;
  Truth truth;           // empty: extrapolated from slabs
  double tolerance = 0;  // that `truth` is integrated to
  bool calibrate = true;
};

using Listener = std::function<void(const Progress&)>;

// Measures what the folder does not hold yet, and says what it found. Errors: cancelled (the folder
// then holds every point that was finished); internal (a truth that is not finite); those of the
// scenes, the engine and the files.
Result<Report> run_study(const std::vector<Subject>& subjects, const Options& options,
                         ThreadPool& pool, const CancelToken& cancel, const Listener& listen);

}  // namespace windsplat::study
