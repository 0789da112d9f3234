#include "server/annotate/projector.hpp"

#include <glm/geometric.hpp>

namespace windsplat::annotate {

double Projector::depth(const glm::dvec3& world) const {
  return glm::dot(world - camera_.eye, camera_.forward);
}

double Projector::pixels_per_unit(const glm::dvec3& world) const {
  const double of_height = 0.5 * camera_.height / camera_.half_height;
  if (!camera_.perspective) return of_height;
  const double d = depth(world);
  return d > camera_.near ? of_height / d : 0;
}

std::optional<Point> Projector::pixel(const glm::dvec3& world) const {
  const double scale = pixels_per_unit(world);
  if (!(scale > 0)) return std::nullopt;
  const glm::dvec3 p = world - camera_.eye;
  return Point{0.5 * camera_.width + scale * glm::dot(p, camera_.right),
               0.5 * camera_.height - scale * glm::dot(p, camera_.up)};
}

std::optional<std::array<Point, 2>> Projector::edge(const glm::dvec3& from,
                                                    const glm::dvec3& to) const {
  glm::dvec3 a = from;
  glm::dvec3 b = to;
  if (camera_.perspective) {
    constexpr double beyond = 1.0001;  // of the near plane, so that both ends have pixels
    const double near = beyond * camera_.near;
    const double before = depth(from) - near;
    const double after = depth(to) - near;
    if (before < 0 && after < 0) return std::nullopt;
    const glm::dvec3 cut = from + (to - from) * (before / (before - after));
    if (before < 0) a = cut;
    if (after < 0) b = cut;
  }
  const auto first = pixel(a);
  const auto last = pixel(b);
  if (!first || !last) return std::nullopt;
  return std::array{*first, *last};
}

bool Projector::faces(const glm::dvec3& point, const glm::dvec3& normal) const {
  const glm::dvec3 to_eye = camera_.perspective ? camera_.eye - point : -camera_.forward;
  return glm::dot(normal, to_eye) > 0;
}

Point Projector::direction(const glm::dvec3& at, const glm::dvec3& world) const {
  const double scale = pixels_per_unit(at);
  const double x = glm::dot(world, camera_.right);
  const double y = glm::dot(world, camera_.up);
  if (!camera_.perspective || !(scale > 0)) return {scale * x, -scale * y};
  // d/dt of the pixel of at + t world.
  const double share = glm::dot(world, camera_.forward) / depth(at);
  const glm::dvec3 p = at - camera_.eye;
  return {scale * (x - share * glm::dot(p, camera_.right)),
          -scale * (y - share * glm::dot(p, camera_.up))};
}

}  // namespace windsplat::annotate
