// The report of `windsplat study` as typed values -> study.json. Numbers that are not finite become
// null.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "protocol/view.hpp"

namespace windsplat::protocol {

struct StudyPoint {
  std::string method;
  std::string compositing;
  std::vector<std::pair<std::string, double>> knobs;  // named as in the view
  double rmse = 0, max = 0, psnr = 0, flip = 0;
  double ms = 0, ms_min = 0, ms_max = 0;
  bool pareto = false;
  bool stable = true;
};

struct StudyCurve {
  std::string method;
  std::string compositing;
  std::string knob;
  double order = 0;                 // null below three stable points
  std::vector<std::size_t> points;  // indices into the points of the scene, ordered by the knob
};

struct StudyEncoding {
  int quality = 0;
  double rmse = 0, psnr = 0, flip = 0;
  std::size_t bytes = 0;
};

struct StudyReference {
  std::string kind;      // "integral", or "extrapolated" from method slab
  double estimate = 0;   // RMS error of an extrapolated reference
  double seconds = 0;    // rendering time; null: unknown
  double tolerance = 0;  // null: not an integral
  int width = 0, height = 0;
  std::int64_t pieces = 0, evaluations = 0;
};

// Agreement of reported and true errors: fractions within a factor of 2, and within the bound.
struct StudyAgreement {
  std::string of;
  std::size_t count = 0;
  double within_two = 0, median = 0, bounded = 0;
};

// Results of choosing settings for one error limit.
struct StudyAim {
  double max_error = 0;
  std::size_t frames = 0;
  std::size_t promised = 0, promised_kept = 0;  // forecast to satisfy it; of these, did
  std::size_t possible = 0, possible_kept = 0;  // some setting satisfies it; chosen one did
};

// One setting at one held-out view.
struct StudyCompared {
  std::string look;
  std::size_t view = 0;
  std::string method;
  int half_level = 0, coarser = 0, thinner = 1;
  double error = 0;  // true
  double estimate = 0, spread = 0, prior = 0;
};

// Comparison of the extrapolated reference with the integral.
struct StudyCheck {
  std::string look;
  double apart = 0, estimate = 0;
};

struct StudyCalibration {
  int width = 0, height = 0;
  int surveyed = 0, held_out = 0;  // views per look for calibration and for testing
  double seconds = 0;
  std::vector<std::string> looks;
  std::vector<StudyAgreement> agreement;
  std::vector<StudyAim> aims;
  std::vector<StudyCheck> checks;
  std::vector<StudyCompared> points;
};

struct StudyScene {
  std::string name;
  View view;
  StudyReference reference;
  std::vector<StudyPoint> points;
  std::vector<StudyCurve> curves;
  double reconstruction_ripple = 0;  // null: curved lattice or slice
  std::vector<StudyEncoding> jpeg;
  std::optional<StudyCalibration> calibration;
};

struct StudyStability {
  std::string compositing;
  double tau = 0;
  double error = 0, min = 0, max = 0;
  bool bounded = true, monotone = true;
  double layers_min = 0, layers_max = 0;
  bool diverges = false;
};

struct StudyDocument {
  std::string processor, system, compiler, version, kernels;
  unsigned hardware_threads = 0, threads = 0;
  bool quick = false;
  double seconds = 0;
  int runs = 0;  // timed runs per point
  std::size_t measured = 0, skipped = 0;
  std::vector<StudyScene> scenes;
  std::vector<StudyStability> stability;
};

// Indented by two spaces.
std::string encode_study(const StudyDocument& study);

}  // namespace windsplat::protocol
