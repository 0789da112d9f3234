// Small OpenFOAM cases, written as the format is documented (openfoam.com, "Mesh description",
// "Input/output file format"), independently of the program under test.
#pragma once

#include <zlib.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace windsplat::data::test {

using Place = std::array<double, 3>;
using Values = std::function<std::vector<double>(const Place&)>;  // 1 or 3 components

enum class FoamCoding { ascii, binary, gzip };

// A box of cells, of which those of a side of `h` are hexahedra, unless their faces across x are
// divided into triangles, which makes them polyhedra of VTK.
struct FoamBox {
  std::array<int, 3> cells{4, 3, 2};
  Place origin{0, 0, 0};
  double h = 0.25;
  bool has_polyhedra = false;

  [[nodiscard]] int point(int i, int j, int k) const {
    return i + (cells[0] + 1) * (j + (cells[1] + 1) * k);
  }
  [[nodiscard]] int cell(int i, int j, int k) const { return i + cells[0] * (j + cells[1] * k); }
  [[nodiscard]] Place at(double i, double j, double k) const {
    return {origin[0] + h * i, origin[1] + h * j, origin[2] + h * k};
  }
  // Of the points, or with `half` 0.5 of the centres of cells; x fastest.
  [[nodiscard]] std::vector<Place> places(bool centres) const {
    const double half = centres ? 0.5 : 0;
    const int more = centres ? 0 : 1;
    std::vector<Place> out;
    for (int k = 0; k < cells[2] + more; ++k) {
      for (int j = 0; j < cells[1] + more; ++j) {
        for (int i = 0; i < cells[0] + more; ++i) out.push_back(at(i + half, j + half, k + half));
      }
    }
    return out;
  }
};

struct FoamFace {
  std::vector<int> points;  // seen from outside of the owner, counter-clockwise
  int owner = 0;
  int neighbour = -1;
};

// Internal faces first.
inline std::vector<FoamFace> faces_of(const FoamBox& box) {
  std::vector<FoamFace> inner;
  std::vector<FoamFace> outer;
  const auto add = [&](FoamFace face) {
    auto& to = face.neighbour < 0 ? outer : inner;
    const auto p = face.points;
    if (!box.has_polyhedra || face.neighbour < 0) return to.push_back(std::move(face));
    to.push_back({{p[0], p[1], p[2]}, face.owner, face.neighbour});
    to.push_back({{p[0], p[2], p[3]}, face.owner, face.neighbour});
  };
  for (int k = 0; k < box.cells[2]; ++k) {
    for (int j = 0; j < box.cells[1]; ++j) {
      for (int i = 0; i < box.cells[0]; ++i) {
        const auto p = [&](int a, int b, int c) { return box.point(i + a, j + b, k + c); };
        const int own = box.cell(i, j, k);
        add({{p(1, 0, 0), p(1, 1, 0), p(1, 1, 1), p(1, 0, 1)},
             own,
             i + 1 < box.cells[0] ? box.cell(i + 1, j, k) : -1});
        add({{p(0, 1, 0), p(0, 1, 1), p(1, 1, 1), p(1, 1, 0)},
             own,
             j + 1 < box.cells[1] ? box.cell(i, j + 1, k) : -1});
        add({{p(0, 0, 1), p(1, 0, 1), p(1, 1, 1), p(0, 1, 1)},
             own,
             k + 1 < box.cells[2] ? box.cell(i, j, k + 1) : -1});
        if (i == 0) add({{p(0, 0, 0), p(0, 0, 1), p(0, 1, 1), p(0, 1, 0)}, own});
        if (j == 0) add({{p(0, 0, 0), p(1, 0, 0), p(1, 0, 1), p(0, 0, 1)}, own});
        if (k == 0) add({{p(0, 0, 0), p(0, 1, 0), p(1, 1, 0), p(1, 0, 0)}, own});
      }
    }
  }
  inner.insert(inner.end(), outer.begin(), outer.end());
  return inner;
}

class FoamCase {
 public:
  // The mesh is below `root`: the folder of the case, or of one of its processors.
  FoamCase(std::string root, FoamBox box, FoamCoding coding = FoamCoding::ascii)
      : root_(std::move(root)), box_(box), coding_(coding) {
    write_mesh();
  }

  static void write_control(const std::string& folder) {
    std::filesystem::create_directories(folder + "/system");
    std::ofstream(folder + "/system/controlDict")
        << "FoamFile\n{\n    version 2.0;\n    format ascii;\n    class dictionary;\n    object "
           "controlDict;\n}\napplication icoFoam;\nstartFrom startTime;\nstartTime 0;\nstopAt "
           "endTime;\nendTime 1;\ndeltaT 0.5;\nwriteControl timeStep;\nwriteInterval 1;\n";
  }

