// The sample "tornado": after the test function of Crawfis & Max, a swirl with an updraft about an
// axis that moves with height and time; here the flow conserves mass, and the funnel is where moist
// air condenses.
//
// Domain 1500 m x 1500 m x 1500 m, metres, step = 10 s. The axis is at c(z, t); s = r / r_u is the
// distance from it over the radius of the updraft, q = r / r_c(z) that over the radius of the core:
//   swirl     v_theta = 2 V q / (1 + q^2)            V at the edge of the core, counter-clockwise
//   updraft   w = W(z) exp(-s^2)                     W(z) = W_top (1 - exp(-z / h))
//   inflow    v_r = -W'(z) r_u^2 / (2 r) (1 - exp(-s^2))          from continuity
//   tilt      w dc/dz is added to the horizontal wind, so that the air follows the tilted axis
// Each part is divergence-free: the swirl because v_theta does not depend on the angle, updraft
// and inflow by construction, the tilt because shifting levels horizontally preserves volume.
//   vorticity on the axis (untilted) = 4 V / r_c
//   pressure deficit by cyclostrophic balance, dp/dr = density v_theta^2 / r:
//     p(inf) - p = density 2 V^2 / (1 + q^2)
// Air at height z with this deficit has cooled as if lifted by deficit / (density g). There is
// cloud where this lifts it above the condensation level, which rises outwards with drier air:
//   cloud = step((z + 2 V^2 / (g (1 + q^2)) - z_base - d s^2) / width), with an edge made irregular
//   by noise that rotates with the swirl.
#include <cmath>
#include <numbers>
#include <span>

#include "server/data/samples/source.hpp"

namespace windsplat::data {

namespace {

constexpr int tornado_version = 1;
constexpr double extent_m = 1500;
constexpr double step_s = 10;
constexpr double gravity = 9.81;         // m/s^2
constexpr double updraft_top = 45;       // m/s
constexpr double updraft_scale_m = 450;  // h
constexpr double updraft_radius_m = 300;
constexpr double condensation_base_m = 1250;
constexpr double dry_rise_m = 180;  // d

// Quantities that do not depend on x and y.
struct Level {
  double height_m;
  double axis_x, axis_y;    // c(z, t), m
  double tilt_x, tilt_y;    // dc/dz
  double core_m;            // r_c
  double swirl;             // V, m/s
  double updraft;           // W, m/s
  double updraft_gradient;  // dW/dz, 1/s
};

Level level_at(double height_m, double time_s) {
  const double z = height_m / extent_m;
  Level level{};
  level.height_m = height_m;
  // The axis turns slowly with height, drifts with time, and the whole funnel moves.
  const double phase_x = 5.0 * z + 0.045 * time_s;
  const double phase_y = 3.6 * z + 0.035 * time_s + 1.0;
  const double reach = 40.0 + 110.0 * z;
  const double reach_gradient = 110.0 / extent_m;
  level.axis_x = 0.5 * extent_m + reach * std::sin(phase_x) + 60.0 * std::cos(0.025 * time_s);
  level.axis_y = 0.5 * extent_m + reach * std::cos(phase_y) + 60.0 * std::sin(0.025 * time_s);
  level.tilt_x = reach_gradient * std::sin(phase_x) + reach * std::cos(phase_x) * 5.0 / extent_m;
  level.tilt_y = reach_gradient * std::cos(phase_y) - reach * std::sin(phase_y) * 3.6 / extent_m;
  level.core_m = 62.0 + 200.0 * std::pow(z, 1.5);
  level.swirl = 80.0 - 8.0 * z;
  const double decay = std::exp(-height_m / updraft_scale_m);
  level.updraft = updraft_top * (1.0 - decay);
  level.updraft_gradient = updraft_top / updraft_scale_m * decay;
  return level;
}

class Tornado final : public SampleSource {
 public:
  explicit Tornado(const SampleSize& size)
      : SampleSource("tornado", "Tornado test function", size, tornado_version, "s") {
    info_.grid.axes = sample_box(size.dims, {0, 0, 0}, {extent_m, extent_m, extent_m});
    info_.fields = {
        sample_vector("wind", {"u", "v", "w"}, "m s-1", "wind"),
        sample_scalar("cloud", "1", "", "condensation in the funnel, 0 clear to 1 cloudy"),
        sample_scalar("vorticity", "s-1", "", "vertical vorticity of the swirl")};
    for (FieldInfo& field : info_.fields) field.box_chunk = {1, 1, 1};
    for (int i = 0; i < size.steps; ++i) {
      const int seconds = static_cast<int>(step_s) * i;
      info_.steps.push_back({static_cast<double>(seconds), std::to_string(seconds) + " s"});
    }
  }

