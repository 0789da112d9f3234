// A picture and its truth -> a verdict; the verdicts of a sweep -> the values at which a method can
// be trusted.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/base/error.hpp"

namespace windsplat::study {

// What a picture is compared with. integrator: the brute-force integral of server/study/truth,
// which shares no code with the engine. reference: the engine's reference, where the integrator
// does not apply (an opaque body, curved lattices of a single layer). closed_form: nothing is
// visible.
enum class TruthKind { integrator, reference, closed_form };
const char* name_of(TruthKind kind);

inline constexpr double rounding = 1e-5;  // permitted excess over [0, 1]
// Errors below this are not held against a reported error.
inline constexpr double honest_from = 1e-4;
inline constexpr double honest_share = 0.25;  // of the true error, at least
// The RMS errors for which ranges of trust are stated.
inline constexpr std::array<double, 2> trust_limits{1e-3, 1e-2};

// A picture in linear premultiplied RGBA, 4 values per pixel.
struct Observed {
  std::span<const float> rgba;
  std::span<const std::size_t> pixels;  // those with a truth
  std::span<const double> truth;        // RGBA of each of them; empty: not compared
  std::optional<double> reported;       // measured for the frame, else the bound of its estimate
};

struct Verdict {
  bool finite = true;
  bool bounded = true;           // every channel within [0, 1]
  bool honest = true;            // the reported error is not below a quarter of the true one
  std::optional<bool> monotone;  // of a sweep in which opacity must not decrease
  double rmse = std::numeric_limits<double>::quiet_NaN();  // against the truth; NaN: not compared
  double max = std::numeric_limits<double>::quiet_NaN();
  [[nodiscard]] bool good() const { return finite && bounded && honest && monotone.value_or(true); }
};
Verdict judge(const Observed& observed);

// Whether no opacity is less than before. `slack`: what early termination may leave out. Pictures
// of RGBA of the same size.
bool is_monotone(std::span<const float> before, std::span<const float> after, double slack);

struct CaseResult {
  std::string group;
  std::string label;  // of the value
  double value = 0;   // NaN: not a number
  std::string method, projection, mapping;
  std::array<int, 3> samples{};
  int width = 0, height = 0;
  bool refused = false;  // by design: by an error that names its limit
  std::string message;   // why it was refused, or why it could not be drawn
  TruthKind truth = TruthKind::integrator;
  Verdict verdict;
  std::optional<double> measured;
  // Without calibration, and the bound that 95 % of errors should meet; NaN: none.
  double estimate = std::numeric_limits<double>::quiet_NaN();
  double bound = std::numeric_limits<double>::quiet_NaN();

  // Neither drawn without fault nor refused by design.
  [[nodiscard]] bool failed() const { return !refused && (!message.empty() || !verdict.good()); }
};

// Sets `refused` and `message` of a case that was drawn or not. by_design: what the error of a case
// beyond a limit names; empty: the case must be drawn.
void judge_refusal(const std::string& by_design, const Result<void>& drawn, CaseResult& result);

const char* outcome_of(const CaseResult& one);  // "good", "failed" or "refused"

// Of one method in the sweep of a group, over all projections.
struct Trust {
  std::string group;
  std::string method;
  std::size_t cases = 0, refused = 0, failed = 0;
  double worst = 0;          // largest RMS error; NaN: none was compared
  std::string worst_at;      // its value
  std::size_t measured = 0;  // compared cases with a measured error
  // The smallest measured error over the true one, where that exceeds honest_from; NaN: nowhere.
  double least_reported = 0;
  std::size_t estimated = 0, within_bound = 0;  // compared cases with an estimate; those within it
  // For each of trust_limits the values whose every case is without fault and within the limit:
  // "all" (except those refused or not compared), "none", ranges "1e-30 to 10", names, or "all but"
  // names.
  std::array<std::string, trust_limits.size()> within;
};
// In the order of the cases.
std::vector<Trust> trust_of(const std::vector<CaseResult>& cases);

}  // namespace windsplat::study
