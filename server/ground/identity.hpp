// What a result depends on, for comparison with that of an earlier one.
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

namespace windsplat::ground {

struct Identity {
  std::vector<double> numbers;
  std::vector<std::weak_ptr<const void>> shared;  // by their owners, which are not held

  void clear() {
    numbers.clear();
    shared.clear();
  }
  void add(const std::vector<double>& values) {
    numbers.push_back(static_cast<double>(values.size()));
    numbers.insert(numbers.end(), values.begin(), values.end());
  }
};

inline bool operator==(const Identity& a, const Identity& b) {
  const auto is_same = [](const auto& one, const auto& other) {
    return !one.owner_before(other) && !other.owner_before(one);
  };
  return a.numbers == b.numbers &&
         std::equal(a.shared.begin(), a.shared.end(), b.shared.begin(), b.shared.end(), is_same);
}

}  // namespace windsplat::ground
