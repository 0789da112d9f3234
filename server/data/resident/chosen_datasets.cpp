#include "server/data/resident/chosen_datasets.hpp"

#include <algorithm>
#include <utility>

#include "server/data/bytes/text.hpp"
#include "server/data/resident/watched_files.hpp"

namespace windsplat::data {

namespace {

// The entry as a dataset that shows it names it: "3" for "3.0" or "03".
std::string known_name(const DimensionChoice& choice, const std::string& value) {
  const auto& listed = choice.values;
  if (std::find(listed.begin(), listed.end(), value) != listed.end()) return value;
  const auto number = bytes::to_double(value);
  if (!number) return value;
  const auto same = std::find_if(listed.begin(), listed.end(), [&](const std::string& one) {
    return bytes::to_double(one) == number;
  });
  return same == listed.end() ? value : *same;
}

// "e-2" of "e-2" and of "e-2,number=3": two files named e.nc have different ids.
std::string base_id(const std::string& id, const Selection& selection) {
  const std::string entries = selection.empty() ? "" : ',' + selection_text(selection);
  return id.ends_with(entries) ? id.substr(0, id.size() - entries.size()) : "";
}

}  // namespace

Result<ChosenEntries> choose_entries(const DatasetInfo& info, std::optional<Location> location,
                                     const Selection& chosen) {
  if (!location || info.choices.empty()) {
    return make_error_at(
        ErrorKind::invalid, "/from",
        "dataset " + in_quotes(info.id) + " has no dimension of which one entry is shown");
  }
  ChosenEntries out{std::move(*location), {}};
  out.location.listed_id = base_id(info.id, out.location.selection);
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
    const auto choice =
        std::find_if(info.choices.begin(), info.choices.end(),
                     [&](const DimensionChoice& known) { return known.name == one.dimension; });
    shown->second = known_name(*choice, one.value);
    std::erase_if(selection, [&](const auto& known) { return known.dimension == one.dimension; });
    selection.push_back({one.dimension, shown->second});
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
  std::erase(closed_, id);
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
    note_closed(at->first);
    at = entries_.erase(at);
  }
  return out;
}

ChosenDatasets::Entries::const_iterator ChosenDatasets::oldest() const {
  auto oldest = entries_.end();
  for (auto at = entries_.begin(); at != entries_.end(); ++at) {
    if (at->second.use.use_count() > 1) continue;
    if (oldest == entries_.end() || at->second.used_at < oldest->second.used_at) oldest = at;
  }
  return oldest;
}

Result<void> ChosenDatasets::find_room() const {
  if (entries_.size() < count_max || oldest() != entries_.end()) return {};
  return make_error(ErrorKind::busy, std::to_string(count_max) +
                                         " other entries of dimensions are shown by sessions, "
                                         "which is the limit; try again later");
}

Result<void> ChosenDatasets::check_room() const {
  const std::lock_guard lock(mutex_);
  return find_room();
}

Result<std::optional<std::string>> ChosenDatasets::make_room() {
  const std::lock_guard lock(mutex_);
  if (auto room = find_room(); !room) return room.error();
  if (entries_.size() < count_max) return std::optional<std::string>();
  const auto at = oldest();
  std::optional<std::string> out = at->first;
  note_closed(at->first);
  entries_.erase(at);
  return out;
}

void ChosenDatasets::note_closed(const std::string& id) {
  std::erase(closed_, id);
  closed_.push_back(id);
  if (closed_.size() > closed_max) closed_.pop_front();
}

bool ChosenDatasets::was_closed(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  return std::find(closed_.begin(), closed_.end(), id) != closed_.end();
}

}  // namespace windsplat::data
