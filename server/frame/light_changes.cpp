// Rays near samples -> light of the splats that they cross -> differences.
#include "server/frame/light_changes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "server/base/pcg3d.hpp"
#include "server/engine/reference/kernels.hpp"

namespace windsplat::frame {
namespace {

namespace reference = engine::reference;

constexpr std::uint32_t bundles_most = 256;
constexpr int steps_most = 64;       // of a ray through the lattice
constexpr double dark_below = 1e-4;  // light from behind is left out
constexpr int reach = 4;             // cells of a layer on either side of a ray that are kept
constexpr int wide = 2 * reach + 1;

// Rays of a bundle: one, then on both sides of it, along the two axes across it at each distance in
// cells, and along the two of the picture at each distance in it.
constexpr std::size_t in_cells = 1;
constexpr std::size_t in_picture = in_cells + 4 * quality::cells_apart.size();
constexpr std::size_t rays_count = in_picture + 4 * quality::distances_count;

// The weight of the splat of a cell at so many cells from its centre, squared.
double splat_weight(double r2) {
  constexpr double s = reference::footprint_s;
  constexpr double t = reference::footprint_t;
  if (r2 >= t * t) return 0;
  if (r2 <= s * s) return (1 - r2 / (s * t)) / reference::footprint_integral;
  const double rest = t - std::sqrt(r2);
  return rest * rest / (t * (t - s) * reference::footprint_integral);
}

// The first ray of a bundle, followed in steps of `stride` cells of `axis`.
struct Ray {
  Index through{};
  std::array<double, 2> aside{};  // cells from the sample, along the two other axes
  std::array<double, 3> rate{};   // cells passed along each axis for each unit of length
  std::size_t axis = 0;
  int stride = 1;
  double length = 0;  // of a step
  double depth = 0;   // of the sample
  double pace = 1;    // depth for each unit of length
  double scale = 1;   // heights of the picture per world unit
  double face = 0;    // area of a cell across the ray
  double cells = 1;   // that it passes
  // Cells along each axis by which one height of the picture displaces it at the depth 1, to the
  // right and downwards.
  std::array<std::array<double, 3>, 2> displaced{};
};

// Another ray of its bundle: cells from the first one along the two axes, in the layer of the
// sample and for each layer behind.
struct Beside {
  std::array<double, 2> cells{};
  std::array<double, 2> turned{};
  double length = 0;  // of a step
};
using Bundle = std::array<Beside, rays_count>;

// A ray displaced by so many cells along each axis, at the depth 1 if the view is in perspective.
Beside beside(const Ray& ray, const std::array<double, 3>& by, bool perspective) {
  const double along = ray.rate[ray.axis] / ray.pace;
  const double own = by[ray.axis];
  // Layers passed for each unit of depth; a ray along the layers is not followed further.
  const double turned = perspective ? std::max(0.2, 1 + own / along) * along : along;
  Beside out;
  out.length = ray.stride / (std::abs(turned) * ray.pace);
  for (std::size_t n = 0; n < 2; ++n) {
    const std::size_t a = (ray.axis + 1 + n) % 3;
    const double rate = ray.rate[a] / ray.pace;
    if (perspective) {
      const double there = (rate + by[a]) / turned;
      out.cells[n] = ray.depth * (by[a] - there * own);
      out.turned[n] = there - rate / along;
    } else {
      out.cells[n] = by[a] - rate / along * own;
    }
  }
  return out;
}

Bundle bundle_of(const Ray& ray, bool perspective) {
  Bundle out;
  for (std::size_t n = 0; n < rays_count; ++n) {
    const double sign = n % 2 == 1 ? 1 : -1;
    const std::size_t axis = (n - 1) / 2 % 2;
    if (n >= in_picture) {
      const double distance = sign * quality::distances[(n - in_picture) / 4];
      std::array<double, 3> by = ray.displaced[axis];
      for (double& cells : by) cells *= distance;
      out[n] = beside(ray, by, perspective);
    } else {
      if (n > 0) out[n].cells[axis] = sign * quality::cells_apart[(n - in_cells) / 4];
      out[n].length = ray.length;
    }
  }
  return out;
}

// The media of the cells of a layer around a ray.
class Layer {
 public:
  // The layer of `at`, around `centre` in cells along the axes `first` and `second`.
  Layer(const DrawnSamples& samples, const Index& at, std::size_t first, std::size_t second,
        const std::array<double, 2>& centre)
      : samples_(samples), at_(at), axes_{first, second} {
    for (std::size_t a = 0; a < 2; ++a) {
      middle_[a] = static_cast<int>(std::lround(centre[a]));
      from_[a] = centre[a] - middle_[a];
    }
  }

