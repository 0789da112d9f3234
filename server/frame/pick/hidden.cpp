// Rays from the places to the eye, through the triangles that may cover them in the picture.
#include "server/frame/pick/hidden.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>

#include "server/engine/reference/body.hpp"

namespace windsplat::frame {
namespace {

constexpr double nearer_by = 2;      // pixels at the depth of a place
constexpr double hides_below = 0.5;  // transmittance
constexpr int cell_side = 16;        // pixels

glm::dvec3 vec(const surface::Point& p) { return {p[0], p[1], p[2]}; }

struct SightLine {
  glm::dvec3 from{0};          // the place
  glm::dvec3 to_eye{0};        // unit
  double first = 0, last = 0;  // of the way to the eye where it may be hidden, world units
  std::array<double, 2> pixel{};
  double depth = 0;
  double passes = 1;
};

// The part of the way at which a ray meets a triangle (T. Moeller, B. Trumbore: Fast, Minimum
// Storage Ray/Triangle Intersection, 1997).
bool meets(const SightLine& ray, const std::array<glm::dvec3, 3>& corners) {
  const glm::dvec3 u = corners[1] - corners[0];
  const glm::dvec3 v = corners[2] - corners[0];
  const glm::dvec3 p = glm::cross(ray.to_eye, v);
  const double determinant = glm::dot(u, p);
  if (determinant == 0) return false;
  const glm::dvec3 off = ray.from - corners[0];
  const double a = glm::dot(off, p) / determinant;
  if (!(a >= 0 && a <= 1)) return false;
  const glm::dvec3 q = glm::cross(off, u);
  const double b = glm::dot(ray.to_eye, q) / determinant;
  if (!(b >= 0 && a + b <= 1)) return false;
  const double along = glm::dot(v, q) / determinant;
  return along > ray.first && along < ray.last;
}

class Hiding {
 public:
  Hiding(const scene::Scene& scene, const CancelToken& cancel)
      : scene_(scene),
        cancel_(cancel),
        camera_(scene.camera),
        pixel_(2 * camera_.half_height / camera_.height),
        columns_((camera_.width + cell_side - 1) / cell_side),
        rows_((camera_.height + cell_side - 1) / cell_side) {}

  std::vector<bool> of(const std::vector<glm::dvec3>& places) {
    cells_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), {});
    std::vector<bool> hidden(places.size(), true);
    for (std::size_t n = 0; n < places.size(); ++n) {
      rays_.push_back(ray_from(places[n]));
      const SightLine& ray = rays_.back();
      if (cancel_.cancelled()) continue;
      const double across = ray.pixel[0] / cell_side;
      const double down = ray.pixel[1] / cell_side;
      if (!(ray.depth > 0) || !(across >= 0 && across < columns_) || !(down >= 0 && down < rows_)) {
        continue;
      }
      const int column = static_cast<int>(across);
      const int row = static_cast<int>(down);
      hidden[n] = behind_body(ray);
      if (!hidden[n]) cells_[cell_at(column, row)].push_back(static_cast<std::uint32_t>(n));
    }
    for (const surface::Shown& shown : scene_.surfaces) pass(shown);
    for (std::size_t n = 0; n < places.size(); ++n) {
      hidden[n] = hidden[n] || rays_[n].passes < hides_below;
    }
    return hidden;
  }

 private:
  [[nodiscard]] std::size_t cell_at(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }
  [[nodiscard]] double depth_of(const glm::dvec3& place) const {
    return glm::dot(place - camera_.eye, camera_.forward);
  }
  // Not for places before the near plane.
  [[nodiscard]] std::array<double, 2> pixel_of(const glm::dvec3& place, double depth) const {
    const double scale = 1 / (pixel_ * (camera_.perspective ? depth : 1));
    const glm::dvec3 at = place - camera_.eye;
    return {0.5 * camera_.width + scale * glm::dot(at, camera_.right),
            0.5 * camera_.height - scale * glm::dot(at, camera_.up)};
  }

