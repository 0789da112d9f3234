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

constexpr std::uint32_t rays_most = 256;
constexpr int reach = 4;  // cells of a layer on either side of a ray
constexpr int wide = 2 * reach + 1;

// Rays of a bundle: one, then on both sides along the two axes across it, at each distance.
constexpr std::size_t rays_count = 1 + 4 * quality::bends_count;
struct Offset {
  std::array<double, 2> cells{};
};
constexpr std::array<Offset, rays_count> offsets_of_bundle() {
  std::array<Offset, rays_count> out{};
  for (std::size_t n = 1; n < rays_count; ++n) {
    const double distance = quality::bend_distances[(n - 1) / 4];
    out[n].cells[(n - 1) / 2 % 2] = n % 2 == 1 ? distance : -distance;
  }
  return out;
}
constexpr std::array<Offset, rays_count> offsets = offsets_of_bundle();

// The weight of the splat of a cell at so many cells from its centre, squared.
double splat_weight(double r2) {
  constexpr double s = reference::footprint_s;
  constexpr double t = reference::footprint_t;
  if (r2 >= t * t) return 0;
  if (r2 <= s * s) return (1 - r2 / (s * t)) / reference::footprint_integral;
  const double rest = t - std::sqrt(r2);
  return rest * rest / (t * (t - s) * reference::footprint_integral);
}

// A ray, followed in steps of `stride` cells of `axis`.
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
};

// The media of the cells of a layer around a ray.
class Layer {
 public:
  // The layer of `at`, around `centre` in cells along the axes `first` and `second`.
  Layer(const DrawnSamples& samples, Index at, std::size_t first, std::size_t second,
        const std::array<double, 2>& centre) {
    const int i = static_cast<int>(std::lround(centre[0]));
    const int j = static_cast<int>(std::lround(centre[1]));
    from_ = {centre[0] - i, centre[1] - j};
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) {
        if (std::abs(x) > 2 && std::abs(y) > 2) continue;  // no ray passes there
        at[first] = i + x;
        at[second] = j + y;
        if (samples.contains(at)) cells_[number(x, y)] = samples.medium(at);
        is_empty_ = is_empty_ && !(cells_[number(x, y)].extinction > 0);
      }
    }
  }
  [[nodiscard]] bool is_empty() const { return is_empty_; }

  // What a ray at an offset in cells crosses.
  [[nodiscard]] Medium at(const Offset& offset) const {
    const double x = from_[0] + offset.cells[0];
    const double y = from_[1] + offset.cells[1];
    constexpr double t = reference::footprint_t;
    const int right = static_cast<int>(std::floor(x + t));
    const int bottom = static_cast<int>(std::floor(y + t));
    Medium out;
    for (int j = static_cast<int>(std::ceil(y - t)); j <= bottom; ++j) {
      for (int i = static_cast<int>(std::ceil(x - t)); i <= right; ++i) {
        const Medium& cell = cells_[number(i, j)];
        if (!(cell.extinction > 0)) continue;
        const double share = splat_weight((x - i) * (x - i) + (y - j) * (y - j));
        out.extinction += share * cell.extinction;
        out.emission += share * cell.emission;
      }
    }
    return out;
  }

 private:
  static std::size_t number(int x, int y) {
    return static_cast<std::size_t>(y + reach) * std::size_t{wide} +
           static_cast<std::size_t>(x + reach);
  }
  std::array<Medium, std::size_t{wide} * wide> cells_{};
  std::array<double, 2> from_{};  // of the ray from the centre of the cell in the middle
  bool is_empty_ = true;
};

struct Lights {
  std::array<glm::dvec4, rays_count> light{};
  std::array<double, rays_count> transmitted{};
  glm::dvec3 order{0, 0, 0};
  glm::dvec3 last_color{0, 0, 0};
  double last_absorbed = 0;

  void pass(const Layer& layer, double length, int stride) {
    for (std::size_t n = 0; n < rays_count; ++n) {
      const Medium here = layer.at(offsets[n]);
      if (!(here.extinction > 0)) continue;
      if (n == 0) change_order(here, length / stride, stride);
      const double absorbed = -transmitted[n] * std::expm1(-here.extinction * length);
      light[n] += absorbed * glm::dvec4(here.color(), 1);
      transmitted[n] -= absorbed;
    }
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
  [[nodiscard]] LightChanges changes(const std::vector<RayThrough>& through) const {
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
    const double area = whole / rays_most;
    std::uint32_t taken = 0;
    for (auto& [ray, up_to] : rays) {
      for (; taken < rays_most && (taken + 0.5) * area < up_to; ++taken) {
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
    double step = 0;
    for (std::size_t k = 0; k < quality::bends_count; ++k) {
      double bend = 0;
      double incline = 0;
      for (std::size_t n = 1 + 4 * k; n < 5 + 4 * k; n += 2) {
        bend += 0.5 * square(light[n] + light[n + 1] - 2.0 * light[0]);
        incline += 0.5 * square(light[n] - light[n + 1]);
        if (quality::bend_distances[k] == 1) {
          step += 0.25 * (square(light[n] - light[0]) + square(light[n + 1] - light[0]));
        }
      }
      out.bends[k].add(bend, area);
      if (k == 0) out.incline.add(incline / std::pow(2 * quality::bend_distances[0], 2), area);
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
      const auto next = samples_.neighbour(through, a, 1);
      const auto last = samples_.neighbour(through, a, -1);
      if (!next && !last) continue;
      const glm::dvec3 edge = next ? samples_.place(*next) - at : at - samples_.place(*last);
      const double length2 = glm::dot(edge, edge);
      if (length2 == 0) continue;
      out.rate[a] = glm::dot(way, edge) / length2;
      if (std::abs(out.rate[a]) > std::abs(out.rate[out.axis])) out.axis = a;
    }
    if (out.rate[out.axis] == 0) return std::nullopt;
    constexpr int steps_most = 64;
    const int cells = samples_.high()[out.axis] - samples_.low()[out.axis];
    out.stride = (cells + steps_most - 1) / steps_most;
    out.length = out.stride / std::abs(out.rate[out.axis]);
    out.scale = 0.5 / (camera.half_height * (camera.perspective ? out.depth : 1));
    out.face = samples_.edge(through, 0) * samples_.edge(through, 1) * samples_.edge(through, 2) *
               std::abs(out.rate[out.axis]);
    out.cells = cells_of(out);
    return out;
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
    Lights out;
    out.transmitted.fill(1);
    for (int n = 0; n < cells; n += ray.stride) {
      Index i = ray.through;
      i[ray.axis] = ascends ? samples_.low()[ray.axis] + n : samples_.high()[ray.axis] - 1 - n;
      const double gone = (i[ray.axis] - ray.through[ray.axis]) / ray.rate[ray.axis];
      if (camera.perspective && ray.depth + gone * ray.pace < camera.near) continue;
      const std::array<double, 2> centre{i[first] + gone * ray.rate[first] + ray.aside[0],
                                         i[second] + gone * ray.rate[second] + ray.aside[1]};
      const Layer layer(samples_, i, first, second, centre);
      if (!layer.is_empty()) out.pass(layer, ray.length, ray.stride);
    }
    return out;
  }

  const DrawnSamples& samples_;
};

}  // namespace

LightChanges light_changes(const DrawnSamples& samples, const std::vector<RayThrough>& through) {
  return Rays(samples).changes(through);
}

}  // namespace windsplat::frame
