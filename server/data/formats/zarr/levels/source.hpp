// A store with levels as a source: level 0 as of any store, and the arrays of its other levels.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "server/base/error.hpp"
#include "server/data/files/files.hpp"
#include "server/data/formats/zarr/store.hpp"
#include "server/data/model/source.hpp"

namespace windsplat::data::zarr {

// Appends levels and ranges to the description of level 0. Fields whose samples are converted when
// they are read have none. Errors: bad_data, which names the array that is missing, or has another
// shape or type than its level.
Result<std::unique_ptr<FileSource>> with_levels(std::unique_ptr<FileSource> finest,
                                                std::unique_ptr<LevelStore> levels);

}  // namespace windsplat::data::zarr