  // What a ray at so many cells from the centre crosses.
  Medium at(double cells, double cells_of_second) {
    const double x = from_[0] + cells;
    const double y = from_[1] + cells_of_second;
    constexpr double t = reference::footprint_t;
    const int right = static_cast<int>(std::floor(x + t));
    const int bottom = static_cast<int>(std::floor(y + t));
    Medium out;
    for (int j = static_cast<int>(std::ceil(y - t)); j <= bottom; ++j) {
      for (int i = static_cast<int>(std::ceil(x - t)); i <= right; ++i) {
        const double share = splat_weight((x - i) * (x - i) + (y - j) * (y - j));
        if (share <= 0) continue;
        const Medium& cell = medium(i, j);
        out.extinction += share * cell.extinction;
        out.emission += share * cell.emission;
      }
    }
    return out;
  }

 private:
  const Medium& medium(int i, int j) {
    const bool keeps = std::abs(i) <= reach && std::abs(j) <= reach;
    const std::size_t n = keeps ? static_cast<std::size_t>((j + reach) * wide + i + reach) : 0;
    Medium& cell = keeps ? cells_[n] : other_;
    if (keeps && known_[n]) return cell;
    at_[axes_[0]] = middle_[0] + i;
    at_[axes_[1]] = middle_[1] + j;
    cell = samples_.contains(at_) ? samples_.medium(at_) : Medium();
    if (keeps) known_[n] = true;
    return cell;
  }

  const DrawnSamples& samples_;
  Index at_;
  std::array<std::size_t, 2> axes_;
  std::array<int, 2> middle_{};
  std::array<double, 2> from_{};  // of the ray from the centre of the cell in the middle
  std::array<Medium, std::size_t{wide} * wide> cells_;
  std::array<bool, std::size_t{wide} * wide> known_{};
  Medium other_;
};

struct Lights {
  std::array<glm::dvec4, rays_count> light{};
  std::array<double, rays_count> transmitted{};
  glm::dvec3 order{0, 0, 0};
  glm::dvec3 last_color{0, 0, 0};
  double last_absorbed = 0;

  // `behind`: layers from that of the sample.
  void pass(Layer& layer, const Bundle& bundle, int behind, int stride) {
    for (std::size_t n = 0; n < rays_count; ++n) {
      if (transmitted[n] < dark_below) continue;
      const Beside& ray = bundle[n];
      const Medium here =
          layer.at(ray.cells[0] + behind * ray.turned[0], ray.cells[1] + behind * ray.turned[1]);
      if (!(here.extinction > 0)) continue;
      if (n == 0) change_order(here, ray.length / stride, stride);
      const double absorbed = -transmitted[n] * std::expm1(-here.extinction * ray.length);
      light[n] += absorbed * glm::dvec4(here.color(), 1);
      transmitted[n] -= absorbed;
    }
  }
  [[nodiscard]] bool is_opaque() const {
    return *std::max_element(transmitted.begin(), transmitted.end()) < dark_below;
  }

 private:
  void change_order(const Medium& here, double cell, int stride) {
    const double own = -std::expm1(-here.extinction * cell);
    if (last_absorbed > 0) {
      const glm::dvec3 change = transmitted[0] * own * last_absorbed * (here.color() - last_color);
      order += static_cast<double>(stride) * change;
    }
    last_color = here.color();
    last_absorbed = own;
  }
};

class Rays {
 public:
  explicit Rays(const DrawnSamples& samples) : samples_(samples) {}

