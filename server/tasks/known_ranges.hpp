// Cache of ranges over all steps by dataset and field, valid while the dataset is open: reading
// every step is slow.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "server/data/model/dataset_info.hpp"
#include "server/data/model/measure.hpp"

namespace windsplat::tasks {

// Thread-safe.
class KnownRanges {
 public:
  // Keyed by Dataset::shared_info(): a reopened dataset, or another of the same name, has other
  // entries.
  using Of = std::shared_ptr<const data::DatasetInfo>;

  [[nodiscard]] std::optional<data::FieldRange> find(const Of& dataset,
                                                     const std::string& field) const {
    const std::lock_guard lock(mutex_);
    const auto ranges = ranges_.find(dataset);
    if (ranges == ranges_.end()) return std::nullopt;
    const auto at = ranges->second.find(field);
    return at == ranges->second.end() ? std::nullopt : std::optional(at->second);
  }
  void keep(const Of& dataset, const std::string& field, const data::FieldRange& range) {
    const std::lock_guard lock(mutex_);
    std::erase_if(ranges_, [](const auto& known) { return known.first.expired(); });
    ranges_[dataset].insert_or_assign(field, range);
  }

 private:
  using ByField = std::map<std::string, data::FieldRange>;
  mutable std::mutex mutex_;
  std::map<std::weak_ptr<const data::DatasetInfo>, ByField, std::owner_less<>> ranges_;
};

}  // namespace windsplat::tasks