 private:
  void fill(std::size_t field, std::size_t step, const Box& box, Volume& volume) override {
    const double time_s = info_.steps[step].value;
    const auto coordinates = [&](std::size_t axis) {
      return std::span(info_.grid.axes.at(axis).coordinates)
          .subspan(static_cast<std::size_t>(box.first.at(axis)),
                   static_cast<std::size_t>(box.count.at(axis)));
    };
    float* out = volume.values.data();
    for (const double z : coordinates(2)) {
      const Level level = level_at(z, time_s);
      for (const double y : coordinates(1)) {
        for (const double x : coordinates(0)) {
          const double dx = x - level.axis_x;
          const double dy = y - level.axis_y;
          if (field == 0) {
            wind(level, dx, dy, volume.samples(), out);
          } else if (field == 1) {
            *out = cloud(level, dx, dy, time_s);
          } else {
            *out = vorticity(level, dx, dy);
          }
          ++out;
        }
      }
    }
  }

  static void wind(const Level& level, double dx, double dy, std::size_t stride, float* out) {
    const double r2 = dx * dx + dy * dy;
    const double core2 = level.core_m * level.core_m;
    const double spin = 2.0 * level.swirl * level.core_m / (core2 + r2);  // v_theta / r
    const double s2 = r2 / (updraft_radius_m * updraft_radius_m);
    const double fall = std::exp(-s2);
    // (1 - exp(-s^2)) / s^2 tends to 1 on the axis.
    const double mean_fall = s2 > 1e-12 ? -std::expm1(-s2) / s2 : 1.0;
    const double draw = -0.5 * level.updraft_gradient * mean_fall;  // v_r / r
    const double w = level.updraft * fall;
    out[0] = static_cast<float>(-spin * dy + draw * dx + w * level.tilt_x);
    out[stride] = static_cast<float>(spin * dx + draw * dy + w * level.tilt_y);
    out[2 * stride] = static_cast<float>(w);
  }

  static float cloud(const Level& level, double dx, double dy, double time_s) {
    const double r2 = dx * dx + dy * dy;
    const double q2 = r2 / (level.core_m * level.core_m);
    const double lift_m = 2.0 * level.swirl * level.swirl / (gravity * (1.0 + q2));
    const double base_m =
        condensation_base_m + dry_rise_m * r2 / (updraft_radius_m * updraft_radius_m);
    const double above_m = level.height_m + lift_m - base_m;
    if (above_m < -260.0) return 0.0F;
    // The noise is defined in (angle, log radius, height) and rotates with the air, so that its
    // streaks wind around the funnel. Its period is a full turn.
    const double turns = std::atan2(dy, dx) / (2.0 * std::numbers::pi);
    const double around = 5.0 * (turns + 1.0 - 0.012 * time_s + level.height_m / 900.0);
    const double rough =
        fractal_noise(around, 1.6 * std::log1p(q2), level.height_m / 210.0, 5, 4, 11);
    return static_cast<float>(smooth_step(-60.0, 260.0, above_m + 170.0 * rough));
  }

  static float vorticity(const Level& level, double dx, double dy) {
    const double q2 = (dx * dx + dy * dy) / (level.core_m * level.core_m);
    return static_cast<float>(4.0 * level.swirl / (level.core_m * (1.0 + q2) * (1.0 + q2)));
  }
};

}  // namespace

std::unique_ptr<Source> make_tornado(const SampleSize& size) {
  return std::make_unique<Tornado>(size);
}

}  // namespace windsplat::data
