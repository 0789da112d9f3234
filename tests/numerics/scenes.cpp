// Synthetic scenes for the numerical tests.
#include "tests/numerics/scenes.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <stdexcept>

#include "server/engine/bins.hpp"
#include "server/engine/plan.hpp"
#include "server/engine/tiles.hpp"

namespace windsplat::test {

double footprint(double r) {
  const double s = 0.48;
  const double t = 1.37;
  if (r < s) return 1 - r * r / (s * t);
  return r < t ? (t - r) * (t - r) / (t * (t - s)) : 0;
}

scene::Lattice make_lattice(const std::array<std::vector<double>, 3>& spacing) {
  scene::Lattice lattice;
  for (int a = 0; a < 3; ++a) {
    double total = 0;
    for (const double s : spacing[a]) total += s;
    lattice.dims[a] = static_cast<int>(spacing[a].size());
    lattice.spacing[a] = spacing[a];
    lattice.box_min[a] = -total / 2;
    lattice.box_max[a] = total / 2;
    double edge = -total / 2;
    for (const double s : spacing[a]) {
      lattice.positions[a].push_back(edge + s / 2);
      edge += s;
    }
  }
  return lattice;
}

scene::Lattice even_lattice(std::array<int, 3> dims, std::array<double, 3> spacing) {
  std::array<std::vector<double>, 3> all;
  for (int a = 0; a < 3; ++a) all[a].assign(dims[a], spacing[a]);
  return make_lattice(all);
}

void displace(scene::Lattice& lattice, const ToWorld& to_world) {
  auto places = std::make_shared<std::vector<std::array<float, 3>>>();
  for (const double z : lattice.positions[2]) {
    for (const double y : lattice.positions[1]) {
      for (const double x : lattice.positions[0]) {
        const glm::dvec3 p = to_world({x, y, z});
        places->push_back(
            {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
      }
    }
  }
  lattice.places = places;
}

std::shared_ptr<const data::Volume> make_volume(
    const scene::Lattice& lattice, int components,
    const std::function<float(int, double, double, double)>& value) {
  auto volume = std::make_shared<data::Volume>();
  volume->dims = lattice.dims;
  volume->components = components;
  std::vector<float> samples;
  for (int c = 0; c < components; ++c) {
    for (const double z : lattice.positions[2]) {
      for (const double y : lattice.positions[1]) {
        for (const double x : lattice.positions[0]) samples.push_back(value(c, x, y, z));
      }
    }
  }
  volume->values = std::move(samples);
  return volume;
}

std::shared_ptr<const data::Volume> uniform(const scene::Lattice& lattice, float value) {
  return make_volume(lattice, 1, [=](int, double, double, double) { return value; });
}

scene::Camera look(const glm::dvec3& target, const glm::dvec3& forward, double distance, int width,
                   int height, bool perspective, double half_height) {
  scene::Camera camera;
  camera.forward = glm::normalize(forward);
  const glm::dvec3 up =
      std::abs(camera.forward.z) < 0.9 ? glm::dvec3(0, 0, 1) : glm::dvec3(0, 1, 0);
  camera.right = glm::normalize(glm::cross(camera.forward, up));
  camera.up = glm::cross(camera.right, camera.forward);
  camera.eye = target - distance * camera.forward;
  camera.width = width;
  camera.height = height;
  camera.perspective = perspective;
  camera.half_height = half_height;
  return camera;
}

scene::ColorTable constant_color(std::array<float, 3> rgb) {
  return {{0, 1}, std::vector<std::array<float, 3>>(256, rgb)};
}

scene::ColorTable ramp_color(double low, double high, std::array<float, 3> from,
                             std::array<float, 3> to) {
  scene::ColorTable table;
  table.range = {low, high};
  for (int i = 0; i < 256; ++i) {
    const float f = static_cast<float>(i) / 255.0F;
    std::array<float, 3> rgb{};
    for (int c = 0; c < 3; ++c) rgb[c] = from[c] + f * (to[c] - from[c]);
    table.entries.push_back(rgb);
  }
  return table;
}

scene::ScalarLayer medium(std::shared_ptr<const data::Volume> field, std::array<float, 3> rgb,
                          double top) {
  scene::ScalarLayer layer;
  layer.field = std::move(field);
  layer.color = constant_color(rgb);
  layer.extinction = {{0, 0}, {top, top}};
  layer.min_optical_depth = 0;
  return layer;
}

scene::VectorLayer plain_lines(std::shared_ptr<const data::Volume> field,
                               std::array<float, 3> rgb) {
  scene::VectorLayer layer;
  layer.field = std::move(field);
  layer.color_by = scene::LineColor::constant;
  layer.color = constant_color(rgb);
  layer.head_desaturation = 0;
  layer.magnitude_intensity = 0;
  layer.jitter_center = 0;
  layer.jitter_stride = 0;
  layer.span = 1e6;
  return layer;
}

scene::Scene cloudy_scene(int side, int size) {
  scene::Scene scene;
  const double cell = 2.0 / side;
  scene.lattice = even_lattice({side, side, side}, {cell, cell, cell});
  const auto wave = [](int c, double x, double y, double z) {
    return static_cast<float>(1 + std::sin(5 * x + c) + std::cos(4 * y - c) * std::sin(3 * z + 1));
  };
  scene.camera = look({0, 0, 0}, {0.3, 1, -0.5}, 4, size, size, true, 0.4);
  scene.vector = plain_lines(make_volume(scene.lattice, 3, wave), {0.9F, 0.5F, 0.1F});
  scene.vector->length = 0.2;
  scene.vector->head_desaturation = 0.5;
  scene.vector->jitter_center = 0.5;
  scene.scalars = {medium(make_volume(scene.lattice, 1, wave), {0.5F, 0.6F, 0.9F})};
  scene.scalars[0].color = ramp_color(0, 3, {0.9F, 0.2F, 0.1F}, {0.2F, 0.5F, 1.0F});
  return scene;
}

engine::Rendered render(const scene::Scene& scene, unsigned threads) {
  ThreadPool pool(threads);
  auto rendered = engine::render(scene, pool, CancelToken());
  if (!rendered) throw std::runtime_error(rendered.error().message);
  return std::move(*rendered);
}

engine::Rendered render_with(const engine::kernels::Table& table, const scene::Scene& scene) {
  ThreadPool pool(1);
  const CancelToken cancel;
  engine::Rendered out;
  engine::RenderPlan plan;
  engine::make_plan(scene, plan);
  engine::BinSpace bin_space;
  engine::TileSpace tile_space;
  surface::Pixels surfaces;
  surfaces.list(scene.surfaces, engine::surface_view(scene.camera), scene.camera.width,
                scene.camera.height, pool, cancel);
  const engine::Bins& bins = engine::make_bins(plan, table, pool, cancel, bin_space, out.work);
  out.image.width = scene.camera.width;
  out.image.height = scene.camera.height;
  out.image.rgba.assign(4 * static_cast<std::size_t>(scene.camera.width) * scene.camera.height, 0);
  engine::draw_tiles(plan, bins, scene.surfaces.empty() ? nullptr : &surfaces, table, pool, cancel,
                     tile_space, engine::sink_into(out.image), out.work);
  return out;
}

float largest_difference(const engine::Rendered& a, const engine::Rendered& b) {
  float most = 0;
  for (std::size_t i = 0; i < a.image.rgba.size(); ++i) {
    most = std::max(most, std::abs(a.image.rgba[i] - b.image.rgba[i]));
  }
  return most;
}

const float* pixel(const engine::Image& image, int x, int y) {
  return image.rgba.data() + 4 * (static_cast<std::size_t>(y) * image.width + x);
}

}  // namespace windsplat::test