  // dimensions: "0 1 -1 0 0 0 0". point: a value at each point, otherwise of each cell.
  void field(const std::string& time, const std::string& name, const std::string& dimensions,
             const Values& values, bool point = false) {
    std::vector<double> all;
    std::size_t components = 1;
    for (const Place& place : box_.places(!point)) {
      const auto one = values(place);
      components = one.size();
      all.insert(all.end(), one.begin(), one.end());
    }
    const std::string kind = components == 1 ? "Scalar" : "Vector";
    const std::string type = components == 1 ? "scalar" : "vector";
    write(time, name, (point ? "point" : "vol") + kind + "Field",
          "dimensions      [" + dimensions + "];\n\ninternalField   nonuniform List<" + type +
              "> \n" + list(all, components) +
              ";\n\nboundaryField\n{\n    walls\n    {\n"
              "        type zeroGradient;\n    }\n}\n");
  }

  // A file with a header of this class.
  void write(const std::string& folder, const std::string& name, const std::string& class_name,
             const std::string& body) {
    std::filesystem::create_directories(root_ + '/' + folder);
    const std::string text =
        "/*---*- C++ -*---*\\\n  dimensions of a comment [9 9 9 9 9];\n\\*---*/\nFoamFile\n{\n"
        "    version     2.0;\n    format      " +
        std::string(coding_ == FoamCoding::binary ? "binary" : "ascii") +
        ";\n    arch        \"LSB;label=32;scalar=64\";\n    class       " + class_name +
        ";\n    location    \"" + folder + "\";\n    object      " + name + ";\n}\n\n" + body;
    const std::string path = root_ + '/' + folder + '/' + name;
    if (coding_ != FoamCoding::gzip) {
      std::ofstream(path, std::ios::binary) << text;
      return;
    }
    gzFile file = ::gzopen((path + ".gz").c_str(), "wb");
    ::gzwrite(file, text.data(), static_cast<unsigned>(text.size()));
    ::gzclose(file);
  }

  [[nodiscard]] const FoamBox& box() const { return box_; }
  [[nodiscard]] std::string path(const std::string& name) const { return root_ + '/' + name; }

 private:
  template <class T>
  static std::string raw(const std::vector<T>& values) {
    std::string out(values.size() * sizeof(T), '\0');
    std::memcpy(out.data(), values.data(), out.size());
    return out;
  }

  [[nodiscard]] std::string list(const std::vector<double>& values, std::size_t components) const {
    std::ostringstream out;
    out.precision(17);
    out << values.size() / components << "\n(";
    if (coding_ == FoamCoding::binary) {
      out << raw(values);
    } else {
      for (std::size_t v = 0; v < values.size(); ++v) {
        out << (v % components == 0 ? components > 1 ? "\n(" : "\n" : " ") << values[v]
            << (components > 1 && v % components == components - 1 ? ")" : "");
      }
      out << '\n';
    }
    out << ")\n";
    return out.str();
  }

  [[nodiscard]] std::string labels(const std::vector<std::int32_t>& values) const {
    std::ostringstream out;
    out << values.size() << "\n(";
    if (coding_ == FoamCoding::binary) {
      out << raw(values);
    } else {
      for (const auto value : values) out << '\n' << value;
      out << '\n';
    }
    out << ")\n";
    return out.str();
  }

  void write_mesh() {
    const std::string folder = "constant/polyMesh";
    std::vector<double> points;
    for (const Place& place : box_.places(false)) {
      points.insert(points.end(), place.begin(), place.end());
    }
    write(folder, "points", "vectorField", list(points, 3));
    std::vector<std::int32_t> owners;
    std::vector<std::int32_t> neighbours;
    std::vector<std::int32_t> ends{0};
    std::vector<std::int32_t> corners;
    std::ostringstream plain;
    const auto faces = faces_of(box_);
    for (const FoamFace& face : faces) {
      owners.push_back(face.owner);
      if (face.neighbour >= 0) neighbours.push_back(face.neighbour);
      plain << '\n' << face.points.size() << '(';
      for (std::size_t p = 0; p < face.points.size(); ++p) {
        plain << (p > 0 ? " " : "") << face.points[p];
        corners.push_back(face.points[p]);
      }
      plain << ')';
      ends.push_back(static_cast<std::int32_t>(corners.size()));
    }
    if (coding_ == FoamCoding::binary) {
      write(folder, "faces", "faceCompactList", labels(ends) + labels(corners));
    } else {
      write(folder, "faces", "faceList",
            std::to_string(faces.size()) + "\n(" + plain.str() + "\n)\n");
    }
    write(folder, "owner", "labelList", labels(owners));
    write(folder, "neighbour", "labelList", labels(neighbours));
    write(folder, "boundary", "polyBoundaryMesh",
          "1\n(\n    walls\n    {\n        type wall;\n        nFaces " +
              std::to_string(faces.size() - neighbours.size()) + ";\n        startFace " +
              std::to_string(neighbours.size()) + ";\n    }\n)\n");
  }

  std::string root_;
  FoamBox box_;
  FoamCoding coding_;
};

}  // namespace windsplat::data::test
