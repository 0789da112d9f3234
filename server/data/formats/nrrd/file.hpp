// NRRD files, header and data in one file or apart. Files -> header -> arrays of cf.
#pragma once

#include <memory>
#include <string_view>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/files/files.hpp"

namespace windsplat::data::nrrd {

// Whether a file that begins so is NRRD.
bool looks_like(std::string_view head);

// Axes are turned to run left to right, posterior to anterior, inferior to superior where the
// header names such a space; a vector's components turn with them. Errors: bad_data.
Result<std::unique_ptr<cf::ArrayFile>> open(const std::shared_ptr<Files>& files,
                                            std::shared_ptr<const InputFile> header_file);

}  // namespace windsplat::data::nrrd
