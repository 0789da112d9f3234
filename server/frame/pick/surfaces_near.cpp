// Triangles in coordinates across the ray: those that contain the origin are met.
#include "server/frame/pick/surfaces_near.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace windsplat::frame {
namespace {

namespace reference = engine::reference;

// Of the edge of a triangle, relative: what lies so close to it is met, so that none passes between
// two triangles. Sheets whose depths differ by less are one.
constexpr double edge_slack = 1e-9;

struct Met {
  double depth = 0;
  std::array<double, 3> parts{};  // barycentric coordinates, with a sum of 1
};

// The ray through a triangle (T. Moeller, B. Trumbore: Fast, Minimum Storage Ray/Triangle
// Intersection, 1997); corners from the origin of the ray.
std::optional<Met> meet(const std::array<Vec, 3>& corners, const Vec& direction) {
  const Vec u = reference::plus(corners[1], -1, corners[0]);
  const Vec v = reference::plus(corners[2], -1, corners[0]);
  const Vec p = reference::cross(direction, v);
  const double determinant = reference::dot(u, p);
  if (determinant == 0) return std::nullopt;
  const Vec off = reference::scaled(corners[0], -1);
  const double a = reference::dot(off, p) / determinant;
  if (!(a >= -edge_slack && a <= 1 + edge_slack)) return std::nullopt;
  const Vec q = reference::cross(off, u);
  const double b = reference::dot(direction, q) / determinant;
  if (!(b >= -edge_slack && a + b <= 1 + edge_slack)) return std::nullopt;
  return Met{reference::dot(v, q) / determinant, {1 - a - b, a, b}};
}

double value_of(const surface::Mesh& mesh, const std::array<std::uint32_t, 3>& ids,
                const std::array<double, 3>& parts) {
  if (mesh.values.empty()) return std::numeric_limits<double>::quiet_NaN();
  double value = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const auto part = std::clamp(parts.at(c), 0.0, 1.0);
    value += part * static_cast<double>(mesh.values[ids.at(c)]);
  }
  return value;
}

}  // namespace

std::vector<SheetOnRay> sheets_on_ray(const scene::Scene& scene, const reference::View& view,
                                      const PictureRay& ray, const CancelToken& cancel) {
  constexpr double lowest = std::numeric_limits<double>::lowest();
  const double nearest = view.perspective ? view.near : lowest;
  const Vec from = reference::plus(view.eye, 1, ray.origin);
  std::vector<SheetOnRay> out;
  for (std::size_t s = 0; s < scene.surfaces.size(); ++s) {
    const surface::Mesh& mesh = *scene.surfaces[s].mesh;
    const std::size_t first = out.size();
    for (std::size_t n = 0; n < mesh.triangles.size(); ++n) {
      if (n % 65536 == 0 && cancel.cancelled()) return out;
      const auto& ids = mesh.triangles[n];
      std::array<Vec, 3> corners{};
      for (std::size_t c = 0; c < 3; ++c) {
        const surface::Point& place = mesh.places[ids.at(c)];
        for (std::size_t a = 0; a < 3; ++a) {
          corners.at(c).at(a) = static_cast<double>(place.at(a)) - from.at(a);
        }
      }
      const auto met = meet(corners, ray.direction);
      if (!met || met->depth < nearest) continue;
      const bool known = std::any_of(
          out.begin() + static_cast<std::ptrdiff_t>(first), out.end(), [&](const SheetOnRay& one) {
            return std::abs(one.depth - met->depth) <= edge_slack * (1 + std::abs(one.depth));
          });
      if (!known) out.push_back({s, met->depth, value_of(mesh, ids, met->parts)});
    }
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const SheetOnRay& a, const SheetOnRay& b) { return a.depth < b.depth; });
  return out;
}

}  // namespace windsplat::frame
