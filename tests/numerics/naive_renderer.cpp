// Scene -> picture, one kernel after the other.
#include "tests/numerics/naive_renderer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <tuple>

namespace windsplat::naive {

namespace {

using scene::ColorTable;
using scene::LineColor;
using scene::ScalarLayer;
using scene::Scene;
using scene::VectorLayer;

template <class Real>
using Vec = std::array<Real, 3>;

template <class Real>
Real dot(const Vec<Real>& a, const Vec<Real>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

template <class Real>
Vec<Real> cross(const Vec<Real>& a, const Vec<Real>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// ---- order ----

// Where a stop comes along its axis: bricks of eight outward from the eye's, upward first; inside
// a brick outward from the stop nearest the eye's, upward first.
std::tuple<bool, int, bool, int> place_in_bricks(int stop, int eye, int count) {
  const int brick = stop / 8;
  const int eye_brick = eye / 8;
  const int start = std::clamp(eye, 8 * brick, std::min(8 * brick + 7, count - 1));
  return {brick < eye_brick, std::abs(brick - eye_brick), stop < start, std::abs(stop - start)};
}

struct AxisStops {
  std::vector<int> sample;
  std::vector<double> cell;
  int eye = 0;
  std::vector<int> order;  // stops, first drawn first
};

AxisStops stops_along(const Scene& scene, int a, int stride) {
  AxisStops axis;
  const int dim = scene.lattice.dims[a];
  // A stop stands for `stride` samples, the last one for those that are left.
  for (int done = 0; done < dim;) {
    const int group = std::min(stride, dim - done);
    axis.sample.push_back(done + (group - 1) / 2);
    double width = 0;
    for (int n = 0; n < group; ++n) width += scene.lattice.spacing[a][done++];
    axis.cell.push_back(width);
  }
  const int count = static_cast<int>(axis.sample.size());
  if (scene.camera.perspective) {
    // The stop whose cell, bounded midway to its neighbours, holds the eye.
    for (int i = 1; i < count; ++i) {
      const double border = (scene.lattice.positions[a][axis.sample[i - 1]] +
                             scene.lattice.positions[a][axis.sample[i]]) /
                            2;
      if (scene.camera.eye[a] >= border) axis.eye = i;
    }
  } else {
    axis.eye = scene.camera.forward[a] >= 0 ? 0 : count - 1;
  }
  for (int i = 0; i < count; ++i) axis.order.push_back(i);
  std::sort(axis.order.begin(), axis.order.end(), [&](int p, int q) {
    return place_in_bricks(p, axis.eye, count) < place_in_bricks(q, axis.eye, count);
  });
  return axis;
}

// Layers of one stride.
struct Group {
  int stride = 1;
  const VectorLayer* lines = nullptr;
  std::vector<const ScalarLayer*> media;
  std::array<AxisStops, 3> axis;
};

std::vector<Group> group_layers(const Scene& scene) {
  std::vector<Group> groups;
  if (scene.vector) groups.push_back({scene.vector->stride, &*scene.vector, {}, {}});
  for (const ScalarLayer& layer : scene.scalars) {
    auto same = std::find_if(groups.begin(), groups.end(),
                             [&](const Group& g) { return g.stride == layer.stride; });
    if (same == groups.end()) same = groups.insert(same, {layer.stride, nullptr, {}, {}});
    same->media.push_back(&layer);
  }
  for (Group& group : groups) {
    for (int a = 0; a < 3; ++a) group.axis[a] = stops_along(scene, a, group.stride);
  }
  return groups;
}

// The axis along which the view crosses most cells per unit of length.
int major_axis(const Scene& scene) {
  int best = 0;
  double most = -1;
  for (int a = 0; a < 3; ++a) {
    double width = 0;
    for (const double s : scene.lattice.spacing[a]) width += s / scene.lattice.dims[a];
    const double crossed = std::abs(scene.camera.forward[a]) / width;
    if (crossed > most * (1 + 1e-12)) {
      most = crossed;
      best = a;
    }
  }
  return best;
}

struct Slab {
  bool below;
  int distance;
  int group;
  int stop;
  bool operator<(const Slab& other) const {
    return std::tie(below, distance, group) < std::tie(other.below, other.distance, other.group);
  }
};

std::vector<Slab> order_slabs(const std::vector<Group>& groups, int major) {
  std::vector<Slab> slabs;
  for (int g = 0; g < static_cast<int>(groups.size()); ++g) {
    const AxisStops& axis = groups[g].axis[major];
    for (int i = 0; i < static_cast<int>(axis.sample.size()); ++i) {
      const int ahead = axis.sample[i] - axis.sample[axis.eye];
      slabs.push_back({ahead < 0, std::abs(ahead), g, i});
    }
  }
  std::sort(slabs.begin(), slabs.end());
  return slabs;
}

// ---- what is at a stop ----

std::uint32_t pcg_step(std::uint32_t v) { return v * 1664525U + 1013904223U; }

std::array<std::uint32_t, 3> pcg3d(std::array<std::uint32_t, 3> v) {
  for (auto& c : v) c = pcg_step(c);
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

template <class Real>
Vec<Real> table_color(const ColorTable& table, Real value) {
  const auto last = static_cast<Real>(table.entries.size() - 1);
  const double width = table.range[1] - table.range[0];
  Real place = 0;
  if (width > 0) {
    place = static_cast<Real>((static_cast<double>(value) - table.range[0]) / width) * last;
  } else if (static_cast<double>(value) > table.range[0]) {
    place = last;
  }
  place = std::clamp(place, Real(0), last);
  const auto i = static_cast<std::size_t>(place);
  const auto& a = table.entries[i];
  const auto& b = table.entries[std::min(i + 1, table.entries.size() - 1)];
  const Real f = place - static_cast<Real>(i);
  return {a[0] + f * (b[0] - a[0]), a[1] + f * (b[1] - a[1]), a[2] + f * (b[2] - a[2])};
}

double extinction(const ScalarLayer& layer, double value) {
  const auto& points = layer.extinction;
  if (value < points.front()[0]) return points.front()[1];
  double rho = points.back()[1];
  for (std::size_t p = 0; p + 1 < points.size(); ++p) {
    const double x0 = points[p][0];
    const double x1 = points[p + 1][0];
    if (value >= x0 && value < x1) {
      rho = points[p][1] + (points[p + 1][1] - points[p][1]) * (value - x0) / (x1 - x0);
    }
  }
  return rho;
}

template <class Real>
struct Line {
  bool drawn = false;
  Vec<Real> a{}, b{};                   // ends in camera axes: right, down, forward
  Real x0 = 0, y0 = 0, x1 = 0, y1 = 0;  // projected
  Real q0 = 0, q1 = 0;
  Vec<Real> color{};
  Real r1 = 0, r2 = 0, opacity = 0, desaturation = 0;
};

template <class Real>
struct Medium {
  bool drawn = false;
  Real rho = 0;
  Vec<Real> color{};
};

template <class Real>
class Renderer {
 public:
  explicit Renderer(const Scene& scene)
      : scene_(scene), picture_{scene.camera.width, scene.camera.height, {}} {
    const auto& c = scene.camera;
    for (int a = 0; a < 3; ++a) {
      right_[a] = static_cast<Real>(c.right[a]);
      down_[a] = static_cast<Real>(-c.up[a]);
      forward_[a] = static_cast<Real>(c.forward[a]);
    }
    pixel_ = static_cast<Real>(2 * c.half_height / c.height);
    const std::size_t pixels = static_cast<std::size_t>(c.width) * c.height;
    picture_.rgba.assign(4 * pixels, 0);
    transmittance_.assign(pixels, 1);
  }

  Picture<Real> run() {
    const std::vector<Group> groups = group_layers(scene_);
    const int major = major_axis(scene_);
    const int u = major == 0 ? 1 : 0;
    const int v = major == 2 ? 1 : 2;
    for (const Slab& slab : order_slabs(groups, major)) {
      const Group& group = groups[slab.group];
      std::array<int, 3> stop{};
      stop[major] = slab.stop;
      each_brick(group.axis[v].order, [&](const int* v_first, const int* v_last) {
        each_brick(group.axis[u].order, [&](const int* u_first, const int* u_last) {
          for (const int* p = v_first; p != v_last; ++p) {
            for (const int* q = u_first; q != u_last; ++q) {
              stop[v] = *p;
              stop[u] = *q;
              kernel(group, stop);
            }
          }
        });
      });
    }
    return std::move(picture_);
  }

 private:
  template <class Body>
  static void each_brick(const std::vector<int>& order, const Body& body) {
    const int* first = order.data();
    const int* const end = order.data() + order.size();
    while (first != end) {
      const int* last = first;
      while (last != end && *last / 8 == *first / 8) ++last;
      body(first, last);
      first = last;
    }
  }

  void kernel(const Group& group, const std::array<int, 3>& stop) {
    std::array<int, 3> sample{};
    for (int a = 0; a < 3; ++a) {
      sample[a] = group.axis[a].sample[stop[a]];
      cell_[a] = static_cast<Real>(group.axis[a].cell[stop[a]]);
      world_[a] = scene_.lattice.positions[a][sample[a]];
      from_eye_[a] = static_cast<Real>(world_[a] - scene_.camera.eye[a]);
    }
    const double z = (world_[0] - scene_.camera.eye[0]) * scene_.camera.forward[0] +
                     (world_[1] - scene_.camera.eye[1]) * scene_.camera.forward[1] +
                     (world_[2] - scene_.camera.eye[2]) * scene_.camera.forward[2];
    if (scene_.camera.perspective && z < scene_.camera.near) return;
    centre_ = {dot(right_, from_eye_), dot(down_, from_eye_), dot(forward_, from_eye_)};
    const std::size_t index = static_cast<std::size_t>(sample[0]) +
                              static_cast<std::size_t>(scene_.lattice.dims[0]) *
                                  (static_cast<std::size_t>(sample[1]) +
                                   static_cast<std::size_t>(scene_.lattice.dims[1]) *
                                       static_cast<std::size_t>(sample[2]));
    Line<Real> line;
    Medium<Real> medium;
    if (group.lines != nullptr) line = make_line(*group.lines, sample, index);
    if (!group.media.empty()) medium = make_medium(group, index);
    if (line.drawn || medium.drawn) composite(line, medium);
  }

  Line<Real> make_line(const VectorLayer& layer, const std::array<int, 3>& sample,
                       std::size_t index) {
    Line<Real> line;
    std::array<double, 3> data{};
    for (int c = 0; c < layer.field->components; ++c) data[c] = layer.field->component(c)[index];
    if (std::isnan(data[0])) return line;
    const double m = std::hypot(data[0], data[1], data[2]);
    if (m < layer.min_magnitude || m == 0) return line;
    std::array<double, 3> d{};
    for (int c = 0; c < 3; ++c) d[c] = data[c] / m * layer.scale[c];
    if (!layer.rate_x.empty()) {
      d[0] *= layer.rate_x[sample[1]];
      d[1] *= layer.rate_y;
      d[2] *= layer.rate_z[sample[2]];
    }
    const double norm = std::hypot(d[0], d[1], d[2]);
    if (norm == 0) return line;
    const double length = layer.length * std::clamp(m / layer.magnitude_range[1], 0.0, 1.0);
    // Jitter, then the box about the moved kernel.
    const auto key = pcg3d({layer.seed, layer.epoch, 0x9e3779b9U});
    const auto h = pcg3d({static_cast<std::uint32_t>(sample[0]) + key[0],
                          static_cast<std::uint32_t>(sample[1]) + key[1],
                          static_cast<std::uint32_t>(sample[2]) + key[2]});
    const auto h2 = pcg3d(h);
    Vec<Real> offset{}, extent{};
    Real low = Real(-0.5), high = Real(0.5);
    for (int a = 0; a < 3; ++a) {
      const double us = static_cast<double>(h[a] >> 8U) / 16777216.0 - 0.5;
      const double uc = static_cast<double>(h2[a] >> 8U) / 16777216.0 - 0.5;
      const Real inside = static_cast<Real>(layer.jitter_center * uc) * cell_[a];
      offset[a] = inside + static_cast<Real>(layer.jitter_stride * us) * cell_[a];
      extent[a] = static_cast<Real>(d[a] / norm * length);
      const Real half = static_cast<Real>((layer.overlap ? layer.span : 1.0) / 2) * cell_[a];
      if (std::abs(extent[a]) > Real(1e-30)) {
        const Real p = (-half - inside) / extent[a];
        const Real q = (half - inside) / extent[a];
        low = std::max(low, std::min(p, q));
        high = std::min(high, std::max(p, q));
      } else if (std::abs(inside) > half) {
        return line;
      }
    }
    const Vec<Real> p{centre_[0] + dot(right_, offset), centre_[1] + dot(down_, offset),
                      centre_[2] + dot(forward_, offset)};
    const Vec<Real> v{dot(right_, extent), dot(down_, extent), dot(forward_, extent)};
    offset_ = offset;
    return finish_line(layer, line, p, v, low, high, m, d[2] / norm);
  }

  Line<Real> finish_line(const VectorLayer& layer, Line<Real> line, const Vec<Real>& p,
                         const Vec<Real>& v, Real low, Real high, double m, double rise) {
    const auto near = static_cast<Real>(scene_.camera.near);
    if (scene_.camera.perspective) {
      if (v[2] > 0) low = std::max(low, (near - p[2]) / v[2]);
      if (v[2] < 0) high = std::min(high, (near - p[2]) / v[2]);
      if (v[2] == 0 && p[2] < near) return line;
    }
    if (low > high) return line;
    line.drawn = true;
    line.q0 = low;
    line.q1 = high;
    for (int c = 0; c < 3; ++c) {
      line.a[c] = p[c] + low * v[c];
      line.b[c] = p[c] + high * v[c];
    }
    if (scene_.camera.perspective) {
      line.a[2] = std::max(line.a[2], near);
      line.b[2] = std::max(line.b[2], near);
    }
    project(line.a, line.x0, line.y0);
    project(line.b, line.x1, line.y1);
    line.r1 = static_cast<Real>(layer.r1);
    line.r2 = static_cast<Real>(layer.r2);
    line.opacity = static_cast<Real>(layer.opacity);
    line.desaturation = static_cast<Real>(layer.head_desaturation);
    line.color = line_color(layer, p[2], m, rise);
    return line;
  }

  void project(const Vec<Real>& p, Real& x, Real& y) const {
    const Real z = scene_.camera.perspective ? p[2] : Real(1);
    x = picture_.width / Real(2) + p[0] / (z * pixel_);
    y = picture_.height / Real(2) + p[1] / (z * pixel_);
  }

  Vec<Real> line_color(const VectorLayer& layer, Real view_distance, double m, double rise) {
    const double z = world_[2] + static_cast<double>(offset_[2]);
    const double height =
        (z - scene_.lattice.box_min.z) / (scene_.lattice.box_max.z - scene_.lattice.box_min.z);
    double value = 0;
    if (layer.color_by == LineColor::world_z) value = z;
    if (layer.color_by == LineColor::screen_z) value = static_cast<double>(view_distance);
    if (layer.color_by == LineColor::magnitude) value = m;
    if (layer.color_by == LineColor::rise) {
      value = (1 - layer.rise_weight) * height + layer.rise_weight * (0.5 + 0.5 * rise);
    }
    Vec<Real> color = table_color(layer.color, static_cast<Real>(value));
    const auto part = [](double at, double from, double to) {
      return std::clamp((at - from) / (to - from), 0.0, 1.0);
    };
    const double strong = part(m, layer.magnitude_range[0], layer.magnitude_range[1]);
    const double far =
        part(static_cast<double>(view_distance), scene_.depth_cue.near, scene_.depth_cue.far);
    const double dim =
        (1 - layer.magnitude_intensity * (1 - strong)) * (1 - scene_.depth_cue.strength * far);
    for (Real& c : color) c *= static_cast<Real>(dim);
    return color;
  }

  Medium<Real> make_medium(const Group& group, std::size_t index) const {
    Medium<Real> medium;
    double tolerance = 1e300;
    for (const ScalarLayer* layer : group.media) {
      tolerance = std::min(tolerance, layer->min_optical_depth);
      const double value = layer->field->values[index];
      if (std::isnan(value)) continue;
      const auto rho = static_cast<Real>(std::min(extinction(*layer, value), 1e30));
      if (rho <= 0) continue;
      medium.rho += rho;
      const Vec<Real> color = table_color(layer->color, static_cast<Real>(value));
      for (int c = 0; c < 3; ++c) medium.color[c] += rho * color[c];
    }
    if (medium.rho <= 0) return {};
    for (Real& c : medium.color) c /= medium.rho;
    const Real widest = std::max({cell_[0], cell_[1], cell_[2]});
    medium.drawn = static_cast<double>(medium.rho * widest) / 1.4476982547 >= tolerance;
    return medium;
  }

  struct Box {
    Real x0, x1, y0, y1;
  };

  // The silhouette of the ellipsoid of radius t cells: M = v v^T - t^2 A A^T.
  Box splat_box() const {
    const Real t2 = Real(1.37 * 1.37);
    const auto s = [&](const Vec<Real>& p, const Vec<Real>& q) {
      Real sum = 0;
      for (int a = 0; a < 3; ++a) sum += p[a] * q[a] * cell_[a] * cell_[a];
      return t2 * sum;
    };
    const Real w = picture_.width;
    const Real h = picture_.height;
    if (!scene_.camera.perspective) {
      const Real x = w / 2 + centre_[0] / pixel_;
      const Real y = h / 2 + centre_[1] / pixel_;
      const Real dx = std::sqrt(s(right_, right_)) / pixel_;
      const Real dy = std::sqrt(s(down_, down_)) / pixel_;
      return {x - dx, x + dx, y - dy, y + dy};
    }
    const Real m33 = centre_[2] * centre_[2] - s(forward_, forward_);
    if (m33 <= 0) return {0, w, 0, h};
    const auto range = [&](int c, const Vec<Real>& axis, Real middle, Real& low, Real& high) {
      const Real m11 = centre_[c] * centre_[c] - s(axis, axis);
      const Real m13 = centre_[c] * centre_[2] - s(axis, forward_);
      const Real root = std::sqrt(std::max(m13 * m13 - m11 * m33, Real(0)));
      low = middle + (m13 - root) / m33 / pixel_;
      high = middle + (m13 + root) / m33 / pixel_;
    };
    Box box{};
    range(0, right_, w / 2, box.x0, box.x1);
    range(1, down_, h / 2, box.y0, box.y1);
    return box;
  }

  Box kernel_box(const Line<Real>& line, const Medium<Real>& medium) const {
    Box box{Real(1e30), Real(-1e30), Real(1e30), Real(-1e30)};
    if (medium.drawn) box = splat_box();
    if (line.drawn) {
      box.x0 = std::min(box.x0, std::min(line.x0, line.x1) - line.r2);
      box.x1 = std::max(box.x1, std::max(line.x0, line.x1) + line.r2);
      box.y0 = std::min(box.y0, std::min(line.y0, line.y1) - line.r2);
      box.y1 = std::max(box.y1, std::max(line.y0, line.y1) + line.r2);
    }
    return box;
  }

  void composite(const Line<Real>& line, const Medium<Real>& medium) {
    const Box box = kernel_box(line, medium);
    const auto bound = [](Real v, int size) {
      return static_cast<int>(std::clamp(v, Real(0), static_cast<Real>(size)));
    };
    const int x0 = bound(std::floor(box.x0 - 1), picture_.width);
    const int x1 = bound(std::ceil(box.x1 + 1), picture_.width);
    const int y0 = bound(std::floor(box.y0 - 1), picture_.height);
    const int y1 = bound(std::ceil(box.y1 + 1), picture_.height);
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) pixel(line, medium, x, y);
    }
  }

  static Real footprint(Real r) {
    const Real s = Real(0.48), t = Real(1.37);
    if (r < s) return 1 - r * r / (s * t);
    return r < t ? (t - r) * (t - r) / (t * (t - s)) : Real(0);
  }

  void pixel(const Line<Real>& line, const Medium<Real>& medium, int x, int y) {
    const Real X = (x + Real(0.5) - picture_.width / Real(2)) * pixel_;
    const Real Y = (y + Real(0.5) - picture_.height / Real(2)) * pixel_;
    Vec<Real> ray = forward_;  // forward component 1
    if (scene_.camera.perspective) {
      for (int a = 0; a < 3; ++a) ray[a] += X * right_[a] + Y * down_[a];
    }
    const Vec<Real> d{ray[0] / cell_[0], ray[1] / cell_[1], ray[2] / cell_[2]};
    const Real cells = std::sqrt(dot(d, d));
    Real tau = 0;
    Real closest = centre_[2];  // the view depth at which the ray passes nearest to the sample
    if (medium.drawn) {
      // From the eye in perspective; from the pixel's point of the eye's plane in orthographic.
      Vec<Real> o{};
      for (int a = 0; a < 3; ++a) {
        Real from = from_eye_[a];
        if (!scene_.camera.perspective) from -= X * right_[a] + Y * down_[a];
        o[a] = from / cell_[a];
      }
      const Vec<Real> c = cross(o, d);
      closest = dot(o, d) / dot(d, d);
      const Real r = std::sqrt(dot(c, c)) / cells;
      tau = medium.rho * footprint(r) * std::sqrt(dot(ray, ray)) / (Real(1.4476982547) * cells);
    }
    Real opacity = 0, tf = 0;
    Vec<Real> color{};
    if (line.drawn) line_at(line, x, y, closest, cells, tau, opacity, tf, color);
    if (tau == 0 && opacity == 0) return;
    add(static_cast<std::size_t>(y) * picture_.width + x, tau, opacity, tf, medium.color, color);
  }

  void line_at(const Line<Real>& line, int x, int y, Real closest, Real cells, Real tau,
               Real& opacity, Real& tf, Vec<Real>& color) const {
    const Real ux = line.x1 - line.x0;
    const Real uy = line.y1 - line.y0;
    const Real px = x + Real(0.5) - line.x0;
    const Real py = y + Real(0.5) - line.y0;
    const Real eps = Real(1e-6) * line.r2;
    const Real w = Real(0.5) + std::clamp(((px - ux / 2) * ux + (py - uy / 2) * uy) /
                                              std::max(ux * ux + uy * uy, eps * eps),
                                          Real(-0.5), Real(0.5));
    const Real distance = std::hypot(px - w * ux, py - w * uy);
    if (distance >= line.r2) return;
    opacity =
        line.opacity * (distance <= line.r1 ? Real(1) : (line.r2 - distance) / (line.r2 - line.r1));
    Real f = w;
    if (scene_.camera.perspective) {
      const Real inverse_z = (1 - w) / line.a[2] + w / line.b[2];
      f = w / line.b[2] / inverse_z;
    }
    const Real q = line.q0 + f * (line.q1 - line.q0);
    const Real z = line.a[2] + f * (line.b[2] - line.a[2]);
    const Real grey = line.desaturation * (q + Real(0.5));
    const Real top = std::max({line.color[0], line.color[1], line.color[2]});
    for (int c = 0; c < 3; ++c) color[c] = line.color[c] + grey * (top - line.color[c]);
    const Real place = std::clamp(Real(0.5) + (z - closest) * cells, Real(0), Real(1));
    tf = place > 0 ? tau * place : Real(0);
  }

  // A = -expm1(-tau) + a exp(-tau), I = c_s A + a exp(-tf) (c_v - c_s), `over` front to back.
  void add(std::size_t index, Real tau, Real opacity, Real tf, const Vec<Real>& medium,
           const Vec<Real>& line) {
    Real& t = transmittance_[index];
    const Real alpha = -std::expm1(-tau) + opacity * std::exp(-tau);
    const Real own = opacity * std::exp(-tf);
    Real* to = picture_.rgba.data() + 4 * index;
    for (int c = 0; c < 3; ++c) to[c] += t * (medium[c] * alpha + own * (line[c] - medium[c]));
    to[3] += t * alpha;
    t *= std::exp(-tau) * (1 - opacity);
  }

  const Scene& scene_;
  Picture<Real> picture_;
  std::vector<Real> transmittance_;
  Vec<Real> right_{}, down_{}, forward_{};
  Real pixel_ = 1;
  // The kernel at hand.
  Vec<Real> cell_{}, from_eye_{}, centre_{}, offset_{};
  std::array<double, 3> world_{};
};

}  // namespace

template <class Real>
Picture<Real> render(const scene::Scene& scene) {
  return Renderer<Real>(scene).run();
}

template Picture<double> render<double>(const scene::Scene& scene);
template Picture<float> render<float>(const scene::Scene& scene);

}  // namespace windsplat::naive
