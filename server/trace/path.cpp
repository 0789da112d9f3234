// Steps of Dormand and Prince along a flow, with control of their length.
#include "server/trace/path.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace windsplat::trace {

namespace {

using glm::dvec3;
using glm::dvec4;

constexpr int stages = 7;

// The coefficients of the method (table 5.2 of Hairer, Norsett, Wanner) and of its interpolant.
constexpr double weights[stages][stages - 1] = {
    {},
    {1.0 / 5},
    {3.0 / 40, 9.0 / 40},
    {44.0 / 45, -56.0 / 15, 32.0 / 9},
    {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
    {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
    {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84}};
constexpr double errors[stages] = {71.0 / 57600,      0,          -71.0 / 16695, 71.0 / 1920,
                                   -17253.0 / 339200, 22.0 / 525, -1.0 / 40};
constexpr double dense[stages] = {-12715105075.0 / 11282082432.0,  0,
                                  87487479700.0 / 32700410799.0,   -10690763975.0 / 1880347072.0,
                                  701980252875.0 / 199316789632.0, -1453857185.0 / 822651844.0,
                                  69997945.0 / 29380423.0};

dvec3 index_of(const dvec4& state) { return {state.x, state.y, state.z}; }

// The largest change of an index.
double widest(const dvec4& change) {
  return std::max({std::abs(change.x), std::abs(change.y), std::abs(change.z)});
}

dvec4 place_in(const Step& step, double part) {
  const double rest = 1 - part;
  const auto& t = step.terms;
  return t[0] + part * (t[1] + rest * (t[2] + part * (t[3] + rest * t[4])));
}

// Where each stage is within a step.
constexpr double nodes[stages] = {0, 1.0 / 5, 3.0 / 10, 4.0 / 5, 8.0 / 9, 1, 1};

// When a particle passes: at `start` of the path at `time`, and back in time if `sign` is negative.
struct Clock {
  bool runs = false;  // false: the field does not change, and the path goes by world length
  double time = 0;
};

class Follower {
 public:
  Follower(const Flow& flow, double length, bool upstream, const Limits& limits, Path& out,
           const Clock& clock = {})
      : flow_(flow),
        length_(length),
        sign_(upstream ? -1 : 1),
        limits_(limits),
        clock_(clock),
        out_(out) {}

  void run() {
    if (!flow_.holds(out_.start, clock_.time)) {
      out_.end = flow_.bounds(out_.start) ? End::masked : End::boundary;
      return;
    }
    state_ = dvec4(out_.start, 0);
    if (!slope(state_, 0, slopes_[0])) {
      out_.end = End::boundary;
      return;
    }
    const double rate = widest(slopes_[0]);
    if (!clock_.runs && !(rate > 0)) return;
    double step = rate > 0 ? 0.25 / rate : length_;
    for (int n = 0; n < limits_.steps_max; ++n) {
      const double left = length_ - out_.length;
      if (!(left > 1e-12 * length_)) return finish(End::length);
      const double rate_here = widest(slopes_[0]);
      step = std::min({step, left, to_next_frame()});
      if (rate_here > 0) step = std::min(step, step_most / rate_here);
      const double error = try_step(step) / limits_.tolerance;
      if (!(error <= 1)) {
        step *= std::isfinite(error) ? std::max(0.2, 0.9 * std::pow(error, -0.2)) : 0.25;
        if (is_least(step, rate_here)) return finish(blocked_);
        continue;
      }
      if (!clock_.runs && reverses(step)) {
        // About a sink, errors are of the order of the steps and would let it pass back and forth.
        if (step * rate_here < std::max(20 * limits_.tolerance, step_least)) {
          return finish(End::stagnation);
        }
        step *= 0.5;
        continue;
      }
      if (!accept(step)) return;
      step *= std::min(5.0, 0.9 * std::pow(std::max(error, 1e-10), -0.2));
    }
    finish(End::steps);
  }

 private:
  void finish(End end) { out_.end = end; }

  // The time at a place of the path.
  [[nodiscard]] double now(double from_start) const {
    return clock_.runs ? clock_.time + sign_ * from_start : 0;
  }

  // Between frames the field is smooth: no step crosses one.
  [[nodiscard]] double to_next_frame() const {
    if (!clock_.runs) return HUGE_VAL;
    const double slack = 1e-12 * length_;
    double least = HUGE_VAL;
    for (const Frame& frame : flow_.frames) {
      const double way = sign_ * (frame.time - now(out_.length));
      if (way > slack) least = std::min(least, way);
    }
    return least;
  }

  [[nodiscard]] bool is_least(double step, double rate) const {
    return step * rate < step_least && (!clock_.runs || step < 1e-9 * length_);
  }

  // The change of place and time per unit of world length, or of place and length per unit of time.
  // False where there is no flow.
  bool slope(const dvec4& state, double from_start, dvec4& out) {
    ++out_.evaluations;
    Motion motion;
    if (!motion_at(flow_, index_of(state), motion, now(from_start))) return false;
    if (!(motion.speed > 0)) {
      out = dvec4(0);
    } else if (clock_.runs) {
      out = sign_ * motion.speed * dvec4(motion.along, 1);
    } else {
      out = sign_ * dvec4(motion.along, 1 / motion.speed);
    }
    return true;
  }

  // Returns the estimated error in cells; infinite where a stage finds no flow. A step that cannot
  // be shortened further ends the path for the reason `blocked_`.
  double try_step(double step) {
    blocked_ = End::stagnation;
    for (int s = 1; s < stages; ++s) {
      dvec4 at = state_;
      for (int k = 0; k < s; ++k) at += step * weights[s][k] * slopes_[k];
      const double there = out_.length + nodes[s] * step;
      if (!slope(at, there, slopes_[s])) {
        const bool masked = flow_.bounds(index_of(at)) && !flow_.holds(index_of(at), now(there));
        blocked_ = masked ? End::masked : End::boundary;
        return HUGE_VAL;
      }
      next_ = at;  // the last stage is the end of the step
    }
    way_ = dvec4(0);
    for (int k = 0; k + 1 < stages; ++k) way_ += step * weights[stages - 1][k] * slopes_[k];
    dvec4 error(0);
    for (int s = 0; s < stages; ++s) error += step * errors[s] * slopes_[s];
    return widest(error);
  }

  // Whether the flow reverses, or all but does, within the last step tried.
  [[nodiscard]] bool reverses(double step) const {
    const dvec3 from = index_of(slopes_[0]);
    const dvec3 to = index_of(slopes_[stages - 1]);
    const double way = 0.5 * step * (glm::length(from) + glm::length(to));
    return glm::dot(from, to) < 0 || glm::length(index_of(way_)) < 0.5 * way;
  }

  // Adds the step, or its part before the domain ends. Returns whether the path continues.
  bool accept(double length) {
    Step step{out_.length, length, {}};
    const dvec4 change = next_ - state_;
    const dvec4 bend = length * slopes_[0] - change;
    dvec4 last(0);
    for (int s = 0; s < stages; ++s) last += length * dense[s] * slopes_[s];
    step.terms = {state_, change, bend, change - length * slopes_[6] - bend, last};
    const double part = part_inside(step);
    out_.steps.push_back(step);
    out_.length += part * length;
    if (part < 1) return false;
    state_ = next_;
    slopes_[0] = slopes_[6];
    if (clock_.runs || widest(slopes_[0]) > 0) return true;
    finish(End::stagnation);
    return false;
  }

  // Why a path ends before a part of a step; `steps` if it does not.
  [[nodiscard]] End leaves(const Step& step, double part) const {
    const dvec4 there = place_in(step, part);
    if (!clock_.runs && std::abs(there.w) > limits_.duration_max) return End::length;
    if (flow_.holds(index_of(there), now(step.start + part * step.length))) return End::steps;
    return flow_.bounds(index_of(there)) ? End::masked : End::boundary;
  }

  // The part of a step before it leaves the domain; sets the reason if it does.
  double part_inside(const Step& step) {
    constexpr int checks = 4;
    constexpr int halvings = 40;
    double low = 0;
    for (int n = 1; n <= checks; ++n) {
      double high = static_cast<double>(n) / checks;
      const End why = leaves(step, high);
      if (why == End::steps) {
        low = high;
        continue;
      }
      finish(why);
      for (int k = 0; k < halvings; ++k) {
        const double middle = 0.5 * (low + high);
        (leaves(step, middle) == End::steps ? low : high) = middle;
      }
      return low;
    }
    return 1;
  }

  const Flow& flow_;
  const double length_;
  const double sign_;
  const Limits& limits_;
  const Clock clock_;
  Path& out_;
  dvec4 state_{0};
  dvec4 next_{0};
  dvec4 way_{0};  // from the state to the next, also where it is lost in their rounding
  std::array<dvec4, stages> slopes_{};
  End blocked_ = End::stagnation;
};

}  // namespace

Place Path::at(double from_start) const {
  if (steps.empty()) return {start, 0};
  auto after = std::upper_bound(
      steps.begin(), steps.end(), from_start,
      [](double length_there, const Step& step) { return length_there < step.start; });
  if (after != steps.begin()) --after;
  const double part = std::clamp((from_start - after->start) / after->length, 0.0, 1.0);
  const dvec4 state = place_in(*after, part);
  return {index_of(state), state.w};
}

namespace {

void begin(const glm::dvec3& start, Path& out) {
  out.steps.clear();
  out.length = 0;
  out.end = End::stagnation;
  out.evaluations = 0;
  out.start = start;
}

}  // namespace

void follow_through_time(const Flow& flow, const glm::dvec3& start, double time, double duration,
                         bool back, const Limits& limits, Path& out) {
  begin(start, out);
  Follower(flow, duration, back, limits, out, {true, time}).run();
}

void follow(const Flow& flow, const glm::dvec3& start, double length, bool upstream,
            const Limits& limits, Path& out) {
  begin(start, out);
  Follower(flow, length, upstream, limits, out).run();
}

}  // namespace windsplat::trace
