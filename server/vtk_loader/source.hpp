// Cases as a dataset, resampled like the meshes of VTK files (server/data/formats/vtk).
#pragma once

#include <memory>

#include "server/base/error.hpp"
#include "server/data/files/files.hpp"
#include "server/data/model/source.hpp"
#include "server/data/open/cases.hpp"

namespace windsplat::vtk_loader {

// Errors: bad_data, not_found.
Result<std::unique_ptr<data::FileSource>> open(const std::shared_ptr<data::Files>& files,
                                               data::CaseFormat format);

}  // namespace windsplat::vtk_loader
