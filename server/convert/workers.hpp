// The threads that make units, each with a source of its own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/convert/convert.hpp"
#include "server/convert/memory.hpp"
#include "server/convert/plan.hpp"
#include "server/convert/unit.hpp"

namespace windsplat::convert {

struct Task {
  std::vector<std::size_t> units;  // of the plan, in the order in which they are begun
  // Takes the files of a unit; from any thread.
  std::function<Result<void>(std::size_t unit, UnitFiles files)> take;
};

// Makes units below a folder; returns the bytes of the samples that were read. The first error ends
// all. Errors: bad_data (the input has changed), cancelled, those of `open`, make_unit() and
// `take`.
Result<std::uint64_t> make_units(const data::DatasetInfo& info, const Plan& plan,
                                 const Shares& shares, const Open& open,
                                 const std::filesystem::path& store, const Task& task,
                                 const CancelToken& cancel, const ShowDone& progress);

}  // namespace windsplat::convert
