// The kernels of a scene for the brute-force integral (integrator.hpp), in long double, so that
// vectors of any magnitude and cells of any proportion neither overflow nor cancel.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "server/scene/scene.hpp"

namespace windsplat::truth {

using Real = long double;

struct Vec {
  Real x = 0, y = 0, z = 0;
  Real& operator[](int a) { return a == 0 ? x : a == 1 ? y : z; }
  Real operator[](int a) const { return a == 0 ? x : a == 1 ? y : z; }
};
inline Vec operator+(const Vec& a, const Vec& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec operator-(const Vec& a, const Vec& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec operator*(Real f, const Vec& v) { return {f * v.x, f * v.y, f * v.z}; }
inline Real dot(const Vec& a, const Vec& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec cross(const Vec& a, const Vec& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Real length(const Vec& v) { return std::sqrt(dot(v, v)); }
inline Vec vec(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

constexpr Real inner = 0.48L;  // the radii s and t of the footprint, cells
constexpr Real outer = 1.37L;

inline Vec to_cells(const std::array<Vec, 3>& normal, const Vec& v) {
  return {dot(normal[0], v), dot(normal[1], v), dot(normal[2], v)};
}

// 0 below `low`, 1 above `high`, linear between.
inline Real ramp(Real v, Real low, Real high) {
  if (high > low) return std::clamp((v - low) / (high - low), Real(0), Real(1));
  return v > low ? 1 : 0;
}

struct Splat {
  Vec centre;  // world
  std::array<Vec, 3> normal;
  Real rho = 0;  // extinction over C
  Vec color;
};

struct Line {
  Vec a, b;             // ends along right, down, forward, from the eye
  Real q0 = 0, q1 = 0;  // of -1/2 at the tail to 1/2 at the head
  Vec color;
  Real phase = 0;
};

// Every splat with an extinction, and every line of which a part lies in the box of its kernel and
// beyond the near plane.
std::vector<Splat> splats_of(const scene::Scene& scene);
std::vector<Line> lines_of(const scene::Scene& scene);

}  // namespace windsplat::truth