  // Depth 0: not before the eye.
  [[nodiscard]] SightLine ray_from(const glm::dvec3& place) const {
    SightLine ray;
    ray.from = place;
    const double depth = depth_of(place);
    if (camera_.perspective && !(depth > camera_.near)) return ray;
    ray.pixel = pixel_of(place, depth);
    // In orthographic pictures what lies behind the eye is seen too.
    ray.depth = camera_.perspective ? depth : std::numeric_limits<double>::infinity();
    ray.first = nearer_by * pixel_ * (camera_.perspective ? depth : 1);
    ray.last = std::numeric_limits<double>::infinity();
    ray.to_eye = -camera_.forward;
    if (camera_.perspective) {
      const double way = glm::length(camera_.eye - place);
      ray.to_eye = (camera_.eye - place) / way;
      ray.last = way * (1 - camera_.near / depth);
    }
    return ray;
  }

  [[nodiscard]] bool behind_body(const SightLine& ray) const {
    if (!scene_.body) return false;
    const auto view = engine::reference::make_view(camera_);
    const auto body =
        engine::reference::body_surface(*scene_.body, view, ray.pixel[0], ray.pixel[1]);
    return body.opacity >= hides_below && body.depth < depth_of(ray.from) - ray.first;
  }

  void pass(const surface::Shown& shown) {
    for (const auto& ids : shown.mesh->triangles) {
      if (cancel_.cancelled()) return;
      std::array<glm::dvec3, 3> corners;
      std::array<double, 2> low{1e300, 1e300};
      std::array<double, 2> high{-1e300, -1e300};
      bool crosses = false;  // the near plane
      for (std::size_t c = 0; c < 3; ++c) {
        corners.at(c) = vec(shown.mesh->places[ids.at(c)]);
        const double depth = depth_of(corners.at(c));
        if (camera_.perspective && !(depth > camera_.near)) {
          crosses = true;
          continue;
        }
        const auto at = pixel_of(corners.at(c), depth);
        for (std::size_t a = 0; a < 2; ++a) {
          low.at(a) = std::min(low.at(a), at.at(a));
          high.at(a) = std::max(high.at(a), at.at(a));
        }
      }
      if (crosses) {
        low = {0, 0};
        high = {static_cast<double>(camera_.width), static_cast<double>(camera_.height)};
      }
      pass_cells(shown, corners, low, high);
    }
  }

  void pass_cells(const surface::Shown& shown, const std::array<glm::dvec3, 3>& corners,
                  const std::array<double, 2>& low, const std::array<double, 2>& high) {
    const auto cell = [](double pixel, int count) {
      return static_cast<int>(std::clamp(std::floor(pixel / cell_side), -1.0, 1.0 * count));
    };
    const int last_row = std::min(cell(high[1], rows_), rows_ - 1);
    const int last_column = std::min(cell(high[0], columns_), columns_ - 1);
    for (int row = std::max(cell(low[1], rows_), 0); row <= last_row; ++row) {
      for (int column = std::max(cell(low[0], columns_), 0); column <= last_column; ++column) {
        for (const std::uint32_t n : cells_[cell_at(column, row)]) {
          if (meets(rays_[n], corners)) rays_[n].passes *= 1 - shown.opacity;
        }
      }
    }
  }

  const scene::Scene& scene_;
  const CancelToken& cancel_;
  const scene::Camera& camera_;
  double pixel_;  // size at unit distance (perspective) or in the world
  int columns_, rows_;
  std::vector<SightLine> rays_;
  std::vector<std::vector<std::uint32_t>> cells_;  // rays by the cells of pixels
};

}  // namespace

std::vector<bool> hidden_places(const scene::Scene& scene, const std::vector<glm::dvec3>& places,
                                const CancelToken& cancel) {
  return Hiding(scene, cancel).of(places);
}

}  // namespace windsplat::frame
