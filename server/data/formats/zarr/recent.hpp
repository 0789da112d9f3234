// What was read last of one variable (decoded chunks, open shards), the least recently used evicted
// first.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <unordered_map>
#include <utility>

namespace windsplat::data::zarr {

template <class Item>
class Recent {
 public:
  static constexpr std::size_t bookkeeping_bytes = 256;  // overhead of an item

  // Drops the items of another variable.
  void select(int variable) {
    if (variable != variable_) clear();
    variable_ = variable;
  }
  void forget(int variable) {
    if (variable == variable_) clear();
  }
  // Null if absent; valid until the next call.
  Item* find(std::uint64_t number) {
    const auto at = by_number_.find(number);
    if (at == by_number_.end()) return nullptr;
    items_.splice(items_.begin(), items_, at->second);
    return &items_.front().item;
  }
  [[nodiscard]] bool has(int variable, std::uint64_t number) const {
    return variable == variable_ && by_number_.contains(number);
  }
  // Drops the item that find() or add() returned last.
  void drop_newest() {
    bytes_ -= items_.front().bytes;
    by_number_.erase(items_.front().number);
    items_.pop_front();
  }
  // Evicts items until `bytes` more fit, or none is left.
  void evict_for(std::size_t bytes, std::size_t bytes_max) {
    while (!items_.empty() && bytes_ + bytes > bytes_max) {
      bytes_ -= items_.back().bytes;
      by_number_.erase(items_.back().number);
      items_.pop_back();
    }
  }
  // An item that takes `bytes`.
  Item* add(std::uint64_t number, Item item, std::size_t bytes) {
    bytes_ += bytes + bookkeeping_bytes;
    items_.push_front({number, bytes + bookkeeping_bytes, std::move(item)});
    by_number_.emplace(number, items_.begin());
    return &items_.front().item;
  }

 private:
  struct Kept {
    std::uint64_t number = 0;
    std::size_t bytes = 0;
    Item item;
  };
  void clear() {
    by_number_.clear();
    items_.clear();
    bytes_ = 0;
  }

  int variable_ = -1;
  std::size_t bytes_ = 0;
  std::list<Kept> items_;  // most recently used first
  std::unordered_map<std::uint64_t, typename std::list<Kept>::iterator> by_number_;
};

}  // namespace windsplat::data::zarr
