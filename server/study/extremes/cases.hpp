// The stiff and extreme cases of `windsplat study --extremes`, in groups that vary one parameter
// each.
#pragma once

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "protocol/view.hpp"
#include "server/data/resident/dataset.hpp"

namespace windsplat::study {

struct Case {
  std::string label;                                        // of the value
  double value = std::numeric_limits<double>::quiet_NaN();  // NaN: not a number
  protocol::View view;  // not completed, nor within the limits of a view; without an eye it is
                        // framed obliquely
  std::shared_ptr<data::Dataset> dataset;
  bool invisible = false;         // its picture is empty
  std::string refused_by_design;  // what the error names, of a case beyond a limit; empty: none is
};

struct Group {
  const char* name;       // --group
  const char* parameter;  // description with its unit
  // Along the cases of one method and projection no opacity may decrease.
  bool monotone;
  // The cases of one projection, in the order of the parameter; none where it does not apply.
  std::vector<Case> (*cases)(protocol::Projection projection);
};

const std::vector<Group>& groups();
std::vector<std::string> group_names();
const char* parameter_of(const std::string& group);  // empty for an unknown name

}  // namespace windsplat::study
