// GrADS descriptors (.ctl) of raw gridded data, and their data files.
#pragma once

#include <memory>
#include <string_view>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/files/files.hpp"

namespace windsplat::data::grads {

// Whether the first bytes are those of a descriptor: records with GrADS keywords, no binary data.
bool looks_like(std::string_view head);

// Levels that descend from 1100 or less are pressures in hPa, as in GrADS. Steps of missing files
// of a template are masked. Errors: bad_data.
Result<std::unique_ptr<cf::ArrayFile>> open(const std::shared_ptr<Files>& files,
                                            std::shared_ptr<const InputFile> descriptor_file);

}  // namespace windsplat::data::grads
