// The attributes of a store: OME-NGFF multiscales, and `windsplat`, which names its levels.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/convert/plan.hpp"

namespace windsplat::convert {

// `bytes`: of the files of each level; `contents`: a digest of sizes and checksums of all files.
data::zarr::OrderedJson root_attributes(const data::DatasetInfo& info, const Plan& plan,
                                        const std::vector<std::uint64_t>& bytes,
                                        const std::string& contents);
// Of the groups of levels: they are CF datasets.
std::vector<data::zarr::WrittenGroup> level_groups(const data::DatasetInfo& info, const Plan& plan);

}  // namespace windsplat::convert
