// Datasets that clients open by choosing entries of an open one: which entries they show, when they
// are closed, and how many there may be.
#pragma once

#include <chrono>
#include <cstddef>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/files/files.hpp"
#include "server/data/model/dataset_info.hpp"

namespace windsplat::data {

// The files of a dataset, and the entry of each of its choices that is to be shown.
struct ChosenEntries {
  Location location;
  std::map<std::string, std::string> shown;  // dimension -> entry
};
// `chosen` replaces entries that the dataset shows. Errors: invalid at /from if it has no choices,
// at /selection for a dimension that is none of them, or for more than selection_max.
Result<ChosenEntries> choose_entries(const DatasetInfo& info, std::optional<Location> location,
                                     const Selection& chosen);
// Whether a dataset shows them, however they were named.
bool shows(const DatasetInfo& info, std::optional<Location> location, const ChosenEntries& entries);

// Thread-safe.
class ChosenDatasets {
 public:
  using Clock = std::chrono::steady_clock;
  // In use while a copy exists; null for a dataset that is not closed.
  using Use = std::shared_ptr<const void>;
  static constexpr std::size_t count_max = 16;
  static constexpr std::chrono::minutes kept{5};
  static constexpr std::size_t closed_max = 256;

  void add(const std::string& id, Clock::time_point now);
  // It was closed, or is to remain open.
  void remove(const std::string& id);

  Use use(const std::string& id);
  // A request named the dataset.
  void touch(const std::string& id, Clock::time_point now);

  // Removes and returns those that were not used for `kept`.
  [[nodiscard]] std::vector<std::string> take_unused(Clock::time_point now);
  // Whether there is room for one more, or one that is not in use. Errors: busy.
  [[nodiscard]] Result<void> check_room() const;
  // Makes room for one more: the one to close, removed from the list; none if there is room.
  // Errors: busy if all are in use.
  [[nodiscard]] Result<std::optional<std::string>> make_room();
  // Whether take_unused() or make_room() closed it, and not since added or opened otherwise. Of the
  // last closed_max.
  [[nodiscard]] bool was_closed(const std::string& id) const;

 private:
  struct Entry {
    Use use = std::make_shared<const char>('\0');
    Clock::time_point used_at;
  };
  using Entries = std::map<std::string, Entry>;  // by id
  // These require the mutex.
  [[nodiscard]] Result<void> find_room() const;
  [[nodiscard]] Entries::const_iterator oldest() const;  // unused for longest; or the end
  void note_closed(const std::string& id);

  mutable std::mutex mutex_;
  Entries entries_;
  std::deque<std::string> closed_;  // the last ones, without duplicates
};

}  // namespace windsplat::data
