// Dataset -> the description for the HTTP API, the stream and `inspect`.
#pragma once

#include <string>

#include "protocol/messages.hpp"
#include "server/base/error.hpp"
#include "server/data/resident/dataset.hpp"

namespace windsplat::scene {

// Why the default view of a dataset cannot be shown at any step, though each of its stored fields
// can be probed; empty: it can be shown. Errors: out_of_memory, if neither can.
Result<std::string> why_not_shown(const data::Dataset& dataset);

enum class RangesOf {
  none,        // loads nothing; no defaultView, ranges and masked counts only if they are stored
  seen,        // "rangeOf": "step"; loads the fields of defaultView, unless it is not shown, and
               // adds the ranges of all fields that have been loaded at the first step
  first_step,  // "rangeOf": "step"
  all_steps,   // "rangeOf": "all"; reads the whole series once
};

// Adds ranges and masked counts of the first step for the fields loaded meanwhile.
void add_seen_ranges(const data::Dataset& dataset, protocol::DatasetDescription& description);

// Sets what is in memory now, altogether and of each level.
void add_resident_bytes(const data::Dataset& dataset, protocol::DatasetDescription& description);

// Description for lists: fields with their kinds and the number of steps; no axes, steps or ranges.
protocol::DatasetDescription describe_briefly(const data::Dataset& dataset);

// With first_step and all_steps, fields that cannot be read have no range, and notes name them with
// the reason.
Result<protocol::DatasetDescription> describe(data::Dataset& dataset, RangesOf ranges);

}  // namespace windsplat::scene
