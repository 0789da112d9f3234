// GrADS descriptors (.ctl) of raw gridded data, and the data files that they name.
#pragma once

#include <memory>
#include <string_view>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/files/files.hpp"

namespace windsplat::data::grads {

// Whether a text that begins so is a descriptor: records by GrADS' keywords and nothing binary.
bool looks_like(std::string_view head);

// Levels that fall from 1100 or less are pressures in hPa, as GrADS takes them. Files of a template
// that are not there are masked. Errors: bad_data.
Result<std::unique_ptr<cf::ArrayFile>> open(const std::shared_ptr<Files>& files,
                                            std::shared_ptr<const InputFile> descriptor_file);

}  // namespace windsplat::data::grads
