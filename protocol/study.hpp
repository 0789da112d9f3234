// A study's report as typed values -> JSON of study.schema.json. Numbers that are not finite become
// null.
#pragma once

#include <array>
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
  bool own = false;  // the settings of the scene's view
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

// Reported against true errors: fractions within a factor of 2, and within the predicted bound.
struct StudyAgreement {
  std::string of;
  std::size_t count = 0;
  double within_two = 0, median = 0, bounded = 0;
};

// Held-out frames whose setting was chosen to meet a requested maximum error.
struct StudyAim {
  double max_error = 0;
  std::size_t frames = 0;
  std::size_t promised = 0, promised_kept = 0;  // forecast to meet it; actually met it
  std::size_t possible = 0, possible_kept = 0;  // any setting meets it; the chosen one does
};

// Result of one setting at one held-out view.
struct StudyCompared {
  std::string look;
  std::size_t view = 0;
  std::string setting_class;  // as in the agreement
  std::string method;
  int half_level = 0, coarser = 0, thinner = 1;
  double error = 0;  // true error
  double estimate = 0, spread = 0, prior = 0;
};

// A frame of a held-out view, with its error measured relative to a finer rendering.
struct StudyMeasuredFrame {
  std::string look;
  std::string method;
  double error = 0;  // true error
  double measured = 0;
};

// The extrapolated reference against the integral.
struct StudyCheck {
  std::string look;
  double apart = 0, estimate = 0;
};

struct StudyCalibration {
  int width = 0, height = 0;
  int surveyed = 0, held_out = 0;  // number of views per scene for calibration and for testing
  double seconds = 0;
  std::vector<std::string> looks;
  std::vector<StudyAgreement> agreement;
  std::vector<StudyAim> aims;
  std::vector<StudyCheck> checks;
  std::vector<StudyCompared> points;
  std::vector<StudyMeasuredFrame> measured;
};

// A picture and its amplified difference from the reference, as base64 PNG.
struct StudyPicture {
  std::string title;
  std::string png;
  std::string difference_png;  // empty: the reference itself
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
  std::vector<StudyPicture> pictures;
};

struct StudyStability {
  std::string compositing;
  double tau = 0;
  double error = 0, min = 0, max = 0;
  bool bounded = true, monotone = true;
  double layers_min = 0, layers_max = 0;
  bool diverges = false;
};

// A stiff or extreme case drawn by one method.
struct StudyExtreme {
  std::string group, label;
  double value = 0;  // null: not a number
  std::string method, projection, mapping;
  std::array<int, 3> samples{};
  int width = 0, height = 0;
  std::string outcome;  // "good", "failed" or "refused"
  std::string message;  // empty: none
  std::string truth;    // empty: none
  bool finite = true, bounded = true, honest = true;
  std::optional<bool> monotone;
  double rmse = 0, max = 0;           // null: not compared
  double measured = 0, estimate = 0;  // null: none
  double bound = 0;
};

// The values of a parameter at which a method may be trusted.
struct StudyTrust {
  std::string group, parameter, method;
  std::size_t cases = 0, refused = 0, failed = 0;
  double worst = 0;
  std::string worst_at;
  std::size_t measured = 0;
  double least_reported = 0;
  std::size_t estimated = 0, within_bound = 0;
  std::vector<std::pair<double, std::string>> within;  // limit of the error, values
};

struct StudyExtremes {
  std::vector<StudyExtreme> cases;
  std::vector<StudyTrust> trust;
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
  int stability_layers = 0;  // cells of `layers_min` and `layers_max`
  std::optional<StudyExtremes> extremes;
};

// Indented by two for human readers; `compact`: one line.
std::string encode_study(const StudyDocument& study, bool compact = false);

}  // namespace windsplat::protocol
