// The end of a conversion, when all units are there: coarse levels, statistics, coordinates,
// checksums and metadata.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/convert/plan.hpp"
#include "server/convert/unit.hpp"

namespace windsplat::convert {

// Whether the program can open a store of this plan, by its metadata. Errors: invalid, with the
// limit.
Result<void> check_metadata(const data::DatasetInfo& info, const Plan& plan);

// Makes the store complete; the metadata of its root are written last. Files that do not belong to
// it are removed, besides those whose names begin with a dot. Returns the bytes of all of its
// files. Errors: cancelled; those of writing.
Result<std::uint64_t> finish(const data::DatasetInfo& info, const Plan& plan,
                             const std::filesystem::path& store,
                             const std::map<std::size_t, UnitFiles>& units,
                             const CancelToken& cancel);

}  // namespace windsplat::convert
