// The fields that can be computed from those of a dataset, each with its rule.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "server/data/model/dataset_info.hpp"

namespace windsplat::data::derived {

enum class Quantity {
  magnitude,
  horizontal_magnitude,
  curl,
  vertical_curl,
  divergence,
  horizontal_divergence,
  q_criterion,
  helicity,
  temperature,
  relative_humidity,
};

// A scalar among the inputs: value times factor plus offset is in SI units.
struct Input {
  std::size_t field = 0;  // index into the fields of the dataset
  double factor = 1;
  double offset = 0;
};

struct Rule {
  Quantity quantity = Quantity::magnitude;
  FieldInfo info;
  // Of a vector: its index, factors of its components, and the field of heights in metres if the
  // vertical axis does not give them.
  std::size_t vector = 0;
  std::array<double, 3> factor{1, 1, 1};
  std::optional<Input> heights;
  // Of air. Without a field, the temperature is that of `potential` and the pressure in Pa that of
  // the levels.
  std::optional<Input> temperature;
  std::optional<Input> potential;
  std::optional<Input> pressure;
  std::optional<Input> humidity;
  bool is_specific = false;  // the humidity relates to moist air, otherwise to dry air
};

// In the order in which they are listed. Those of the first four vectors: of a velocity, its
// quantities; of other vectors magnitude, divergence and curl. A name that the dataset uses is not
// offered, nor what needs a length that is not known. `info` has the dataset's own fields only.
std::vector<Rule> find_rules(const DatasetInfo& info);

}  // namespace windsplat::data::derived
