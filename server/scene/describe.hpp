// Dataset -> the description that REST, the stream and `inspect` tell.
#pragma once

#include "protocol/messages.hpp"
#include "server/base/error.hpp"
#include "server/data/resident/dataset.hpp"

namespace windsplat::scene {

enum class RangesOf {
  none,        // nothing is loaded; ranges, masked counts and defaultView are absent
  seen,        // "rangeOf": "step"; the fields of defaultView are loaded, and ranges told of those
               // that were ever loaded at the first step
  first_step,  // "rangeOf": "step"
  all_steps,   // "rangeOf": "all"; reads the whole series once
};

// Ranges and masked counts of the first step of what was loaded since.
void add_seen_ranges(const data::Dataset& dataset, protocol::DatasetDescription& description);

// What a list tells: fields and their kinds, the number of steps; no axes, steps or ranges.
protocol::DatasetDescription describe_briefly(const data::Dataset& dataset);

Result<protocol::DatasetDescription> describe(data::Dataset& dataset, RangesOf ranges);

}  // namespace windsplat::scene
