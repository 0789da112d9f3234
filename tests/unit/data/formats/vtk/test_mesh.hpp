// Meshes of cells of every shape, as files, and the difference of their samples from the field.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "tests/unit/data/formats/vtk/vtk_maker.hpp"

namespace windsplat::data::vtk_test {

using Place = std::array<double, 3>;
using Map = std::function<Place(const Place&)>;
using Function = std::function<double(const Place&)>;

struct TestMesh {
  std::vector<double> points;
  std::vector<double> connectivity;
  std::vector<double> offsets;
  std::vector<double> types;
  void cell(int type, const std::vector<int>& corners) {
    connectivity.insert(connectivity.end(), corners.begin(), corners.end());
    offsets.push_back(static_cast<double>(connectivity.size()));
    types.push_back(type);
  }
};

// The unit cube as n^3 boxes, mapped by `map`, each divided by `cut`, which receives its corners.
inline TestMesh boxes(int n, const Map& map,
                      const std::function<void(TestMesh&, const std::array<int, 8>&)>& cut) {
  TestMesh mesh;
  for (int k = 0; k <= n; ++k) {
    for (int j = 0; j <= n; ++j) {
      for (int i = 0; i <= n; ++i) {
        const Place p = map({i / double(n), j / double(n), k / double(n)});
        mesh.points.insert(mesh.points.end(), p.begin(), p.end());
      }
    }
  }
  const auto at = [n](int i, int j, int k) { return (k * (n + 1) + j) * (n + 1) + i; };
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        cut(mesh,
            {at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k), at(i, j, k + 1),
             at(i + 1, j, k + 1), at(i + 1, j + 1, k + 1), at(i, j + 1, k + 1)});
      }
    }
  }
  return mesh;
}

inline void as_hexahedron(TestMesh& mesh, const std::array<int, 8>& c) {
  mesh.cell(12, {c.begin(), c.end()});
}
inline void as_voxel(TestMesh& mesh, const std::array<int, 8>& c) {
  mesh.cell(11, {c[0], c[1], c[3], c[2], c[4], c[5], c[7], c[6]});
}
inline void as_wedges(TestMesh& mesh, const std::array<int, 8>& c) {
  mesh.cell(13, {c[0], c[1], c[2], c[4], c[5], c[6]});
  mesh.cell(13, {c[0], c[2], c[3], c[4], c[6], c[7]});
}
inline void as_tetrahedra(TestMesh& mesh, const std::array<int, 8>& c) {
  for (const auto& [a, b] : {std::pair(1, 2), {2, 3}, {3, 7}, {7, 4}, {4, 5}, {5, 1}}) {
    mesh.cell(10, {c[0], c[static_cast<std::size_t>(a)], c[static_cast<std::size_t>(b)], c[6]});
  }
}
// Three pyramids that share the corner 6.
inline void as_pyramids(TestMesh& mesh, const std::array<int, 8>& c) {
  mesh.cell(14, {c[0], c[1], c[2], c[3], c[6]});
  mesh.cell(14, {c[0], c[4], c[5], c[1], c[6]});
  mesh.cell(14, {c[0], c[3], c[7], c[4], c[6]});
}

inline std::string piece_of(const TestMesh& mesh, const std::string& point_data,
                            const std::string& cell_data, VtkXml& xml) {
  std::string inner = "<Piece NumberOfPoints=\"" + std::to_string(mesh.points.size() / 3);
  inner += "\" NumberOfCells=\"" + std::to_string(mesh.types.size()) + "\"><PointData>";
  inner += point_data + "</PointData><CellData>" + cell_data + "</CellData><Points>";
  inner += xml.array("Float64", "Points", 3, mesh.points) + "</Points><Cells>";
  inner += xml.array("Int64", "connectivity", 1, mesh.connectivity);
  inner += xml.array("Int32", "offsets", 1, mesh.offsets);
  return inner + xml.array("UInt8", "types", 1, mesh.types) + "</Cells></Piece>";
}

inline std::string vtu(const TestMesh& mesh, const std::string& point_data,
                       const std::string& cell_data, VtkXml& xml) {
  const std::string inner = piece_of(mesh, point_data, cell_data, xml);
  return xml.file("UnstructuredGrid", "", inner);
}

inline std::vector<double> at_points(const TestMesh& mesh, const Function& f) {
  std::vector<double> out;
  for (std::size_t p = 0; p < mesh.points.size(); p += 3) {
    out.push_back(f({mesh.points[p], mesh.points[p + 1], mesh.points[p + 2]}));
  }
  return out;
}

struct Outcome {
  double worst = 0;   // difference from the exact field, over the samples inside
  double inside = 0;  // fraction of them; samples at the ends of an axis count half
  double volume = 0;  // the fraction that they represent
  std::string notes;
};

inline Outcome compare(Source& source, const Function& f) {
  const auto& axes = source.info().grid.axes;
  const Volume volume = volume_of(source, "a");
  const auto end_weight = [](const Axis& axis, std::size_t i) {
    return axis.coordinates.size() > 1 && (i == 0 || i + 1 == axis.coordinates.size()) ? 0.5 : 1.0;
  };
  Outcome out;
  double all = 0;
  std::size_t s = 0;
  for (std::size_t k = 0; k < axes[2].coordinates.size(); ++k) {
    for (std::size_t j = 0; j < axes[1].coordinates.size(); ++j) {
      for (std::size_t i = 0; i < axes[0].coordinates.size(); ++i) {
        const float value = volume.values[s++];
        const double weight =
            end_weight(axes[0], i) * end_weight(axes[1], j) * end_weight(axes[2], k);
        all += weight;
        if (std::isnan(value)) continue;
        out.inside += weight;
        const Place place{axes[0].coordinates[i], axes[1].coordinates[j], axes[2].coordinates[k]};
        out.worst = std::max(out.worst, std::abs(value - f(place)));
      }
    }
  }
  out.volume = out.inside;
  for (const Axis& axis : axes) {
    if (axis.coordinates.size() > 1) out.volume *= axis.coordinates[1] - axis.coordinates[0];
  }
  out.inside /= all;
  out.notes = all_notes(source.info());
  return out;
}

class VtkResampling : public testing::Test {
 protected:
  Outcome outcome(const TestMesh& mesh, const Function& f) {
    VtkXml xml({"appended-raw", "", false, 8});
    const auto data = xml.array("Float64", "a", 1, at_points(mesh, f));
    const auto source = opened(folder_.write("a.vtu", vtu(mesh, data, "", xml)));
    return source ? compare(*source, f) : Outcome();
  }
  VtkFolder folder_;
};

inline double linear(const Place& p) { return 3 * p[0] - 2 * p[1] + 0.5 * p[2] + 1; }

}  // namespace windsplat::data::vtk_test
