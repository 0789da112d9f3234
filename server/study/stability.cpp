// One cell or a row of cells one behind the other. The line is almost parallel to the view
// direction, so that the pixels of one row meet it at different depths of the cell.
#include "server/study/stability.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "server/engine/render.hpp"
#include "server/study/sweep.hpp"

namespace windsplat::study {

namespace {

constexpr double footprint_integral = 1.4476982547;  // C of docs/design/rendering-model.md
constexpr int pixels = 9;                            // pixels of the row, from the tail to the head
                                                     // of the line
constexpr double row_width = 2e-4;                   // width of the row, in cells: g = 1 over the
                                                     // whole row
constexpr double line_opacity = 0.6;
constexpr std::array<float, 3> medium_color{0.8F, 0.3F, 0.1F};
constexpr std::array<float, 3> line_color{0.1F, 0.9F, 0.7F};

std::shared_ptr<const data::Volume> make_volume(int layers, const std::vector<float>& sample) {
  auto volume = std::make_shared<data::Volume>();
  volume->dims = {1, layers, 1};
  volume->components = static_cast<int>(sample.size());
  std::vector<float> samples;
  for (const float v : sample) samples.insert(samples.end(), layers, v);
  volume->values = std::move(samples);
  data::finish_volume(*volume);
  return volume;
}

scene::ColorTable one_color(const std::array<float, 3>& rgb) {
  return {{0, 1}, std::vector<std::array<float, 3>>(256, rgb)};
}

// Cells of edge 1 in a row along y, the view direction.
scene::Scene make_scene(int layers, double tau, scene::Compositing compositing, bool with_line) {
  scene::Scene scene;
  scene.compositing = compositing;
  // Disables early termination, even at a negative transmittance of an unstable operator.
  scene.stop_transmittance = -1e30;
  scene.lattice.dims = {1, layers, 1};
  for (int a = 0; a < 3; ++a) {
    const int n = scene.lattice.dims[a];
    scene.lattice.spacing[a].assign(n, 1.0);
    for (int i = 0; i < n; ++i) scene.lattice.positions[a].push_back(i + 0.5 - 0.5 * n);
    scene.lattice.box_min[a] = -0.5 * n;
    scene.lattice.box_max[a] = 0.5 * n;
  }
  scene.camera.perspective = false;
  scene.camera.eye = {0, -layers - 1.0, 0};
  scene.camera.width = pixels;
  scene.camera.height = 1;
  scene.camera.half_height = 0.5 * row_width / pixels;

  scene::VectorLayer lines;
  lines.field = make_volume(layers, {static_cast<float>(row_width), 1.0F, 0.0F});
  lines.length = std::hypot(row_width, 1.0);
  lines.magnitude_range = {0, lines.length};
  lines.span = 2;
  lines.r1 = 0.6;
  lines.r2 = 1.4;
  lines.opacity = line_opacity;
  lines.head_desaturation = 0;
  lines.color_by = scene::LineColor::constant;
  lines.color = one_color(line_color);
  lines.magnitude_intensity = 0;
  lines.jitter_center = 0;
  lines.jitter_stride = 0;
  if (with_line) scene.vector = std::move(lines);

  scene::ScalarLayer medium;
  medium.field = make_volume(layers, {1.0F});
  medium.color = one_color(medium_color);
  medium.extinction = {{0, tau * footprint_integral}};
  medium.min_optical_depth = 0;
  scene.scalars.push_back(std::move(medium));
  return scene;
}

// The exact kernel with its line at the fraction x of the depth of the cell.
std::array<double, 4> exact(double tau, double x) {
  const double alpha = -std::expm1(-tau) + line_opacity * std::exp(-tau);
  std::array<double, 4> out{0, 0, 0, alpha};
  for (std::size_t c = 0; c < 3; ++c) {
    const double between = static_cast<double>(line_color[c]) - medium_color[c];
    out[c] = medium_color[c] * alpha + line_opacity * std::exp(-tau * x) * between;
  }
  return out;
}

double outside(double low, double high) { return std::max({0.0, -low, high - 1}); }

void take(const std::vector<float>& rgba, double& low, double& high) {
  low = std::numeric_limits<double>::infinity();
  high = -low;
  for (const float v : rgba) {
    if (std::isnan(v)) {  // a non-finite value counts as the largest excess
      low = -std::numeric_limits<double>::infinity();
      high = -low;
      return;
    }
    low = std::min<double>(low, v);
    high = std::max<double>(high, v);
  }
}

Result<Stiffness> measure_one(scene::Compositing compositing, double tau,
                              std::vector<float>& alphas, ThreadPool& pool,
                              const CancelToken& cancel) {
  const auto one = engine::render(make_scene(1, tau, compositing, true), pool, cancel);
  if (!one) return one.error();
  const auto plain = engine::render(make_scene(1, tau, compositing, false), pool, cancel);
  if (!plain) return plain.error();
  const auto layers =
      engine::render(make_scene(stiff_layers, tau, compositing, false), pool, cancel);
  if (!layers) return layers.error();
  Stiffness out;
  out.compositing = compositing;
  out.tau = tau;
  const std::vector<float>& rgba = one->image.rgba;
  take(rgba, out.min, out.max);
  double plain_min = 0;
  double plain_max = 0;
  take(plain->image.rgba, plain_min, plain_max);
  take(layers->image.rgba, out.layers_min, out.layers_max);
  for (int i = 0; i < pixels; ++i) {
    // The line crosses the cell over the width of the row: pixel i meets it at x.
    const auto truth = exact(tau, (i + 0.5) / pixels);
    for (std::size_t c = 0; c < 4; ++c) {
      const double apart = std::abs(rgba[4 * static_cast<std::size_t>(i) + c] - truth[c]);
      if (!(apart <= out.error)) out.error = apart;
    }
    const float alpha = rgba[4 * static_cast<std::size_t>(i) + 3];
    // Tolerates decreases within the rounding of a float.
    if (!alphas.empty() && !(alpha >= alphas[i] - 1e-6F)) out.monotone = false;
  }
  alphas.clear();
  for (int i = 0; i < pixels; ++i) alphas.push_back(rgba[4 * static_cast<std::size_t>(i) + 3]);
  out.bounded = outside(out.min, out.max) <= unit_slack;
  const double beyond = outside(out.layers_min, out.layers_max);
  out.diverges = beyond > unit_slack && beyond >= (1 - unit_slack) * outside(plain_min, plain_max);
  return out;
}

}  // namespace

const std::vector<double>& stiffness() {
  static const std::vector<double> taus{1e-30, 1e-6, 1e-3, 0.1, 0.5, 1,   1.5,
                                        2,     3,    10,   50,  1e4, 1e30};
  return taus;
}

Result<std::vector<Stiffness>> stiffness_sweep(ThreadPool& pool, const CancelToken& cancel) {
  std::vector<Stiffness> all;
  for (const scene::Compositing compositing : compositings) {
    std::vector<float> alphas;
    for (const double tau : stiffness()) {
      const auto one = measure_one(compositing, tau, alphas, pool, cancel);
      if (!one) return one.error();
      all.push_back(*one);
    }
  }
  return all;
}

}  // namespace windsplat::study
