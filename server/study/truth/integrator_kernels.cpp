// Scene -> splats and lines of the brute-force integral, by the formulas of
// docs/design/rendering-model.md.
#include "server/study/truth/integrator_kernels.hpp"

#include <cstdint>
#include <numbers>
#include <optional>
#include <stdexcept>

#include "server/study/truth/sunlight.hpp"

namespace windsplat::truth {

namespace {

using scene::LineColor;
using scene::Scene;
using scene::VectorLayer;

// C: the integral over the plane of 1 - r^2/(s t) up to s and (t - r)^2/(t (t - s)) up to t.
Real footprint_volume() {
  const Real s = inner;
  const Real t = outer;
  const auto ring = [&](Real r) {
    return t * t * r * r / 2 - 2 * t * r * r * r / 3 + r * r * r * r / 4;
  };
  const Real core = s * s / 2 - s * s * s / (4 * t);
  return 2 * std::numbers::pi_v<Real> * (core + (ring(t) - ring(s)) / (t * (t - s)));
}

// ---- kernels ----

struct Cell {
  std::array<int, 3> sample{};
  std::size_t index = 0;
  Vec centre;                 // world
  std::array<Vec, 3> edge;    // world
  std::array<Vec, 3> normal;  // rows of the inverse
  Vec width;                  // of the uncurved cell
};

// Sample and width of each kernel position along an axis.
struct Position {
  int sample;
  int samples;
  Real width;
};

std::vector<Position> positions(const Scene& scene, int axis, int stride) {
  const auto& spacing = scene.lattice.spacing[axis];
  if (scene.slice && scene.slice->axis == axis) {
    return {{scene.slice->sample, 1, spacing[scene.slice->sample]}};
  }
  std::vector<Position> out;
  const data::Box held = scene.lattice.held();
  const int count = std::min(scene.lattice.drawn(axis), held.first[axis] + held.count[axis]);
  for (int first = held.first[axis]; first < count; first += stride) {
    const int samples = std::min(stride, count - first);
    Position position{first + (samples - 1) / 2, samples, 0};
    for (int i = first; i < first + samples; ++i) position.width += spacing[i];
    out.push_back(position);
  }
  return out;
}

Vec place(const scene::Lattice& lattice, const std::array<int, 3>& sample) {
  if (lattice.places) {
    const auto& at = (*lattice.places)[lattice.number_of(sample)];
    return {at[0], at[1], at[2]};
  }
  return {lattice.positions[0][sample[0]], lattice.positions[1][sample[1]],
          lattice.positions[2][sample[2]]};
}

Vec edge_of(const scene::Lattice& lattice, const std::array<int, 3>& sample, int a,
            const Position& along) {
  Vec edge;
  edge[a] = along.width;
  if (!lattice.places) return edge;
  if (lattice.dims[a] < 2) throw std::invalid_argument("a curved axis of one sample");
  std::array<int, 3> before = sample;
  std::array<int, 3> after = sample;
  before[a] = std::max(sample[a] - 1, 0);
  after[a] = std::min(sample[a] + 1, lattice.dims[a] - 1);
  Real steps = after[a] - before[a];
  if (a == 0 && lattice.around > 0) {
    before[a] = (sample[a] + lattice.around - 1) % lattice.around;
    after[a] = (sample[a] + 1) % lattice.around;
    steps = 2;
  }
  return (along.samples / steps) * (place(lattice, after) - place(lattice, before));
}

// Calls visit(cell) for each kernel position of a stride.
template <class Visit>
void each_cell(const Scene& scene, int stride, const Visit& visit) {
  for (const Position& z : positions(scene, 2, stride)) {
    for (const Position& y : positions(scene, 1, stride)) {
      for (const Position& x : positions(scene, 0, stride)) {
        Cell cell;
        cell.sample = {x.sample, y.sample, z.sample};
        cell.index = scene.lattice.number_of(cell.sample);
        cell.centre = place(scene.lattice, cell.sample);
        cell.width = {x.width, y.width, z.width};
        const std::array<Position, 3> along{x, y, z};
        for (int a = 0; a < 3; ++a) {
          cell.edge[a] = edge_of(scene.lattice, cell.sample, a, along[a]);
        }
        for (int a = 0; a < 3; ++a) {
          const Vec across = cross(cell.edge[(a + 1) % 3], cell.edge[(a + 2) % 3]);
          cell.normal[a] = (1 / dot(cell.edge[a], across)) * across;
        }
        visit(cell);
      }
    }
  }
}

// ---- appearance ----

Vec table_color(const scene::ColorTable& table, Real value) {
  const auto last = static_cast<Real>(table.entries.size() - 1);
  const Real at = last * ramp(value, table.range[0], table.range[1]);
  const auto entry = static_cast<std::size_t>(std::floor(at));
  const auto& a = table.entries[entry];
  const auto& b = table.entries[std::min(entry + 1, table.entries.size() - 1)];
  const Real part = at - static_cast<Real>(entry);
  return (1 - part) * Vec{a[0], a[1], a[2]} + part * Vec{b[0], b[1], b[2]};
}

// Constant below the first point and beyond the last; of points at one value the last counts.
Real extinction(const scene::ScalarLayer& layer, Real value) {
  const auto& points = layer.extinction;
  std::size_t at = 0;
  while (at < points.size() && value >= points[at][0]) ++at;
  Real rho = points[at == 0 ? 0 : at - 1][1];
  if (at > 0 && at < points.size()) {
    const Real part = (value - points[at - 1][0]) / (points[at][0] - points[at - 1][0]);
    rho += part * (points[at][1] - rho);
  }
  return std::min(rho, Real(1e30));
}

// ---- lines ----

using Hash = std::array<std::uint32_t, 3>;

// pcg3d of Jarzynski & Olano 2020.
Hash hash(Hash v) {
  const auto mix = [&] {
    v[0] += v[1] * v[2];
    v[1] += v[2] * v[0];
    v[2] += v[0] * v[1];
  };
  for (std::uint32_t& c : v) c = c * 1664525U + 1013904223U;
  mix();
  for (std::uint32_t& c : v) c ^= c >> 16U;
  mix();
  return v;
}

Real unit(std::uint32_t bits) { return std::ldexp(static_cast<Real>(bits >> 8U), -24); }

Vec centred(const Hash& bits) {
  return {unit(bits[0]) - 0.5L, unit(bits[1]) - 0.5L, unit(bits[2]) - 0.5L};
}

struct Arrow {
  Real magnitude = 0;
  Real part = 0;   // of full length
  Vec direction;   // in the axes of the cell
  Vec extent;      // tail to head, world
  Real climb = 0;  // vertical part of the unit vector, before a slice removes a component
};

std::optional<Arrow> arrow_of(const Scene& scene, const VectorLayer& layer, const Cell& cell) {
  Vec data;
  const std::size_t number = scene::vector_number(layer, scene.lattice, cell.sample);
  for (int c = 0; c < layer.field->components; ++c) {
    const float value = layer.field->component(c)[number];
    if (std::isnan(value)) return {};
    data[c] = value;
  }
  Arrow arrow;
  arrow.magnitude = length(data);
  if (arrow.magnitude == 0 || arrow.magnitude < layer.min_magnitude) return {};
  Vec drawn{data.x * layer.scale[0], data.y * layer.scale[1], data.z * layer.scale[2]};
  if (!layer.rate_x.empty()) {
    drawn.x *= layer.rate_x[cell.sample[1]];
    drawn.y *= layer.rate_y;
    drawn.z *= layer.rate_z[cell.sample[2]];
  }
  if (length(drawn) == 0) return {};
  arrow.direction = (1 / length(drawn)) * drawn;
  arrow.climb = arrow.direction.z;
  if (scene.slice) arrow.direction[scene.slice->axis] = 0;
  const Real full = layer.magnitude_range[1];
  arrow.part = full > 0 ? std::min(arrow.magnitude / full, Real(1)) : 1;
  for (int a = 0; a < 3; ++a) {
    const Real width = length(cell.edge[a]);
    arrow.extent = arrow.extent + (arrow.direction[a] / width) * cell.edge[a];
  }
  if (length(arrow.extent) > 0) {
    const Real scale = arrow.part * layer.length * length(arrow.direction) / length(arrow.extent);
    arrow.extent = scale * arrow.extent;
  }
  return arrow;
}

Vec line_color(const Scene& scene, const VectorLayer& layer, const Cell& cell, const Arrow& arrow,
               Real height, Real depth) {
  const auto& lattice = scene.lattice;
  const Real low = lattice.positions[2].front() - lattice.spacing[2].front() / 2;
  const Real high = lattice.positions[2].back() + lattice.spacing[2].back() / 2;
  const auto in_table = [&](Real value) { return table_color(layer.color, value); };
  const auto color = [&]() -> Vec {
    switch (layer.color_by) {
      case LineColor::world_z:
        return in_table(height);
      case LineColor::screen_z:
        return in_table(depth);
      case LineColor::rise: {
        const auto [least, most] = layer.color.range;
        const Real rise = arrow.climb * arrow.part * layer.length;
        const Real place = (1 - layer.rise_weight) * (height - low) / (high - low) +
                           layer.rise_weight * (rise - least) / (most - least);
        return in_table(least + place * (most - least));
      }
      case LineColor::magnitude:
        return in_table(arrow.magnitude);
      case LineColor::direction: {
        const Real turn = std::atan2(arrow.direction.x + 0, arrow.direction.y + 0);
        const Real degrees = turn * 180 / std::numbers::pi_v<Real>;
        return in_table(degrees < 0 ? degrees + 360 : degrees);
      }
      case LineColor::scalar: {
        const float value = layer.color_field->values[cell.index];
        return std::isnan(value) ? Vec{0.5L, 0.5L, 0.5L} : in_table(value);
      }
      case LineColor::constant:
        return in_table(0);
    }
    return {};
  };
  const Real strong = ramp(arrow.magnitude, layer.magnitude_range[0], layer.magnitude_range[1]);
  const Real far = ramp(depth, scene.depth_cue.near, scene.depth_cue.far);
  return ((1 - layer.magnitude_intensity * (1 - strong)) * (1 - scene.depth_cue.strength * far)) *
         color();
}

// The part of |at + q way| <= half, an interval of q.
void clip(Real at, Real way, Real half, Real& q0, Real& q1) {
  if (way == 0) {
    if (std::abs(at) > half) q1 = q0 - 1;
    return;
  }
  q0 = std::max(q0, std::min((-half - at) / way, (half - at) / way));
  q1 = std::min(q1, std::max((-half - at) / way, (half - at) / way));
}

Vec to_camera(const scene::Camera& camera, const Vec& v) {
  return {dot(vec(camera.right), v), -dot(vec(camera.up), v), dot(vec(camera.forward), v)};
}

std::optional<Line> line_of(const Scene& scene, const VectorLayer& layer, const Cell& cell) {
  const auto arrow = arrow_of(scene, layer, cell);
  if (!arrow) return {};
  const Hash key = hash({layer.seed, layer.epoch, 0x9e3779b9U});
  Hash own = key;
  for (int a = 0; a < 3; ++a) {
    own[a] += static_cast<std::uint32_t>(layer.first_sample[a]) +
              static_cast<std::uint32_t>(cell.sample[a]);
  }
  const Hash first = hash(own);
  const Hash second = hash(first);
  const Vec in_box = layer.jitter_center * centred(second);
  const Vec moved = in_box + layer.jitter_stride * centred(first);
  Vec centre = cell.centre - vec(scene.camera.eye);
  for (int a = 0; a < 3; ++a) centre = centre + moved[a] * cell.edge[a];
  Line line;
  line.q0 = -0.5L;
  line.q1 = 0.5L;
  const Vec way = to_cells(cell.normal, arrow->extent);
  const Real half = (layer.overlap ? layer.span : 1.0) / 2;
  for (int a = 0; a < 3; ++a) clip(in_box[a], way[a], half, line.q0, line.q1);
  const Vec p = to_camera(scene.camera, centre);
  const Vec v = to_camera(scene.camera, arrow->extent);
  if (scene.camera.perspective) {
    const Real near = scene.camera.near;
    if (v.z > 0) line.q0 = std::max(line.q0, (near - p.z) / v.z);
    if (v.z < 0) line.q1 = std::min(line.q1, (near - p.z) / v.z);
    if (v.z == 0 && p.z < near) return {};
  }
  if (line.q0 > line.q1) return {};
  line.a = p + line.q0 * v;
  line.b = p + line.q1 * v;
  const Real height = scene.lattice.positions[2][cell.sample[2]] + moved.z * cell.width.z;
  line.color = line_color(scene, layer, cell, *arrow, height, p.z);
  if (layer.moving) line.phase = unit(hash(second)[0]) + layer.motion_cycles * arrow->part;
  return line;
}

}  // namespace

std::vector<Splat> splats_of(const Scene& scene) {
  static const Real volume = footprint_volume();
  struct Origin {
    const scene::ScalarLayer* layer;
    std::array<int, 3> sample;
  };
  std::vector<Splat> splats;
  std::vector<Origin> origins;
  for (const scene::ScalarLayer& layer : scene.scalars) {
    each_cell(scene, layer.stride, [&](const Cell& cell) {
      const float value = layer.field->values[cell.index];
      if (std::isnan(value)) return;
      const Real rho = extinction(layer, value);
      if (rho <= 0) return;
      splats.push_back({cell.centre, cell.normal, rho / volume, table_color(layer.color, value)});
      origins.push_back({&layer, cell.sample});
    });
  }
  if (!scene.light) return splats;
  const Sunlight light(scene, splats);
  for (std::size_t n = 0; n < splats.size(); ++n) {
    splats[n].color = light.of_medium(*origins[n].layer, origins[n].sample) * splats[n].color;
  }
  return splats;
}

std::vector<Line> lines_of(const Scene& scene) {
  std::vector<Line> lines;
  if (!scene.vector) return lines;
  std::optional<Sunlight> light;
  if (scene.light) {
    Scene unlit = scene;
    unlit.light.reset();
    light.emplace(scene, splats_of(unlit));
  }
  each_cell(scene, scene.vector->stride, [&](const Cell& cell) {
    auto line = line_of(scene, *scene.vector, cell);
    if (!line) return;
    if (light) line->color = light->of_line(cell.sample) * line->color;
    lines.push_back(*line);
  });
  return lines;
}

}  // namespace windsplat::truth
