// Fields in memory with the levels that a store of `windsplat convert` has of them.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <tuple>
#include <vector>

#include "server/data/model/dataset_info.hpp"
#include "server/data/model/source.hpp"
#include "server/data/model/stored.hpp"
#include "server/data/model/volume.hpp"

namespace windsplat::test {

// Levels that were made, by field, level and kind; shared by sources of the same fields.
using StoredLevelCache = std::map<std::tuple<std::size_t, std::size_t, data::StoredAs>,
                                  std::shared_ptr<const data::Volume>>;

// volumes: of the fields of the description, at every step. Each level halves every axis. Two
// values of scalars, draws and middles of kernels of vectors are those of data::coarsen().
std::unique_ptr<data::Source> stored_fields(
    data::DatasetInfo info, std::vector<std::shared_ptr<const data::Volume>> volumes, int levels,
    std::shared_ptr<StoredLevelCache> cache = std::make_shared<StoredLevelCache>());

}  // namespace windsplat::test
