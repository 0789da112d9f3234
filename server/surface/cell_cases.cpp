// Faces of a cell -> closed loops of cut edges -> triangles.
#include "server/surface/cell_cases.hpp"

#include <cstddef>
#include <vector>

#include "server/base/check.hpp"

namespace windsplat::surface {

namespace {

using Loop = std::vector<int>;        // cut edges in order
using Triangle = std::array<int, 3>;  // places in a loop
using Corners = std::array<int, 4>;   // of a face, counter-clockwise from outside
constexpr int faces = 6;

int edge_between(int p, int q) {
  for (int e = 0; e < cell_edges; ++e) {
    const auto ends = cell_edge(e);
    if ((ends[0] == p && ends[1] == q) || (ends[0] == q && ends[1] == p)) return e;
  }
  check_failed("corners of one edge", __FILE_NAME__, __LINE__);
}

Corners face_corners(int face) {
  const int axis = face / 2;
  const int b = 1 << (axis + 1) % 3;
  const int c = 1 << (axis + 2) % 3;
  const int at = face % 2 << axis;
  if (face % 2 != 0) return {at, at | b, at | b | c, at | c};
  return {at, at | c, at | b | c, at | b};
}

bool share_face(int e, int g) {
  for (int face = 0; face < faces; ++face) {
    const Corners corners = face_corners(face);
    int found = 0;
    for (std::size_t n = 0; n < 4; ++n) {
      const int here = edge_between(corners[n], corners[(n + 1) % 4]);
      found += here == e || here == g ? 1 : 0;
    }
    if (found == 2) return true;
  }
  return false;
}

// The cut edge that follows each one; -1: not cut. In each face a segment cuts off every run of
// corners inside, from the edge at which it ends to the one at which it begins.
std::array<int, cell_edges> successors(unsigned inside) {
  const auto is_inside = [&](int corner) { return (inside >> corner & 1U) != 0; };
  std::array<int, cell_edges> next{};
  next.fill(-1);
  for (int face = 0; face < faces; ++face) {
    const Corners corners = face_corners(face);
    for (std::size_t n = 0; n < 4; ++n) {
      if (!is_inside(corners[n]) || is_inside(corners[(n + 1) % 4])) continue;
      std::size_t before = n;
      while (is_inside(corners[before])) before = (before + 3) % 4;
      const int ends = edge_between(corners[n], corners[(n + 1) % 4]);
      next[static_cast<std::size_t>(ends)] =
          edge_between(corners[before], corners[(before + 1) % 4]);
    }
  }
  return next;
}

// Divides the part of the loop from `i` to `j` so that no side within it lies in a face of the
// cell. False if there is no such division.
bool divide(const Loop& loop, std::size_t i, std::size_t j, std::vector<Triangle>& to) {
  if (j - i < 2) return true;
  const auto allowed = [&](std::size_t p, std::size_t q) {
    const bool side = q - p == 1 || q - p == loop.size() - 1;
    return side || !share_face(loop[p], loop[q]);
  };
  for (std::size_t k = i + 1; k < j; ++k) {
    if (!allowed(i, k) || !allowed(k, j)) continue;
    const std::size_t size = to.size();
    if (divide(loop, i, k, to) && divide(loop, k, j, to)) {
      to.push_back({static_cast<int>(i), static_cast<int>(k), static_cast<int>(j)});
      return true;
    }
    to.resize(size);
  }
  return false;
}

CellCase make_case(unsigned inside) {
  CellCase out;
  auto next = successors(inside);
  for (int first = 0; first < cell_edges; ++first) {
    Loop loop;
    for (int e = first; next[static_cast<std::size_t>(e)] >= 0;) {
      loop.push_back(e);
      const int follows = next[static_cast<std::size_t>(e)];
      next[static_cast<std::size_t>(e)] = -1;
      e = follows;
    }
    if (loop.empty()) continue;
    std::vector<Triangle> triangles;
    WINDSPLAT_CHECK(divide(loop, 0, loop.size() - 1, triangles));
    for (const Triangle& triangle : triangles) {
      auto& edges = out.edges.at(static_cast<std::size_t>(out.triangles++));
      for (std::size_t n = 0; n < 3; ++n) {
        edges.at(n) = static_cast<std::int8_t>(loop[static_cast<std::size_t>(triangle.at(n))]);
      }
    }
  }
  return out;
}

std::array<CellCase, 256> make_cases() {
  std::array<CellCase, 256> cases;
  for (unsigned inside = 0; inside < cases.size(); ++inside) cases[inside] = make_case(inside);
  return cases;
}

}  // namespace

std::array<int, 2> cell_edge(int edge) {
  const int axis = edge / 4;
  const int low = (edge & 1) << (axis + 1) % 3 | (edge >> 1 & 1) << (axis + 2) % 3;
  return {low, low | 1 << axis};
}

const CellCase& cell_case(unsigned inside) {
  static const std::array<CellCase, 256> cases = make_cases();
  return cases.at(inside);
}

}  // namespace windsplat::surface