  // Rays evenly over the picture: samples are taken by the area for which they stand.
  [[nodiscard]] LightChanges changes(const std::vector<RayThrough>& through,
                                     const CancelToken& cancel) const {
    std::vector<std::pair<Ray, double>> rays;
    rays.reserve(through.size());
    double whole = 0;
    for (const RayThrough& one : through) {
      auto ray = ray_through(one.sample);
      if (!ray) continue;
      whole += one.stands_for * ray->face * ray->scale * ray->scale / ray->cells;
      rays.emplace_back(*ray, whole);
    }
    LightChanges out;
    const double area = whole / bundles_most;
    std::uint32_t taken = 0;
    for (auto& [ray, up_to] : rays) {
      for (; taken < bundles_most && (taken + 0.5) * area < up_to; ++taken) {
        if (cancel.cancelled()) return out;
        // Within the splat of the sample, at random.
        const auto random = pcg3d({taken, 31, 37});
        for (std::size_t a = 0; a < 2; ++a) {
          ray.aside[a] = (2 * (random[a] / 4294967296.0) - 1) * 1.25;
        }
        add(ray, area, out);
      }
    }
    return out;
  }

 private:
  void add(const Ray& ray, double area, LightChanges& out) const {
    const Lights lights = lights_of(ray);
    const auto square = [](const glm::dvec4& v) { return glm::dot(v, v) / 4; };
    const auto& light = lights.light;
    const auto bend = [&](std::size_t n) {
      return square(light[n] + light[n + 1] - 2.0 * light[0]);
    };
    double step = 0;
    for (std::size_t n = in_cells; n < in_cells + 4; ++n)
      step += 0.25 * square(light[n] - light[0]);
    for (std::size_t k = 0; k < quality::cells_apart.size(); ++k) {
      const std::size_t n = in_cells + 4 * k;
      out.cell_bends[k].add(0.5 * (bend(n) + bend(n + 2)), area);
    }
    for (std::size_t k = 0; k < quality::distances_count; ++k) {
      const std::size_t n = in_picture + 4 * k;
      out.bends[k].add(0.5 * (bend(n) + bend(n + 2)), area);
      out.shifts[k].add(square(light[n] - light[n + 1]), area);
    }
    out.step.add(step, area);
    out.order.add(glm::dot(lights.order, lights.order), area);
    out.cell.add(std::sqrt(ray.face) * ray.scale, area * step);
  }

  [[nodiscard]] std::optional<Ray> ray_through(const Index& through) const {
    const scene::Camera& camera = samples_.scene().camera;
    const glm::dvec3 at = samples_.place(through);
    const glm::dvec3 way =
        camera.perspective ? glm::normalize(at - camera.eye) : glm::dvec3(camera.forward);
    Ray out;
    out.through = through;
    out.depth = glm::dot(at - camera.eye, camera.forward);
    out.pace = glm::dot(way, camera.forward);
    for (std::size_t a = 0; a < 3; ++a) {
      const glm::dvec3 edge = edge_of(through, a);
      const double length2 = glm::dot(edge, edge);
      if (length2 == 0) continue;
      out.rate[a] = glm::dot(way, edge) / length2;
      const double height = 2 * camera.half_height;
      out.displaced[0][a] = height * glm::dot(glm::dvec3(camera.right), edge) / length2;
      out.displaced[1][a] = -height * glm::dot(glm::dvec3(camera.up), edge) / length2;
      if (std::abs(out.rate[a]) > std::abs(out.rate[out.axis])) out.axis = a;
    }
    if (out.rate[out.axis] == 0) return std::nullopt;
    const int cells = samples_.high()[out.axis] - samples_.low()[out.axis];
    out.stride = (cells + steps_most - 1) / steps_most;
    out.length = out.stride / std::abs(out.rate[out.axis]);
    out.scale = 0.5 / (camera.half_height * (camera.perspective ? out.depth : 1));
    out.face = samples_.edge(through, 0) * samples_.edge(through, 1) * samples_.edge(through, 2) *
               std::abs(out.rate[out.axis]);
    out.cells = cells_of(out);
    return out;
  }

