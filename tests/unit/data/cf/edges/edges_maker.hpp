// Meshes for tests of values on edges, with the edge along every side.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "server/data/cf/edges/edges.hpp"
#include "tests/unit/data/cf/mesh_maker.hpp"

namespace windsplat::data::test::mesh {

using Pair = std::pair<std::uint32_t, std::uint32_t>;
using Flow = std::function<std::array<double, 2>(double, double)>;

// A mesh and the nodes of its edges, in the order in which the cells have them.
struct Sides {
  cf::Mesh mesh;
  std::vector<Pair> nodes;
  std::vector<std::uint32_t> of_corners;
  std::vector<std::uint32_t> users;  // cells at each edge

  void find() {
    std::map<Pair, std::uint32_t> known;
    for (std::size_t c = 0; c < mesh.cells(); ++c) {
      for (std::uint32_t i = mesh.first[c]; i < mesh.first[c + 1]; ++i) {
        const std::uint32_t a = mesh.corners[i];
        const std::uint32_t b = mesh.corners[i + 1 < mesh.first[c + 1] ? i + 1 : mesh.first[c]];
        const auto [found, is_new] =
            known.emplace(std::minmax(a, b), static_cast<std::uint32_t>(nodes.size()));
        if (is_new) {
          nodes.emplace_back(a, b);
          users.push_back(0);
        }
        of_corners.push_back(found->second);
        ++users[found->second];
      }
    }
  }
  [[nodiscard]] double middle(std::size_t edge, const Table& of) const {
    return (of[nodes[edge].first] + of[nodes[edge].second]) / 2;
  }
  // The unit normal, to the right of the way from the first node to the second.
  [[nodiscard]] std::array<double, 2> normal(std::size_t edge) const {
    const auto [a, b] = nodes[edge];
    const double x = mesh.x[b] - mesh.x[a];
    const double y = mesh.y[b] - mesh.y[a];
    const double length = std::hypot(x, y);
    return {y / length, -x / length};
  }
  [[nodiscard]] cf::MeshEdges edges() const {
    cf::MeshEdges out;
    out.count = nodes.size();
    out.of_sides = of_corners;
    for (std::size_t e = 0; e < nodes.size(); ++e) {
      out.middles.push_back({middle(e, mesh.x), middle(e, mesh.y), 0});
      const auto [x, y] = normal(e);
      out.normals.push_back({x, y, 0});
    }
    return out;
  }
  [[nodiscard]] std::vector<float> normals_of(const Flow& flow) const {
    std::vector<float> out;
    for (std::size_t e = 0; e < nodes.size(); ++e) {
      const auto [u, v] = flow(middle(e, mesh.x), middle(e, mesh.y));
      const auto [x, y] = normal(e);
      out.push_back(static_cast<float>(u * x + v * y));
    }
    return out;
  }
  [[nodiscard]] std::array<double, 2> centroid(std::size_t cell) const {
    cf::ChartCell chart;
    cf::chart_of(mesh, cell, false, chart);
    return chart.centroid();
  }
  [[nodiscard]] bool is_inner(std::size_t cell) const {
    bool all = true;
    for (std::uint32_t i = mesh.first[cell]; i < mesh.first[cell + 1]; ++i) {
      all = all && users[of_corners[i]] == 2;
    }
    return all;
  }
};

enum class Shape { quads, triangles };

// The quadrilaterals of mesh_maker.hpp, or their halves.

inline Sides small_mesh(Shape shape) {
  Sides out;
  out.mesh.x = at_nodes([](double x, double) { return x; });
  out.mesh.y = at_nodes([](double, double y) { return y; });
  out.mesh.first.push_back(0);
  const Table four = corners(0);
  for (std::size_t c = 0; c < cells; ++c) {
    const auto corner = [&](std::size_t i) { return static_cast<std::uint32_t>(four[4 * c + i]); };
    if (shape == Shape::quads) {
      for (const std::size_t i : {0U, 1U, 2U, 3U}) out.mesh.corners.push_back(corner(i));
      out.mesh.first.push_back(static_cast<std::uint32_t>(out.mesh.corners.size()));
      continue;
    }
    for (const auto& half : {std::array<std::size_t, 3>{0, 1, 2}, {0, 2, 3}}) {
      for (const std::size_t i : half) out.mesh.corners.push_back(corner(i));
      out.mesh.first.push_back(static_cast<std::uint32_t>(out.mesh.corners.size()));
    }
  }
  out.find();
  return out;
}

}  // namespace windsplat::data::test::mesh
