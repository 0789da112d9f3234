// Samples that a picture shows -> places in it.
#include "server/frame/ray_places.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "server/base/pcg3d.hpp"

namespace windsplat::frame {
namespace {

namespace reference = engine::reference;

constexpr std::uint32_t places_bits = 10;
static_assert(places_count == 1U << places_bits);
constexpr int pixels_few = 64;
// Fewer samples do not tell where a picture shows something with the eye among kernels.
constexpr std::size_t samples_few = 256;

// The bits of a number in reverse.
std::uint32_t nth_place(std::uint32_t n) {
  std::uint32_t out = 0;
  for (std::uint32_t bit = 0; bit < places_bits; ++bit)
    out |= (n >> bit & 1U) << (places_bits - 1 - bit);
  return out;
}

// A pixel shows what its middle shows: of few pixels each is tried, since cells may be much
// smaller.
bool is_each_pixel_tried(const scene::Camera& camera) {
  return std::int64_t{camera.width} * camera.height <= pixels_few;
}

// Places spread evenly over the part of a picture where the lattice is, or, if that is not known
// from samples, over the picture; of a small picture each pixel.
class Places {
 public:
  explicit Places(const RayKernels& kernels)
      : view_(kernels.view()), samples_(kernels.samples()), reach_(reach()) {}

  [[nodiscard]] Spread spread(const std::vector<RayThrough>& through) const {
    if (reach_ && is_each_pixel_tried(samples_.scene().camera)) return each_pixel();
    struct Candidate {
      Index sample{};
      Vec at{};
      double pixels = 0;  // per world unit
      double up_to = 0;   // sum of areas
    };
    std::vector<Candidate> candidates;
    Spread out;
    for (const RayThrough& one : through) {
      const Vec at = reference::to_camera(view_, from_eye(one.sample));
      if (view_.perspective && at[2] <= view_.near) continue;
      const double pixels = 1 / (view_.pixel * (view_.perspective ? at[2] : 1));
      out.area += one.stands_for * face(one.sample) * pixels * pixels;
      candidates.push_back({one.sample, at, pixels, out.area});
    }
    // Beside the eye, kernels are seen whose samples are behind it.
    const bool surrounded = view_.perspective && reach_ && reach_->surrounds_eye;
    if (reach_ && (candidates.empty() || (surrounded && candidates.size() < samples_few)))
      return over_picture();
    for (const Candidate& one : candidates) {
      while (out.places.size() < places_count) {
        const auto taken = static_cast<std::uint32_t>(out.places.size());
        if ((taken + 0.5) * out.area >= one.up_to * places_count) break;
        out.places.push_back(place_near(one.sample, one.at, one.pixels, taken));
      }
    }
    return out;
  }

