// The store's thread that loads what viewers will want next. Wishes in, resident volumes out.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "server/data/resident/store.hpp"

namespace windsplat::data {

class Ahead {
 public:
  explicit Ahead(std::shared_ptr<Budget> budget);
  ~Ahead();  // ends after the load in work
  Ahead(const Ahead&) = delete;
  Ahead& operator=(const Ahead&) = delete;

  // See Store::wish.
  void wish(std::uint64_t owner, std::vector<Wish> wishes);
  // Nothing of a dataset is loaded any more.
  void forget(const DatasetInfo& info);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace windsplat::data
