// Parts of a case as VTK holds them -> one mesh, and the values of a field on it.
#pragma once

#include <vtkDataArray.h>

#include <vector>

#include "server/base/error.hpp"
#include "server/data/formats/vtk/mesh.hpp"
#include "server/vtk_loader/case.hpp"

namespace windsplat::vtk_loader {

// Points and cells of all parts, one after the other. Errors: bad_data, without the name of the
// case.
Result<data::vtk::Mesh> mesh_of(const Parts& parts);

// The values of a field in a part; null if it has none.
vtkDataArray* array_of(vtkDataSet& part, const CaseField& field);

// Components one after the other, each with a value for every point or cell of the mesh; NaN in
// parts without the field. Errors: bad_data, as above; also if no part has the field.
Result<std::vector<float>> values_of(const Parts& parts, const CaseField& field,
                                     const data::vtk::Mesh& mesh);

}  // namespace windsplat::vtk_loader
