// OpenDX files in its native format: fields, series of fields, groups of either. Files -> objects
// -> arrays of cf.
#pragma once

#include <memory>
#include <string_view>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/files/files.hpp"

namespace windsplat::data::dx {

// Whether a text that begins so has a line with a DX object.
bool looks_like(std::string_view head);

// A series' members are steps in time, a group's members fields on one grid. Errors: bad_data.
Result<std::unique_ptr<cf::ArrayFile>> open(const std::shared_ptr<Files>& files,
                                            std::shared_ptr<const InputFile> input);

}  // namespace windsplat::data::dx
