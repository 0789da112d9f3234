// Arguments -> the views of one picture, or of two side by side, and their datasets.
#pragma once

#include <memory>
#include <vector>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/cli/picture.hpp"
#include "server/data/resident/dataset.hpp"

namespace windsplat::cli {

struct Panel {
  protocol::View view;
  std::shared_ptr<data::Dataset> dataset;  // the handle that yields the fields of the view
  bool keeps_step = false;                 // whether animate leaves its step as it is
  protocol::View asked{};                  // before defaults were filled in
};

// One, or two with --beside, --beside-step or --beside-set: the second has the view of the first
// with these changes, its camera, and common defaults (share.hpp). Both have titles that tell them
// apart. Errors: those of assemble_view(), open_datasets() and frame::complete(), of the second
// with the option's name; invalid for a second camera or size, and for limits of quality, which
// could give the two pictures different sizes.
Result<std::vector<Panel>> open_panels(const ViewArguments& arguments);

}  // namespace windsplat::cli
