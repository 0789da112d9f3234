// OpenDX files in native format: fields, series of fields, groups of either. Files -> objects ->
// arrays of cf.
#pragma once

#include <memory>
#include <string_view>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/files/files.hpp"

namespace windsplat::data::dx {

// Whether the first bytes contain a line with a DX object.
bool looks_like(std::string_view head);

// Members of a series are time steps, members of a group are fields on one grid. Errors: bad_data.
Result<std::unique_ptr<cf::ArrayFile>> open(const std::shared_ptr<Files>& files,
                                            std::shared_ptr<const InputFile> input);

}  // namespace windsplat::data::dx
