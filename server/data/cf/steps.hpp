// The time steps of a file.
#pragma once

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/model/dataset_info.hpp"

namespace windsplat::data::cf {

// Sets steps, time units and calendar of `info`, and adds notes of assumptions. time: the time
// dimension, coordinate: its variable; -1: there is none, and a scalar time is searched for.
// Errors: bad_data.
Result<void> find_steps(const ArrayFile& file, int time, int coordinate, DatasetInfo& info);

}  // namespace windsplat::data::cf