  // From a sample to the next one. Along an axis of one sample that of its cell, which is across
  // the two others on curved lattices; 0 if these have no plane.
  [[nodiscard]] glm::dvec3 edge_of(const Index& i, std::size_t a) const {
    const auto next = samples_.neighbour(i, a, 1);
    const auto last = samples_.neighbour(i, a, -1);
    if (next) return samples_.place(*next) - samples_.place(i);
    if (last) return samples_.place(i) - samples_.place(*last);
    glm::dvec3 way{0, 0, 0};
    way[static_cast<glm::length_t>(a)] = 1;
    if (samples_.scene().lattice.places) {
      std::array<glm::dvec3, 2> across{};
      for (std::size_t n = 0; n < 2; ++n) {
        const std::size_t other = (a + 1 + n) % 3;
        const auto beyond = samples_.neighbour(i, other, 1);
        const auto before = samples_.neighbour(i, other, -1);
        if (!beyond && !before) return {0, 0, 0};
        across[n] = samples_.place(beyond ? *beyond : i) - samples_.place(before ? *before : i);
      }
      way = glm::cross(across[0], across[1]);
      const double length = glm::length(way);
      if (length == 0) return way;
      way /= length;
    }
    return samples_.edge(i, a) * way;
  }

  // The cells of the lattice that a ray passes in front of the camera.
  [[nodiscard]] double cells_of(const Ray& ray) const {
    const scene::Camera& camera = samples_.scene().camera;
    double from = camera.perspective ? (camera.near - ray.depth) / ray.pace : -1e300;
    double to = 1e300;
    for (std::size_t a = 0; a < 3; ++a) {
      if (ray.rate[a] == 0) continue;
      const double low = (samples_.low()[a] - 0.5 - ray.through[a]) / ray.rate[a];
      const double high = (samples_.high()[a] - 0.5 - ray.through[a]) / ray.rate[a];
      from = std::max(from, std::min(low, high));
      to = std::min(to, std::max(low, high));
    }
    return std::max(1.0, (to - from) * std::abs(ray.rate[ray.axis]));
  }

  [[nodiscard]] Lights lights_of(const Ray& ray) const {
    const scene::Camera& camera = samples_.scene().camera;
    const std::size_t first = (ray.axis + 1) % 3;
    const std::size_t second = (ray.axis + 2) % 3;
    const int cells = samples_.high()[ray.axis] - samples_.low()[ray.axis];
    const bool ascends = ray.rate[ray.axis] > 0;
    const Bundle bundle = bundle_of(ray, camera.perspective);
    Lights out;
    out.transmitted.fill(1);
    for (int n = 0; n < cells; n += ray.stride) {
      Index i = ray.through;
      i[ray.axis] = ascends ? samples_.low()[ray.axis] + n : samples_.high()[ray.axis] - 1 - n;
      const int behind = i[ray.axis] - ray.through[ray.axis];
      const double gone = behind / ray.rate[ray.axis];
      if (camera.perspective && ray.depth + gone * ray.pace < camera.near) continue;
      const std::array<double, 2> centre{i[first] + gone * ray.rate[first] + ray.aside[0],
                                         i[second] + gone * ray.rate[second] + ray.aside[1]};
      Layer layer(samples_, i, first, second, centre);
      out.pass(layer, bundle, behind, ray.stride);
      if (out.is_opaque()) break;
    }
    return out;
  }

  const DrawnSamples& samples_;
};

}  // namespace

LightChanges light_changes(const DrawnSamples& samples, const std::vector<RayThrough>& through,
                           const CancelToken& cancel) {
  return Rays(samples).changes(through, cancel);
}

}  // namespace windsplat::frame
