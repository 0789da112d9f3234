// Scenes of chains, and their pictures by every method.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <random>
#include <vector>

#include "server/engine/reference/reference.hpp"
#include "server/trace/segments.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {

using glm::dvec3;

inline constexpr scene::Method methods[] = {scene::Method::kernel, scene::Method::slab,
                                            scene::Method::reference};

// A picture by any method, in single precision.
inline engine::Rendered drawn(scene::Scene scene, scene::Method method, unsigned threads = 1) {
  scene.method = method;
  if (method != scene::Method::reference) return render(scene, threads);
  ThreadPool pool(threads);
  const auto painted = engine::reference::render(scene, pool, CancelToken(), {1e-6});
  EXPECT_TRUE(painted);
  engine::Rendered out;
  out.image.width = scene.camera.width;
  out.image.height = scene.camera.height;
  for (const double value : painted->rgba) out.image.rgba.push_back(static_cast<float>(value));
  return out;
}

// Lines given as points, of the full magnitude 1.
struct Chains {
  trace::Segments segments;
  std::size_t next = 0;

  Chains() {
    segments.dims = {8, 128, 1};
    const std::size_t count = 1025;
    segments.places.assign(count, {0, 0, 0});
    for (auto& tangent : segments.tangents) tangent.assign(count, 0);
    segments.q.assign(count, 0);
    segments.magnitudes.assign(count, trace::Segments::none);
    segments.phases.assign(count, 0);
    segments.colors.assign(count, 0);
  }
  void add(const std::vector<dvec3>& points) {
    const std::size_t last = points.size() - 1;
    for (std::size_t n = 0; n <= last; ++n, ++next) {
      dvec3 tangent(0);
      if (n > 0 && n < last) {
        tangent =
            glm::normalize(points[n] - points[n - 1]) + glm::normalize(points[n + 1] - points[n]);
      }
      for (int c = 0; c < 3; ++c) {
        segments.places[next][static_cast<std::size_t>(c)] = static_cast<float>(points[n][c]);
        segments.tangents[static_cast<std::size_t>(c)][next] = static_cast<float>(tangent[c]);
      }
      segments.q[next] =
          static_cast<float>(static_cast<double>(n) / static_cast<double>(last) - 0.5);
      segments.magnitudes[next] = n < last ? 1.0F : trace::Segments::none;
    }
  }
};

inline scene::Scene chain_scene(const Chains& chains, bool perspective, int size = 200) {
  scene::Scene scene;
  scene.lattice = even_lattice({2, 2, 2}, {1, 1, 1});
  scene.camera = perspective ? look({0, 0, 0}, {0.3, 1, -0.2}, 4, size, size, true, 0.35)
                             : look({0, 0, 0}, {0.3, 1, -0.2}, 4, size, size, false, 1.3);
  scene.vector =
      plain_lines(make_volume(scene.lattice, 3,
                              [](int c, double, double, double) { return c == 0 ? 1.F : 0.F; }),
                  {0.2F, 0.5F, 0.8F});
  scene.vector->magnitude_range = {0, 1};
  scene.vector->length = 3;
  scene.vector->r1 = 1.5;
  scene.vector->r2 = 3.5;
  scene.vector->opacity = 0.75;
  scene.vector->head_desaturation = 0.5;
  scene.vector->streamlets = std::make_shared<const trace::Segments>(chains.segments);
  return scene;
}

inline std::vector<dvec3> straight(const dvec3& from, const dvec3& to, int segments) {
  std::vector<dvec3> out;
  for (int n = 0; n <= segments; ++n) out.push_back(from + (to - from) * (double(n) / segments));
  return out;
}

inline std::vector<dvec3> arc(const dvec3& centre, double radius, double turn, double lean,
                              int segments) {
  std::vector<dvec3> out;
  for (int n = 0; n <= segments; ++n) {
    const double a = turn * n / segments;
    out.push_back(centre + radius * dvec3(std::cos(a), lean * a, std::sin(a)));
  }
  return out;
}

inline Chains many_arcs(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  Chains chains;
  for (int n = 0; n < count; ++n) {
    const dvec3 centre = 0.8 * dvec3(unit(random), unit(random), unit(random));
    chains.add(arc(centre, 0.1 + 0.3 * std::abs(unit(random)), 3 * unit(random), unit(random), 8));
  }
  return chains;
}

inline double apart_rms(const engine::Rendered& a, const engine::Rendered& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.image.rgba.size(); ++i) {
    const double apart = static_cast<double>(a.image.rgba[i] - b.image.rgba[i]);
    sum += apart * apart;
  }
  return std::sqrt(sum / static_cast<double>(a.image.rgba.size()));
}

}  // namespace windsplat::test
