// Scene -> kernel positions, ribbons and splats.
#include "server/engine/reference/kernels.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace windsplat::engine::reference {

namespace {

using scene::ColorTable;
using scene::LineColor;
using scene::ScalarLayer;
using scene::Scene;
using scene::VectorLayer;

Vec to_vec(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

Vec plus(const Vec& a, double f, const Vec& b) {
  return {a[0] + f * b[0], a[1] + f * b[1], a[2] + f * b[2]};
}

double length(const Vec& v) { return std::hypot(v[0], v[1], v[2]); }

Vec scaled(const Vec& v, double f) { return {f * v[0], f * v[1], f * v[2]}; }

// ---- cells ----

std::size_t sample_index(const scene::Lattice& lattice, const std::array<int, 3>& sample) {
  const auto x = static_cast<std::size_t>(lattice.dims[0]);
  const auto y = static_cast<std::size_t>(lattice.dims[1]);
  return static_cast<std::size_t>(sample[0]) +
         x * (static_cast<std::size_t>(sample[1]) + y * static_cast<std::size_t>(sample[2]));
}

Vec position_of(const scene::Lattice& lattice, const std::array<int, 3>& sample) {
  const auto& at = (*lattice.places)[sample_index(lattice, sample)];
  return {static_cast<double>(at[0]), static_cast<double>(at[1]), static_cast<double>(at[2])};
}

// A unit vector perpendicular to v; its sign is arbitrary but deterministic.
Vec any_normal(const Vec& v) {
  int least = 0;
  for (int a = 1; a < 3; ++a) {
    if (std::abs(v[a]) < std::abs(v[least])) least = a;
  }
  Vec axis{};
  axis[least] = 1;
  const Vec n = cross(v, axis);
  return scaled(n, 1 / length(n));
}

// Edges of a curved cell; those along axes of one sample are perpendicular to the others.
std::array<Vec, 3> curved_edges(const scene::Lattice& lattice, const std::array<AxisStop, 3>& s) {
  const std::array<int, 3> sample{s[0].sample, s[1].sample, s[2].sample};
  std::array<Vec, 3> edge{};
  std::array<bool, 3> known{};
  for (int a = 0; a < 3; ++a) {
    if (lattice.dims[a] == 1) continue;
    std::array<int, 3> before = sample;
    std::array<int, 3> after = sample;
    before[a] = std::max(sample[a] - 1, 0);
    after[a] = std::min(sample[a] + 1, lattice.dims[a] - 1);
    const Vec across = plus(position_of(lattice, after), -1, position_of(lattice, before));
    edge[a] = scaled(across, static_cast<double>(s[a].samples) / (after[a] - before[a]));
    known[a] = true;
  }
  for (int a = 0; a < 3; ++a) {
    if (known[a]) continue;
    const int b = (a + 1) % 3;
    const int c = (a + 2) % 3;
    Vec along{};
    if (known[b] && known[c]) {
      along = cross(edge[b], edge[c]);
      along = scaled(along, 1 / length(along));
    } else if (known[b] || known[c]) {
      along = any_normal(known[b] ? edge[b] : edge[c]);
    } else {
      along[a] = 1;
    }
    edge[a] = scaled(along, lattice.spacing[a][0]);
    known[a] = true;
  }
  return edge;
}

// Smallest volume of a cell relative to that of a box with edges of the same lengths.
constexpr double flattest = 1e-6;

double volume_of(const std::array<Vec, 3>& edge) { return dot(edge[0], cross(edge[1], edge[2])); }

bool spans_volume(const std::array<Vec, 3>& edge) {
  const double upright = length(edge[0]) * length(edge[1]) * length(edge[2]);
  return std::abs(volume_of(edge)) > flattest * upright;
}

std::array<Vec, 3> inverse_of(const std::array<Vec, 3>& edge) {
  const double volume = volume_of(edge);
  return {scaled(cross(edge[1], edge[2]), 1 / volume), scaled(cross(edge[2], edge[0]), 1 / volume),
          scaled(cross(edge[0], edge[1]), 1 / volume)};
}

// ---- tables ----

Vec table_color(const ColorTable& table, double value) {
  const auto last = static_cast<double>(table.entries.size() - 1);
  const double width = table.range[1] - table.range[0];
  double place = 0;
  if (width > 0) {
    place = (value - table.range[0]) / width * last;
  } else if (value > table.range[0]) {
    place = last;
  }
  place = std::clamp(place, 0.0, last);
  const auto i = static_cast<std::size_t>(place);
  const auto& a = table.entries[i];
  const auto& b = table.entries[std::min(i + 1, table.entries.size() - 1)];
  const double f = place - static_cast<double>(i);
  Vec color{};
  for (int c = 0; c < 3; ++c) {
    const auto from = static_cast<double>(a[c]);
    color[c] = from + f * (static_cast<double>(b[c]) - from);
  }
  return color;
}

// As in the engine: opaque over any distance, with finite sums.
constexpr double extinction_max = 1e30;

double extinction(const ScalarLayer& layer, double value) {
  const auto& points = layer.extinction;
  const auto at = [&](std::size_t p) { return std::min(points[p][1], extinction_max); };
  if (value < points.front()[0]) return at(0);
  double rho = at(points.size() - 1);
  for (std::size_t p = 0; p + 1 < points.size(); ++p) {
    const double x0 = points[p][0];
    const double x1 = points[p + 1][0];
    if (value >= x0 && value < x1) {
      rho = at(p) + (at(p + 1) - at(p)) * (value - x0) / (x1 - x0);
    }
  }
  return rho;
}

// ---- jitter: pcg3d (Jarzynski & Olano 2020) ----

using Hash = std::array<std::uint32_t, 3>;

Hash pcg3d(Hash v) {
  for (auto& c : v) c = c * 1664525U + 1013904223U;
  for (int round = 0; round < 2; ++round) {
    v[0] += v[1] * v[2];
    v[1] += v[2] * v[0];
    v[2] += v[0] * v[1];
    if (round == 0) {
      for (auto& c : v) c ^= c >> 16U;
    }
  }
  return v;
}

double unit_interval(std::uint32_t bits) { return static_cast<double>(bits >> 8U) / 16777216.0; }

struct Jitter {
  Vec stride{};      // each in [-1/2, 1/2)
  Vec centre{};      // each in [-1/2, 1/2)
  double phase = 0;  // in [0, 1)
};

Jitter jitter_of(const VectorLayer& layer, const std::array<int, 3>& sample) {
  const Hash key = pcg3d({layer.seed, layer.epoch, 0x9e3779b9U});
  const Hash first = pcg3d({static_cast<std::uint32_t>(sample[0]) + key[0],
                            static_cast<std::uint32_t>(sample[1]) + key[1],
                            static_cast<std::uint32_t>(sample[2]) + key[2]});
  const Hash second = pcg3d(first);
  Jitter jitter;
  for (int a = 0; a < 3; ++a) {
    jitter.stride[a] = unit_interval(first[a]) - 0.5;
    jitter.centre[a] = unit_interval(second[a]) - 0.5;
  }
  jitter.phase = unit_interval(pcg3d(second)[0]);
  return jitter;
}

// ---- lines ----

// The vector at a kernel position as drawn: `unit` along the axes of the cell (shorter than 1 if a
// slice removed a component), `extent` from tail to head in world units.
struct DrawnVector {
  double magnitude = 0;  // of the data
  Vec unit{};
  Vec extent{};
};

std::optional<DrawnVector> read_vector(const Scene& scene, const VectorLayer& layer,
                                       const Stop& stop) {
  Vec data{};
  for (int c = 0; c < layer.field->components; ++c) {
    data[c] = static_cast<double>(layer.field->component(c)[stop.index]);
  }
  if (std::isnan(data[0])) return {};
  DrawnVector drawn;
  drawn.magnitude = length(data);
  if (drawn.magnitude < layer.min_magnitude || drawn.magnitude == 0) return {};
  Vec d{};
  for (int c = 0; c < 3; ++c) d[c] = data[c] / drawn.magnitude * layer.scale[c];
  if (!layer.rate_x.empty()) {
    d[0] *= layer.rate_x[stop.sample[1]];
    d[1] *= layer.rate_y;
    d[2] *= layer.rate_z[stop.sample[2]];
  }
  const double norm = length(d);
  if (norm == 0) return {};
  for (int c = 0; c < 3; ++c) drawn.unit[c] = d[c] / norm;
  if (scene.slice) drawn.unit[scene.slice->axis] = 0;
  const double full = layer.magnitude_range[1];
  const double part = full > 0 ? std::clamp(drawn.magnitude / full, 0.0, 1.0) : 1.0;
  if (!scene.lattice.places) {
    drawn.extent = scaled(drawn.unit, part * layer.length);
    return drawn;
  }
  Vec along{};
  for (int a = 0; a < 3; ++a) {
    along = plus(along, drawn.unit[a] / length(stop.edge[a]), stop.edge[a]);
  }
  // The edges of a curved cell need not be perpendicular; keep the length of `unit`.
  const double bent = length(along);
  if (bent > 0) along = scaled(along, length(drawn.unit) / bent);
  drawn.extent = scaled(along, part * layer.length);
  return drawn;
}

// The part of a line within its kernel box, as q; empty if low > high. Liang-Barsky in cells.
struct Part {
  double low = -0.5;
  double high = 0.5;
};

Part clip_to_box(const VectorLayer& layer, const Stop& stop, const Vec& in_box, const Vec& extent) {
  Part part;
  const double half = (layer.overlap ? layer.span : 1.0) / 2;
  const Vec slope = stop.to_cells(extent);
  for (int a = 0; a < 3; ++a) {
    if (std::abs(slope[a]) > 1e-30) {
      const double p = (-half - in_box[a]) / slope[a];
      const double q = (half - in_box[a]) / slope[a];
      part.low = std::max(part.low, std::min(p, q));
      part.high = std::min(part.high, std::max(p, q));
    } else if (std::abs(in_box[a]) > half) {
      return {1, 0};
    }
  }
  return part;
}

// In [0, 360): 0 along +y, 90 along +x.
double bearing(const Vec& v) {
  const double degrees = std::atan2(v[0] + 0.0, v[1] + 0.0) * 180 / std::numbers::pi;
  const double turned = degrees < 0 ? degrees + 360 : degrees;
  return turned < 360 ? turned : 0;
}

struct Seen {
  double z = 0;         // height on the uncurved lattice
  double distance = 0;  // view depth of the middle of the line
};

Vec undimmed_color(const Scene& scene, const VectorLayer& layer, const Stop& stop,
                   const DrawnVector& drawn, const Seen& seen) {
  const auto [low, high] = scene::height_range(scene.lattice);
  switch (layer.color_by) {
    case LineColor::world_z:
      return table_color(layer.color, seen.z);
    case LineColor::screen_z:
      return table_color(layer.color, seen.distance);
    case LineColor::rise: {
      const double height = (seen.z - low) / (high - low);
      const double rise = 0.5 + 0.5 * drawn.unit[2];
      return table_color(layer.color, (1 - layer.rise_weight) * height + layer.rise_weight * rise);
    }
    case LineColor::magnitude:
      return table_color(layer.color, drawn.magnitude);
    case LineColor::direction:
      return table_color(layer.color, bearing(drawn.unit));
    case LineColor::scalar: {
      const auto value = static_cast<double>(layer.color_field->values[stop.index]);
      return std::isnan(value) ? Vec{0.5, 0.5, 0.5} : table_color(layer.color, value);
    }
    case LineColor::constant:
      break;
  }
  return table_color(layer.color, 0);
}

double ramp(double v, double low, double high) {
  if (high > low) return std::clamp((v - low) / (high - low), 0.0, 1.0);
  return v > low ? 1 : 0;
}

void project(const View& view, const Vec& p, double& x, double& y) {
  const double z = view.perspective ? p[2] : 1;
  x = view.half_width + p[0] / (z * view.pixel);
  y = view.half_height + p[1] / (z * view.pixel);
}

// Clips to the near plane. Returns false if nothing remains.
bool clip_to_near(const View& view, const Vec& p, const Vec& v, Part& part) {
  if (!view.perspective) return part.low <= part.high;
  if (v[2] > 0) part.low = std::max(part.low, (view.near - p[2]) / v[2]);
  if (v[2] < 0) part.high = std::min(part.high, (view.near - p[2]) / v[2]);
  return part.low <= part.high && (v[2] != 0 || p[2] >= view.near);
}

Vec to_camera(const View& view, const Vec& v) {
  return {dot(view.right, v), dot(view.down, v), dot(view.forward, v)};
}

}  // namespace

View make_view(const scene::Camera& camera) {
  View view;
  view.eye = to_vec(camera.eye);
  view.right = to_vec(camera.right);
  view.down = to_vec(-camera.up);
  view.forward = to_vec(camera.forward);
  view.pixel = 2 * camera.half_height / camera.height;
  view.near = camera.near;
  view.half_width = 0.5 * camera.width;
  view.half_height = 0.5 * camera.height;
  view.perspective = camera.perspective;
  return view;
}

std::vector<AxisStop> axis_stops(const Scene& scene, int axis, int stride) {
  const auto& spacing = scene.lattice.spacing[axis];
  if (scene.slice && scene.slice->axis == axis) {
    const int sample = scene.slice->sample;
    return {{sample, 1, spacing[sample]}};
  }
  const int dim = scene.lattice.dims[axis];
  std::vector<AxisStop> stops;
  for (int done = 0; done < dim;) {
    const int samples = std::min(stride, dim - done);
    AxisStop stop{done + (samples - 1) / 2, samples, 0};
    for (int n = 0; n < samples; ++n) stop.cell += spacing[done++];
    stops.push_back(stop);
  }
  return stops;
}

std::vector<LayerGroup> group_layers(const Scene& scene) {
  std::vector<LayerGroup> groups;
  if (scene.vector) groups.push_back({scene.vector->stride, &*scene.vector, {}, {}});
  for (const ScalarLayer& layer : scene.scalars) {
    auto same = std::find_if(groups.begin(), groups.end(),
                             [&](const LayerGroup& g) { return g.stride == layer.stride; });
    if (same == groups.end()) same = groups.insert(same, {layer.stride, nullptr, {}, {}});
    same->media.push_back(&layer);
  }
  for (LayerGroup& group : groups) {
    for (int a = 0; a < 3; ++a) group.axis[a] = axis_stops(scene, a, group.stride);
  }
  return groups;
}

Stop make_stop(const Scene& scene, const View& view, const std::array<AxisStop, 3>& stops) {
  Stop stop;
  Vec world{};
  for (int a = 0; a < 3; ++a) {
    stop.sample[a] = stops[a].sample;
    stop.cell[a] = stops[a].cell;
    world[a] = scene.lattice.positions[a][stops[a].sample];
  }
  stop.index = sample_index(scene.lattice, stop.sample);
  if (scene.lattice.places) {
    world = position_of(scene.lattice, stop.sample);
    stop.edge = curved_edges(scene.lattice, stops);
    stop.has_cell = spans_volume(stop.edge);
    if (stop.has_cell) stop.inverse = inverse_of(stop.edge);
  } else {
    for (int a = 0; a < 3; ++a) {
      stop.edge[a][a] = stops[a].cell;
      stop.inverse[a][a] = 1 / stops[a].cell;
    }
  }
  stop.from_eye = plus(world, -1, view.eye);
  stop.centre = to_camera(view, stop.from_eye);
  return stop;
}

std::optional<Ribbon> make_ribbon(const Scene& scene, const View& view, const VectorLayer& layer,
                                  const Stop& stop) {
  const auto drawn = read_vector(scene, layer, stop);
  if (!drawn) return {};
  const Jitter jitter = jitter_of(layer, stop.sample);
  Vec in_box{};  // centre of the line in its kernel box, cells
  Vec offset{};  // centre of the line from the kernel position, world units
  for (int a = 0; a < 3; ++a) {
    in_box[a] = layer.jitter_center * jitter.centre[a];
    offset = plus(offset, in_box[a] + layer.jitter_stride * jitter.stride[a], stop.edge[a]);
  }
  Part part = clip_to_box(layer, stop, in_box, drawn->extent);
  const Vec p = to_camera(view, plus(stop.from_eye, 1, offset));
  const Vec v = to_camera(view, drawn->extent);
  if (!clip_to_near(view, p, v, part)) return {};
  Ribbon line;
  line.q0 = part.low;
  line.q1 = part.high;
  line.a = plus(p, part.low, v);
  line.b = plus(p, part.high, v);
  if (view.perspective) {
    line.a[2] = std::max(line.a[2], view.near);
    line.b[2] = std::max(line.b[2], view.near);
  }
  project(view, line.a, line.x0, line.y0);
  project(view, line.b, line.x1, line.y1);
  line.r1 = layer.r1;
  line.r2 = layer.r2;
  line.opacity = layer.opacity;
  line.desaturation = layer.head_desaturation;
  line.perspective = view.perspective;
  line.moving = layer.moving;
  const double lift = in_box[2] + layer.jitter_stride * jitter.stride[2];
  const Seen seen{scene.lattice.positions[2][stop.sample[2]] + lift * stop.cell[2], p[2]};
  const double strong = ramp(drawn->magnitude, layer.magnitude_range[0], layer.magnitude_range[1]);
  const double far = ramp(p[2], scene.depth_cue.near, scene.depth_cue.far);
  const double dim =
      (1 - layer.magnitude_intensity * (1 - strong)) * (1 - scene.depth_cue.strength * far);
  line.color = scaled(undimmed_color(scene, layer, stop, *drawn, seen), dim);
  if (layer.moving) {
    const double full = layer.magnitude_range[1];
    const double speed = full > 0 ? std::min(drawn->magnitude / full, 1.0) : 1.0;
    line.phase = jitter.phase + layer.motion_cycles * speed;
  }
  return line;
}

Density make_density(const std::vector<const ScalarLayer*>& layers, const Stop& stop) {
  Density density;
  for (const ScalarLayer* layer : layers) {
    const auto value = static_cast<double>(layer->field->values[stop.index]);
    if (std::isnan(value)) continue;
    const double rho = extinction(*layer, value);
    if (rho <= 0) continue;
    density.rho += rho;
    density.color = plus(density.color, rho, table_color(layer->color, value));
  }
  if (density.rho > 0) density.color = scaled(density.color, 1 / density.rho);
  return density;
}

// M = v v^T - t^2 A A^T: the tangents of the silhouette are at (M13 +- sqrt(M13^2 - M11 M33)) /
// M33.
ScreenBox splat_box(const View& view, const Stop& stop) {
  const auto s = [&](const Vec& p, const Vec& q) {
    double sum = 0;
    for (const Vec& edge : stop.edge) sum += dot(p, edge) * dot(q, edge);
    return footprint_t * footprint_t * sum;
  };
  const double w = view.half_width;
  const double h = view.half_height;
  const Vec& centre = stop.centre;
  if (!view.perspective) {
    const double x = w + centre[0] / view.pixel;
    const double y = h + centre[1] / view.pixel;
    const double dx = std::sqrt(s(view.right, view.right)) / view.pixel;
    const double dy = std::sqrt(s(view.down, view.down)) / view.pixel;
    return {x - dx, x + dx, y - dy, y + dy};
  }
  const double m33 = centre[2] * centre[2] - s(view.forward, view.forward);
  if (m33 <= 0) return {0, 2 * w, 0, 2 * h};
  const auto range = [&](int c, const Vec& axis, double middle, double& low, double& high) {
    const double m11 = centre[c] * centre[c] - s(axis, axis);
    const double m13 = centre[c] * centre[2] - s(axis, view.forward);
    const double root = std::sqrt(std::max(m13 * m13 - m11 * m33, 0.0));
    low = middle + (m13 - root) / m33 / view.pixel;
    high = middle + (m13 + root) / m33 / view.pixel;
  };
  ScreenBox box;
  range(0, view.right, w, box.x0, box.x1);
  range(1, view.down, h, box.y0, box.y1);
  return box;
}

ScreenBox ribbon_box(const Ribbon& line) {
  return {std::min(line.x0, line.x1) - line.r2, std::max(line.x0, line.x1) + line.r2,
          std::min(line.y0, line.y1) - line.r2, std::max(line.y0, line.y1) + line.r2};
}

KernelBounds kernel_bounds(const Scene& scene) {
  KernelBounds bounds;
  for (const LayerGroup& group : group_layers(scene)) {
    std::uint64_t stops = 1;
    for (const auto& axis : group.axis) stops *= axis.size();
    if (group.lines != nullptr) bounds.ribbons += stops;
    if (!group.media.empty()) bounds.splats += stops;
  }
  return bounds;
}

Kernels list_kernels(const Scene& scene, const View& view, const CancelToken& cancel) {
  Kernels kernels;
  list_kernels(scene, view, cancel, kernels);
  return kernels;
}

void list_kernels(const Scene& scene, const View& view, const CancelToken& cancel,
                  Kernels& kernels) {
  for (const LayerGroup& group : group_layers(scene)) {
    for (const AxisStop& z : group.axis[2]) {
      for (const AxisStop& y : group.axis[1]) {
        if (cancel.cancelled()) return;
        for (const AxisStop& x : group.axis[0]) {
          const Stop stop = make_stop(scene, view, {x, y, z});
          if (!stop.has_cell || (view.perspective && stop.centre[2] < view.near)) continue;
          if (group.lines != nullptr) {
            const auto ribbon = make_ribbon(scene, view, *group.lines, stop);
            if (ribbon) kernels.ribbons.push_back(*ribbon);
          }
          const Density density = make_density(group.media, stop);
          if (density.rho <= 0) continue;
          kernels.splats.push_back({stop.from_eye, stop.inverse, density.rho, density.color});
          kernels.splat_boxes.push_back(splat_box(view, stop));
        }
      }
    }
  }
}

}  // namespace windsplat::engine::reference
