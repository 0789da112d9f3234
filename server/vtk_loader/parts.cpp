// Copies from data sets of VTK; every index of a point is checked.
#include "server/vtk_loader/parts.hpp"

#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPointData.h>

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>

#include "server/data/cf/grid/grid.hpp"

namespace windsplat::vtk_loader {

namespace {

using data::vtk::Mesh;
using data::vtk::Shape;

Error malformed(const std::string& what) {
  return make_error(ErrorKind::bad_data, "is malformed: " + what);
}

// Pixel and voxel of VTK have their corners row by row.
constexpr int pixel = 8;
constexpr int voxel = 11;

Result<void> add_cell(int type, const vtkIdList& corners, vtkIdType points, std::uint64_t base,
                      Mesh& mesh) {
  const Shape shape = data::vtk::shape_of_type(type);
  const bool fits =
      shape != Shape::none && corners.GetNumberOfIds() == data::vtk::corners_of(shape);
  mesh.first.push_back(static_cast<std::uint32_t>(mesh.corners.size()));
  mesh.shapes.push_back(fits ? shape : Shape::none);
  if (!fits) {
    ++mesh.unread[type];
    return {};
  }
  const auto count = static_cast<std::size_t>(corners.GetNumberOfIds());
  std::array<std::uint32_t, 8> out{};
  for (std::size_t i = 0; i < count; ++i) {
    const vtkIdType id = const_cast<vtkIdList&>(corners).GetId(static_cast<vtkIdType>(i));
    if (id < 0 || id >= points) {
      return malformed("a cell refers to point " + std::to_string(id) + ", but there are " +
                       std::to_string(points) + " points");
    }
    out.at(i) = static_cast<std::uint32_t>(base + static_cast<std::uint64_t>(id));
  }
  if (type == pixel || type == voxel) {
    std::swap(out[2], out[3]);
    std::swap(out[6], out[7]);
  }
  if (mesh.corners.size() + count > std::numeric_limits<std::uint32_t>::max()) {
    return malformed("its cells have more than 2^32 corners");
  }
  mesh.corners.insert(mesh.corners.end(), out.begin(),
                      out.begin() + static_cast<std::ptrdiff_t>(count));
  return {};
}

}  // namespace

vtkDataArray* array_of(vtkDataSet& part, const CaseField& field) {
  return field.of_cells ? part.GetCellData()->GetArray(field.array.c_str())
                        : part.GetPointData()->GetArray(field.array.c_str());
}

Result<Mesh> mesh_of(const Parts& parts) {
  Mesh mesh;
  const vtkNew<vtkIdList> corners;
  for (const auto& part : parts) {
    const std::uint64_t base = mesh.points_read;
    const vtkIdType points = part->GetNumberOfPoints();
    mesh.points_read += static_cast<std::uint64_t>(points);
    if (mesh.points_read > data::cf::samples_max) {
      return make_error(ErrorKind::bad_data,
                        "has more than " + std::to_string(data::cf::samples_max) + " points");
    }
    for (vtkIdType p = 0; p < points; ++p) {
      std::array<double, 3> place{};
      part->GetPoint(p, place.data());
      mesh.points.insert(mesh.points.end(), place.begin(), place.end());
    }
    for (vtkIdType c = 0; c < part->GetNumberOfCells(); ++c) {
      part->GetCellPoints(c, corners);
      auto done = add_cell(part->GetCellType(c), *corners, points, base, mesh);
      if (!done) return done.error();
    }
  }
  return mesh;
}

Result<std::vector<float>> values_of(const Parts& parts, const CaseField& field, const Mesh& mesh) {
  const auto components = static_cast<std::size_t>(field.components);
  const std::uint64_t count = field.of_cells ? mesh.cell_count() : mesh.point_count();
  std::vector<float> out(count * components, std::numeric_limits<float>::quiet_NaN());
  std::uint64_t base = 0;
  bool is_found = false;
  for (const auto& part : parts) {
    const vtkIdType tuples = field.of_cells ? part->GetNumberOfCells() : part->GetNumberOfPoints();
    if (static_cast<std::uint64_t>(tuples) > count - base) {
      return make_error(ErrorKind::bad_data, "has a mesh that changed since it was opened");
    }
    vtkDataArray* const array = array_of(*part, field);
    if (array != nullptr) {
      is_found = true;
      if (array->GetNumberOfTuples() != tuples ||
          array->GetNumberOfComponents() != field.components) {
        return malformed(in_quotes(field.name) + " has " +
                         std::to_string(array->GetNumberOfTuples()) + " values of " +
                         std::to_string(array->GetNumberOfComponents()) + " components for " +
                         std::to_string(tuples) + (field.of_cells ? " cells" : " points"));
      }
      for (vtkIdType t = 0; t < tuples; ++t) {
        for (std::size_t c = 0; c < components; ++c) {
          out[c * count + base + static_cast<std::uint64_t>(t)] =
              static_cast<float>(array->GetComponent(t, static_cast<int>(c)));
        }
      }
    }
    base += static_cast<std::uint64_t>(tuples);
  }
  if (!is_found) {
    return make_error(ErrorKind::bad_data, "has no values of " + in_quotes(field.name));
  }
  return out;
}

}  // namespace windsplat::vtk_loader
