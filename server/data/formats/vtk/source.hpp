// VTK files as a dataset: XML .vti .vtr .vts .vtu, their parallel forms, .vtm .vtpd .vtpc .pvd,
// legacy .vtk and .vtkhdf, or a series of them.
#pragma once

#include <memory>
#include <string_view>

#include "server/base/error.hpp"
#include "server/data/files/files.hpp"
#include "server/data/model/source.hpp"

namespace windsplat::data::vtk {

// Whether the first bytes of a file are those of a VTK format.
bool is_vtk(std::string_view head);
// Whether the first file is HDF5 with the group /VTKHDF.
bool is_vtkhdf(Files& files);

// Errors: bad_data, not_found.
Result<std::unique_ptr<FileSource>> open(const std::shared_ptr<Files>& files);

}  // namespace windsplat::data::vtk
