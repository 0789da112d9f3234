// Fields whose lines the direction benchmark looks at.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/data/resident/dataset.hpp"

namespace windsplat::bench {

struct DirectionField {
  std::string name;     // of a formula, or the path of a file
  bool learnt = false;  // rules are learnt on it, and it judges none
  bool is_file = false;
};

// Formulas for learning, and others for judging.
const std::vector<DirectionField>& formula_fields();

// `side`: samples along each axis of a formula.
std::unique_ptr<data::Dataset> dataset_of(const DirectionField& field, int side);

}  // namespace windsplat::bench