 private:
  // What kernels of an even lattice reach, from the eye, world units.
  struct Reach {
    Vec low{};
    Vec high{};
    bool surrounds_eye = true;
  };
  [[nodiscard]] std::optional<Reach> reach() const {
    const scene::Scene& scene = samples_.scene();
    if (scene.lattice.places) return std::nullopt;
    int stride = 1;
    for (const scene::ScalarLayer& layer : scene.scalars) stride = std::max(stride, layer.stride);
    if (scene.vector) stride = std::max(stride, scene.vector->stride);
    const double line = scene.vector ? 0.5 * scene.vector->length : 0;
    Reach out;
    for (std::size_t a = 0; a < 3; ++a) {
      out.low[a] = 1e300;
      out.high[a] = -1e300;
      for (const int end : {samples_.low()[a], samples_.high()[a] - 1}) {
        Index i = samples_.low();
        i[a] = end;
        const double beyond = stride * reference::footprint_t * samples_.edge(i, a) + line;
        const double at = from_eye(i)[a];
        out.low[a] = std::min(out.low[a], at - beyond);
        out.high[a] = std::max(out.high[a], at + beyond);
      }
      out.surrounds_eye = out.surrounds_eye && out.low[a] <= 0 && out.high[a] >= 0;
    }
    return out;
  }
  // The sample nearest to where a ray enters what kernels reach, beyond the near plane; nothing if
  // it does not.
  [[nodiscard]] std::optional<Index> first_sample(const PictureRay& ray) const {
    double from = view_.perspective ? view_.near : -1e300;
    double to = 1e300;
    for (std::size_t a = 0; a < 3; ++a) {
      const double rate = ray.direction[a];
      const double low = reach_->low[a] - ray.origin[a];
      const double high = reach_->high[a] - ray.origin[a];
      if (std::abs(rate) < 1e-12) {
        if (low > 0 || high < 0) return std::nullopt;
        continue;
      }
      from = std::max(from, std::min(low / rate, high / rate));
      to = std::min(to, std::max(low / rate, high / rate));
    }
    if (from > to) return std::nullopt;
    const Vec at = reference::plus(ray.origin, from, ray.direction);
    Index out = samples_.low();
    for (std::size_t a = 0; a < 3; ++a) {
      double nearest = 1e300;
      Index i = samples_.low();
      for (; i[a] < samples_.high()[a]; ++i[a]) {
        const double away = std::abs(from_eye(i)[a] - at[a]);
        if (away < nearest) out[a] = i[a];
        nearest = std::min(nearest, away);
      }
    }
    return out;
  }
  [[nodiscard]] Spread each_pixel() const {
    const scene::Camera& camera = samples_.scene().camera;
    Spread out;
    out.empty = true;
    out.area = static_cast<double>(camera.width) * camera.height;
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) add_pixel(x, y, out);
    }
    return out;
  }
  void add_pixel(double x, double y, Spread& to) const {
    const auto near = first_sample(picture_ray(view_, x + 0.5, y + 0.5));
    to.places.push_back({near.value_or(Index{}), x, y, near.has_value()});
    to.empty = to.empty && !near;
  }
  // One place in each part of a grid, at random, in the order of a quadtree.
  [[nodiscard]] Spread over_picture() const {
    constexpr double parts = 1U << places_bits / 2;  // along each edge
    Spread out;
    out.empty = true;
    out.area = 4 * view_.half_width * view_.half_height;
    for (std::uint32_t n = 0; n < places_count; ++n) {
      std::array<std::uint32_t, 2> part{};
      for (std::uint32_t bit = 0; bit < places_bits; ++bit)
        part[bit % 2] |= (n >> bit & 1U) << bit / 2;
      const auto random = pcg3d({n, 47, 53});
      const auto within = [&](std::size_t a, double half) {
        return std::floor(2 * half * (part[a] + random[a] / 4294967296.0) / parts);
      };
      add_pixel(within(0, view_.half_width), within(1, view_.half_height), out);
    }
    return out;
  }
  // At random within the cell of a sample and 0.2 cells around, and within the picture if it may
  // be: the area for which samples stand is that in the picture, and cells may be larger than it.
  [[nodiscard]] Place place_near(const Index& i, const Vec& at, double pixels,
                                 std::uint32_t taken) const {
    constexpr std::uint32_t tries_most = 16;
    constexpr double wide = 1.4;  // cells
    std::array<std::array<double, 3>, 2>
        across{};  // pixels, along the picture's axes, of each edge
    std::array<double, 2> half{};
    for (std::size_t a = 0; a < 3; ++a) {
      const Vec edge = edge_of(i, a);
      across[0][a] = wide * pixels * reference::dot(edge, view_.right);
      across[1][a] = wide * pixels * reference::dot(edge, view_.down);
      for (std::size_t b = 0; b < 2; ++b) half[b] += 0.5 * std::abs(across[b][a]);
    }
    const std::array<double, 2> size{2 * view_.half_width, 2 * view_.half_height};
    const std::array<double, 2> middle{view_.half_width + at[0] * pixels,
                                       view_.half_height + at[1] * pixels};
    const auto is_inside = [&](double x, double y) {
      return x >= 0 && y >= 0 && x < size[0] && y < size[1];
    };
    const auto share = [](std::uint32_t bits) { return bits / 4294967296.0; };
    for (std::uint32_t n = 0; n < tries_most; ++n) {
      const auto random = pcg3d({taken, 41, 43 + n});
      std::array<double, 2> to = middle;
      for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t b = 0; b < 2; ++b) to[b] += (share(random[a]) - 0.5) * across[b][a];
      }
      if (is_inside(to[0], to[1])) return {i, std::floor(to[0]), std::floor(to[1]), true};
    }
    const auto random = pcg3d({taken, 41, 43 + tries_most});
    std::array<double, 2> to{};
    for (std::size_t b = 0; b < 2; ++b) {
      const double low = std::max(0.0, middle[b] - half[b]);
      const double high = std::min(size[b], middle[b] + half[b]);
      to[b] = low + share(random[b]) * (high - low);
    }
    return {i, std::floor(to[0]), std::floor(to[1]), is_inside(to[0], to[1])};
  }
  // World units; of the last sample that from the one before.
  [[nodiscard]] Vec edge_of(const Index& i, std::size_t a) const {
    Vec edge{};
    if (!samples_.scene().lattice.places) {
      edge[a] = samples_.edge(i, a);
      return edge;
    }
    const auto next = samples_.neighbour(i, a, 1);
    const auto last = samples_.neighbour(i, a, -1);
    if (!next && !last) return edge;
    const glm::dvec3 way = samples_.place(next ? *next : i) - samples_.place(next ? i : *last);
    return {way.x, way.y, way.z};
  }
  [[nodiscard]] Vec from_eye(const Index& i) const {
    const glm::dvec3 place = samples_.place(i);
    return reference::plus({place.x, place.y, place.z}, -1, view_.eye);
  }
  [[nodiscard]] double volume(const Index& i) const {
    return samples_.edge(i, 0) * samples_.edge(i, 1) * samples_.edge(i, 2);
  }
  // The volume of a cell over the length of the ray in the lattice, world units.
  [[nodiscard]] double face(const Index& i) const {
    Vec way = view_.forward;
    double from = -1e300;
    if (view_.perspective) {
      way = from_eye(i);
      from = -reference::length(way);
      way = reference::scaled(way, -1 / from);
    }
    double to = 1e300;
    double steepest = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      const double rate = way[a] / std::max(samples_.edge(i, a), 1e-30);
      if (std::abs(rate) < 1e-12) continue;
      steepest = std::max(steepest, std::abs(rate));
      const double low = (samples_.low()[a] - 0.5 - i[a]) / rate;
      const double high = (samples_.high()[a] - 0.5 - i[a]) / rate;
      from = std::max(from, std::min(low, high));
      to = std::min(to, std::max(low, high));
    }
    return volume(i) / std::max(1 / steepest, to - from);
  }

  const reference::View& view_;
  const DrawnSamples& samples_;
  const std::optional<Reach> reach_;  // empty: not known
};

}  // namespace

const Place& Spread::nth(std::uint32_t n) const {
  return places[nth_place(n) * places.size() / places_count];
}

Spread spread_places(const RayKernels& kernels, const std::vector<RayThrough>& through) {
  return Places(kernels).spread(through);
}

void take_block(const scene::Camera& camera, const reference::View& view, const Place& place,
                bool all, std::vector<PictureRay>& rays) {
  const int edge = is_each_pixel_tried(camera) ? 1 : 4;
  const auto first = [edge](double at, int size) {
    return std::clamp(static_cast<int>(at) - edge / 2, 0, std::max(0, size - edge));
  };
  all = all || edge == 1 || std::min(camera.width, camera.height) < edge;
  rays.clear();
  for (int n = 0; n < edge * edge; ++n) {
    const int column = n % edge;
    const int row = n / edge;
    const int x = first(place.x, camera.width) + column;
    const int y = first(place.y, camera.height) + row;
    if (x >= camera.width || y >= camera.height) continue;
    if (all || (2 * column + 1) % 5 == row) rays.push_back(picture_ray(view, x + 0.5, y + 0.5));
  }
}

}  // namespace windsplat::frame
