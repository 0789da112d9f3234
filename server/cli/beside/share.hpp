// Two completed views -> the same ranges, lengths and opacities in both, so that their pictures can
// be compared. Pure.
#pragma once

#include <array>

#include "protocol/view.hpp"
#include "server/data/model/dataset_info.hpp"

namespace windsplat::cli {

struct ComparedView {
  const protocol::View& asked;  // what the user gives is kept
  protocol::View& full;         // completed
  const data::DatasetInfo& info;
};

// Where both views show the same quantity in the same units, defaults become equal: ranges of
// colours and magnitudes cover those of both; lengths, thresholds and opacities are those of the
// first view.
void share_defaults(const std::array<ComparedView, 2>& views);

}  // namespace windsplat::cli
