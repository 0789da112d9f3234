// Dataset -> the description that REST, the stream and `inspect` tell.
#pragma once

#include "protocol/messages.hpp"
#include "server/base/error.hpp"
#include "server/data/store.hpp"

namespace windsplat::scene {

enum class RangesOf {
  none,        // nothing is loaded; ranges, masked counts and defaultView are absent
  first_step,  // "rangeOf": "step"
  all_steps,   // "rangeOf": "all"; reads the whole series once
};

Result<protocol::DatasetDescription> describe(data::Dataset& dataset, RangesOf ranges);

}  // namespace windsplat::scene
