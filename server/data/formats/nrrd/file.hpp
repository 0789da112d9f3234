// NRRD files with attached or detached headers. Files -> header -> arrays of cf.
#pragma once

#include <memory>
#include <string_view>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/files/files.hpp"

namespace windsplat::data::nrrd {

// Whether the first bytes of a file are those of NRRD.
bool looks_like(std::string_view head);

// If the header names an anatomical space, axes are reversed to run left to right, posterior to
// anterior, inferior to superior, together with vector components. Errors: bad_data.
Result<std::unique_ptr<cf::ArrayFile>> open(const std::shared_ptr<Files>& files,
                                            std::shared_ptr<const InputFile> header_file);

}  // namespace windsplat::data::nrrd
