#include "server/data/resident/chosen_datasets.hpp"

#include <algorithm>
#include <utility>

#include "server/data/resident/watched_files.hpp"

namespace windsplat::data {

Result<ChosenEntries> choose_entries(const DatasetInfo& info, std::optional<Location> location,
                                     const Selection& chosen) {
  if (!location || info.choices.empty()) {
    return make_error_at(
        ErrorKind::invalid, "/from",
        "dataset " + in_quotes(info.id) + " has no dimension of which one entry is shown");
  }
  ChosenEntries out{std::move(*location), {}};
  std::string names;
  for (const DimensionChoice& choice : info.choices) {
    out.shown[choice.name] = choice.chosen;
    names += (names.empty() ? "" : ", ") + in_quotes(choice.name);
  }
  Selection& selection = out.location.selection;
  for (const SelectedEntry& one : chosen) {
    const auto shown = out.shown.find(one.dimension);
    if (shown == out.shown.end()) {
      return make_error_at(ErrorKind::invalid, "/selection",
                           in_quotes(one.dimension) + " is not a dimension of which " +
                               in_quotes(info.id) + " shows one entry: these are " + names);
    }
    shown->second = one.value;
    std::erase_if(selection, [&](const auto& known) { return known.dimension == one.dimension; });
    selection.push_back(one);
  }
  if (selection.size() > selection_max) {
    return make_error_at(ErrorKind::invalid, "/selection",
                         "entries of more than " + std::to_string(selection_max) + " dimensions");
  }
  return out;
}

bool shows(const DatasetInfo& info, std::optional<Location> location,
           const ChosenEntries& entries) {
  if (!location) return false;
  std::map<std::string, std::string> shown;
  for (const DimensionChoice& choice : info.choices) shown[choice.name] = choice.chosen;
  location->selection = entries.location.selection;
  return shown == entries.shown && key_of(*location) == key_of(entries.location);
}

void ChosenDatasets::add(const std::string& id, Clock::time_point now) {
  Entry entry;
  entry.used_at = now;
  const std::lock_guard lock(mutex_);
  entries_.insert_or_assign(id, std::move(entry));
}

void ChosenDatasets::remove(const std::string& id) {
  const std::lock_guard lock(mutex_);
  entries_.erase(id);
}

ChosenDatasets::Use ChosenDatasets::use(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const auto found = entries_.find(id);
  return found == entries_.end() ? nullptr : found->second.use;
}

void ChosenDatasets::touch(const std::string& id, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (const auto found = entries_.find(id); found != entries_.end()) found->second.used_at = now;
}

std::vector<std::string> ChosenDatasets::take_unused(Clock::time_point now) {
  std::vector<std::string> out;
  const std::lock_guard lock(mutex_);
  for (auto at = entries_.begin(); at != entries_.end();) {
    if (at->second.use.use_count() > 1) at->second.used_at = now;
    if (now - at->second.used_at < kept) {
      ++at;
      continue;
    }
    out.push_back(at->first);
    at = entries_.erase(at);
  }
  return out;
}

Result<std::optional<std::string>> ChosenDatasets::make_room() {
  const std::lock_guard lock(mutex_);
  if (entries_.size() < count_max) return std::optional<std::string>();
  auto oldest = entries_.end();
  for (auto at = entries_.begin(); at != entries_.end(); ++at) {
    if (at->second.use.use_count() > 1) continue;
    if (oldest == entries_.end() || at->second.used_at < oldest->second.used_at) oldest = at;
  }
  if (oldest == entries_.end()) {
    return make_error(ErrorKind::busy, std::to_string(count_max) +
                                           " other entries of dimensions are shown by sessions, "
                                           "which is the limit; try again later");
  }
  std::optional<std::string> out = oldest->first;
  entries_.erase(oldest);
  return out;
}

}  // namespace windsplat::data
