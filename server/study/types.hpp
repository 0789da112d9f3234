// What a study measures: settings of the engine, their run times and errors, and their curves.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::study {

// The parameters varied by a study, named as in the view.
struct Knobs {
  int stride = 1;
  double span = 7;
  double slab_thickness = 1;
  double stop_transmittance = 1.5e-4;
  int width = 1;  // pixels rendered; the height follows
  bool operator==(const Knobs&) const = default;
};

struct Setting {
  scene::Method method = scene::Method::kernel;
  scene::Compositing compositing = scene::Compositing::analytic;
  Knobs knobs;
  bool operator==(const Setting&) const = default;
};

// Errors in linear light, over RGBA; FLIP of the displayed picture; milliseconds of rendering.
struct Measurement {
  double rmse = 0;
  double max = 0;
  double psnr = 0;
  double flip = 0;
  double ms = 0;  // the median
  double ms_min = 0;
  double ms_max = 0;
  bool stable = true;  // finite and within [0, 1] except for 1e-3
};

struct Point {
  Setting setting;
  Measurement measured;
  bool pareto = false;
};

enum class Knob { stride, span, slab_thickness, stop_transmittance, width };

// Points of one method and compositing that differ in one parameter, in its order.
struct Curve {
  scene::Method method = scene::Method::kernel;
  scene::Compositing compositing = scene::Compositing::analytic;
  Knob knob = Knob::stride;
  std::vector<std::size_t> points;
  double order = 0;  // slope of log rmse over log parameter; NaN for fewer than 3 stable points
};

// A picture in double precision.
struct Picture {
  int width = 0;
  int height = 0;
  std::vector<double> rgba;  // linear premultiplied, row 0 on top
  std::int64_t pieces = 0;   // intervals of the integration
  std::int64_t evaluations = 0;
};

// The reference of a scene. Errors: those of the integrator.
using Truth = std::function<Result<Picture>(const scene::Scene&)>;

inline constexpr std::array<scene::Compositing, 5> compositings{
    scene::Compositing::analytic, scene::Compositing::cd, scene::Compositing::cd_naive,
    scene::Compositing::simple, scene::Compositing::cd_euler};

const char* name_of(scene::Method method);
const char* name_of(scene::Compositing compositing);
const char* name_of(Knob knob);
double value_of(const Knobs& knobs, Knob knob);

// Marks the stable points that no other stable point dominates in time and error.
void mark_pareto(std::vector<Point>& points);

// Least-squares slope of log y over log x; only pairs of positive finite numbers count. NaN for
// fewer than three pairs or if all x are equal.
double log_slope(const std::vector<double>& x, const std::vector<double>& y);

void find_order(const std::vector<Point>& points, Curve& curve);

double median(std::vector<double> values);  // requires at least one value

}  // namespace windsplat::study
