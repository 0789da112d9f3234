// The ripple of overlapping footprints: a uniform medium rendered as splats, compared with its
// closed form.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <utility>

#include "server/study/sweep.hpp"

namespace windsplat::study {

namespace {

constexpr int side = 48;            // pixels
constexpr double seen_cells = 4;    // cells of the widest axis along the side of the picture
constexpr double margin_cells = 2;  // a footprint reaches 1.37 beyond its sample

// The segment of a ray inside the box; nullopt if the ray misses it.
struct Chord {
  double enter = 0;
  double leave = 0;
  [[nodiscard]] double length() const { return leave - enter; }
};
Chord chord(const scene::Lattice& lattice, const glm::dvec3& from, const glm::dvec3& along) {
  double enter = -std::numeric_limits<double>::infinity();
  double leave = std::numeric_limits<double>::infinity();
  for (int a = 0; a < 3; ++a) {
    if (std::abs(along[a]) < 1e-12) {
      if (from[a] < lattice.box_min[a] || from[a] > lattice.box_max[a]) return {};
      continue;
    }
    const double t0 = (lattice.box_min[a] - from[a]) / along[a];
    const double t1 = (lattice.box_max[a] - from[a]) / along[a];
    enter = std::max(enter, std::min(t0, t1));
    leave = std::min(leave, std::max(t0, t1));
  }
  if (leave <= enter) return {};
  return {enter, leave};
}

// Distance in cells from a point to the faces of the box other than those crossed by the ray;
// beyond the margin, these faces do not affect a splat.
bool clear_of_edges(const scene::Lattice& lattice, const glm::dvec3& point) {
  int near = 0;
  for (int a = 0; a < 3; ++a) {
    const double cell = (lattice.box_max[a] - lattice.box_min[a]) / lattice.dims[a];
    const double inside =
        std::min(point[a] - lattice.box_min[a], lattice.box_max[a] - point[a]) / cell;
    if (inside < margin_cells) ++near;
  }
  return near <= 1;
}

}  // namespace

Result<double> reconstruction_ripple(const Subject& subject, ThreadPool& pool,
                                     const CancelToken& cancel) {
  Setting setting{scene::Method::kernel, scene::Compositing::analytic, own_knobs(subject)};
  auto scene = scene_at(subject, setting);
  if (!scene) return scene.error();
  if (scene->lattice.places || scene->slice) return std::numeric_limits<double>::quiet_NaN();
  scene->vector.reset();
  scene->depth_cue = {};
  scene->stop_transmittance = 0;
  scene::Lattice& lattice = scene->lattice;
  scene::Camera& camera = scene->camera;
  const glm::dvec3 middle = 0.5 * (lattice.box_min + lattice.box_max);
  double cell = 0;
  for (int a = 0; a < 3; ++a) {
    cell = std::max(cell, (lattice.box_max[a] - lattice.box_min[a]) / lattice.dims[a]);
  }
  camera.perspective = false;
  camera.eye = middle - 4.0 * camera.forward;
  camera.width = side;
  camera.height = side;
  camera.half_height = 0.5 * seen_cells * cell;

  const double depth = chord(lattice, middle, camera.forward).length();
  const double rho = 1 / depth;
  auto volume = std::make_shared<data::Volume>();
  volume->dims = lattice.dims;
  volume->values = std::vector<float>(volume->samples(), 1.0F);
  data::finish_volume(*volume);
  scene::ScalarLayer layer;
  layer.field = std::move(volume);
  layer.color.entries.assign(256, {1, 1, 1});
  layer.extinction = {{0, rho}};
  layer.min_optical_depth = 0;
  scene->scalars.assign(1, layer);

  const auto rendered = engine::render(*scene, pool, cancel);
  if (!rendered) return rendered.error();
  double squares = 0;
  double count = 0;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const double scale = 2 * camera.half_height / side;
      const glm::dvec3 from = camera.eye + (x + 0.5 - 0.5 * side) * scale * camera.right -
                              (y + 0.5 - 0.5 * side) * scale * camera.up;
      const Chord inside = chord(lattice, from, camera.forward);
      if (!clear_of_edges(lattice, from + inside.enter * camera.forward) ||
          !clear_of_edges(lattice, from + inside.leave * camera.forward)) {
        continue;
      }
      const double exact = -std::expm1(-rho * inside.length());
      for (int c = 0; c < 4; ++c) {
        const double got = rendered->image.rgba[4 * static_cast<std::size_t>(y * side + x) + c];
        squares += (got - exact) * (got - exact);
        ++count;
      }
    }
  }
  if (count == 0) return std::numeric_limits<double>::quiet_NaN();
  return std::sqrt(squares / count);
}

}  // namespace windsplat::study
