// Flow and start -> the path that follows it, by the method of J. R. Dormand, P. J. Prince: A
// family of embedded Runge-Kutta formulae, J. Comp. Appl. Math. 6, 1980, of order 5 with an error
// estimate of order 4, and its interpolant of order 4 (E. Hairer, S. P. Norsett, G. Wanner: Solving
// Ordinary Differential Equations I, 1993, section II.6, code DOPRI5). Deterministic; no state.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <vector>

#include "server/trace/flow.hpp"

namespace windsplat::trace {

// Why a path ends.
enum class End : std::uint8_t {
  length,      // it has the length or the time asked for
  boundary,    // of the lattice, or a degenerate cell
  masked,      // a masked cell
  stagnation,  // the flow has no direction, or reverses it within 20 tolerances
  steps        // the maximum number of steps
};
constexpr int end_count = 5;

struct Limits {
  // Bounds the estimated error of each step, in cells. The error of a place on the path is of the
  // order of the number of steps times this, and grows where neighbouring paths diverge.
  double tolerance = 1e-3;
  int steps_max = 10000;           // tried steps
  double duration_max = HUGE_VAL;  // of Place::time, from the start
};

// No step is longer than a cell, so that none crosses a masked cell unseen, nor turns by more than
// a right angle.
constexpr double step_most = 1;
constexpr double step_least = 1e-7;  // cells

// A place on a path.
struct Place {
  glm::dvec3 index{0, 0, 0};
  double time = 0;  // world length over Motion::speed, from the start; negative upstream
};

// One step: the place at start + part step, part in [0, 1], is the polynomial `terms`.
struct Step {
  double start = 0;   // world length from the beginning of the path
  double length = 0;  // of the step, world units
  std::array<glm::dvec4, 5> terms{};
};

struct Path {
  std::vector<Step> steps;
  double length = 0;  // world units; at most that asked for
  End end = End::stagnation;
  int evaluations = 0;  // of the flow
  glm::dvec3 start{0, 0, 0};

  // `from_start` in [0, length], world units. A path without steps has the place of its start.
  [[nodiscard]] Place at(double from_start) const;
};

// Follows the flow from `start` for `length` world units, upstream if asked. Replaces `out`, whose
// storage is reused. A start outside of the domain gives a path without length.
void follow(const Flow& flow, const glm::dvec3& start, double length, bool upstream,
            const Limits& limits, Path& out);

// The path of a particle in a flow that changes, which is at `start` at the time `time`: followed
// for `duration`, back in time if asked. In what it writes, world lengths and times change places:
// Path::length, Step::start and Step::length are times, Place::time is a world length, negative
// back in time. A particle at rest stays where it is until the flow moves it.
void follow_through_time(const Flow& flow, const glm::dvec3& start, double time, double duration,
                         bool back, const Limits& limits, Path& out);

}  // namespace windsplat::trace
