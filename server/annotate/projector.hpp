// World -> pixels of the picture of a camera.
#pragma once

#include <array>
#include <glm/vec3.hpp>
#include <optional>

#include "server/annotate/figure.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::annotate {

class Projector {
 public:
  explicit Projector(const scene::Camera& camera) : camera_(camera) {}

  // nullopt: at or before the near plane (perspective only).
  [[nodiscard]] std::optional<Point> pixel(const glm::dvec3& world) const;
  // The part of a straight edge beyond the near plane; nullopt: none.
  [[nodiscard]] std::optional<std::array<Point, 2>> edge(const glm::dvec3& from,
                                                         const glm::dvec3& to) const;
  // Whether the outer side of a plane through `point` faces the eye.
  [[nodiscard]] bool faces(const glm::dvec3& point, const glm::dvec3& normal) const;
  // Pixels for each world unit across the line of sight at a point; 0 before the near plane.
  [[nodiscard]] double pixels_per_unit(const glm::dvec3& world) const;
  // A direction as it appears at a point, pixels for each world unit in the limit of short lengths.
  [[nodiscard]] Point direction(const glm::dvec3& at, const glm::dvec3& world) const;

 private:
  [[nodiscard]] double depth(const glm::dvec3& world) const;

  scene::Camera camera_;
};

}  // namespace windsplat::annotate
