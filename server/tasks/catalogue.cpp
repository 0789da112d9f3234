// Describes datasets of the store and caches the descriptions.
#include "server/tasks/catalogue.hpp"

#include <algorithm>
#include <utility>

#include "server/scene/completed_view.hpp"
#include "server/scene/defaults.hpp"
#include "server/scene/describe.hpp"
#include "server/scene/difference/difference.hpp"

namespace windsplat::tasks {

Result<std::shared_ptr<data::Dataset>> Catalogue::find(const std::string& id) const {
  auto dataset = store_->find(id);
  if (!dataset && chosen_.was_closed(id)) {
    return make_error_at(
        ErrorKind::not_found, "/dataset",
        "dataset " + in_quotes(id) + " was closed, because it was not used for " +
            std::to_string(data::ChosenDatasets::kept.count()) +
            " minutes or made room for other entries; choose the entry again to open it");
  }
  if (!dataset) return make_error_at(ErrorKind::not_found, "/dataset", dataset.error().message);
  chosen_.touch(id, data::ChosenDatasets::Clock::now());
  return dataset;
}

std::optional<protocol::DatasetDescription> Catalogue::known(const data::Dataset& dataset,
                                                             bool brief) const {
  const std::lock_guard lock(mutex_);
  const auto found = described_.find(dataset.info().id);
  if (found == described_.end() || found->second.of.lock().get() != &dataset.info()) {
    return std::nullopt;
  }
  return brief ? found->second.brief : found->second.description;
}

protocol::DatasetDescription Catalogue::refreshed(const data::Dataset& dataset,
                                                  protocol::DatasetDescription description) const {
  scene::add_seen_ranges(dataset, description);
  scene::add_resident_bytes(dataset, description);
  if (std::string note = store_->note(description.id); !note.empty()) {
    description.notes.push_back(std::move(note));
  }
  if (const std::string problem = store_->problem(description.id); !problem.empty()) {
    description.state = "failed";
    description.notes.push_back(problem);
  }
  return description;
}

Result<std::vector<protocol::DatasetDescription>> Catalogue::list() const {
  std::vector<protocol::DatasetDescription> out;
  for (const auto& dataset : store_->all()) {
    auto description = known(*dataset, true);
    if (!description) description = scene::describe_briefly(*dataset);
    out.push_back(refreshed(*dataset, std::move(*description)));
  }
  for (auto& failed : store_->failed()) {
    protocol::DatasetDescription description;
    description.id = description.title = std::move(failed.id);
    description.state = "failed";
    description.notes = {std::move(failed.problem)};
    out.push_back(std::move(description));
  }
  return out;
}

Result<protocol::DatasetDescription> Catalogue::describe(const std::string& id,
                                                         const CancelToken& cancel) {
  const auto dataset = find(id);
  if (!dataset) return dataset.error();
  if (auto description = known(**dataset, false))
    return refreshed(**dataset, std::move(*description));
  auto description = load(
      **dataset,
      [](data::Dataset& loading) { return scene::describe(loading, scene::RangesOf::seen); },
      cancel);
  if (!description) {
    const auto fields = scene::fields_of({}, (*dataset)->info());
    return with_dataset_name((*dataset)->with_need(description.error(), fields), id);
  }
  {
    protocol::DatasetDescription brief = scene::describe_briefly(**dataset);
    brief.fields = description->fields;
    const std::lock_guard lock(mutex_);
    described_.insert_or_assign(
        id, Described{(*dataset)->shared_info(), *description, std::move(brief)});
  }
  return refreshed(**dataset, std::move(*description));
}

Result<std::string> Catalogue::open(const data::Location& location, const CancelToken& cancel) {
  auto opened = open_listed(location, cancel);
  if (!opened) return opened.error();
  chosen_.remove(opened->first);  // named by a client, so it stays
  return std::move(opened->first);
}

Result<std::pair<std::string, bool>> Catalogue::open_listed(const data::Location& location,
                                                            const CancelToken& cancel) {
  const auto opened = open_and_want(location, cancel);
  if (!opened) return opened.error();
  const auto& [dataset, openers, is_new] = *opened;
  std::string id = dataset->info().id;
  // A dataset that cannot be described must not invalidate the whole list.
  const auto description = scene::describe(*dataset, scene::RangesOf::none);
  if (description && !cancel.cancelled()) return std::pair(std::move(id), is_new);
  no_longer_want(id, openers);
  if (!description) return description.error();
  return make_error(ErrorKind::cancelled, "request cancelled");
}

Result<std::tuple<std::shared_ptr<data::Dataset>, std::shared_ptr<Catalogue::Openers>, bool>>
Catalogue::open_and_want(const data::Location& location, const CancelToken& cancel) {
  for (;;) {
    auto added = store_->add_or_find(location, cancel);
    if (!added) return added.error();
    const std::string& id = added->dataset->info().id;
    const std::lock_guard lock(mutex_);
    // The dataset may have been removed before this opener was registered.
    if (const auto listed = store_->find(id); !listed || *listed != added->dataset) continue;
    std::shared_ptr<Openers>& openers = openers_[id];
    if (!openers) openers = std::make_shared<Openers>();
    ++openers->count;
    openers->brought = openers->brought || added->is_new;
    return std::tuple(std::move(added->dataset), openers, added->is_new);
  }
}

Result<data::ChosenEntries> Catalogue::entries_of(const std::string& id,
                                                  const data::Selection& chosen) const {
  const auto dataset = find(id);
  if (!dataset) return make_error_at(ErrorKind::not_found, "/from", dataset.error().message);
  return data::choose_entries((*dataset)->info(), store_->location(id), chosen);
}

Result<std::string> Catalogue::open_entries(const data::ChosenEntries& entries,
                                            const CancelToken& cancel) {
  for (const auto& dataset : store_->all()) {
    const std::string& id = dataset->info().id;
    if (!data::shows(dataset->info(), store_->location(id), entries)) continue;
    chosen_.touch(id, data::ChosenDatasets::Clock::now());
    return id;
  }
  if (auto room = chosen_.check_room(); !room) return room.error();
  auto opened = open_listed(entries.location, cancel);
  if (!opened) return opened.error();
  auto& [id, is_new] = *opened;
  if (!is_new) return std::move(id);
  // Only now is it known that the entries exist.
  const auto surplus = chosen_.make_room();
  if (!surplus) {
    forget(id);
    return surplus.error();
  }
  if (*surplus) forget(**surplus);
  chosen_.add(id, data::ChosenDatasets::Clock::now());
  return std::move(id);
}

std::vector<std::string> Catalogue::look_after() {
  for (const std::string& id : chosen_.take_unused(data::ChosenDatasets::Clock::now())) forget(id);
  store_->release_idle();
  return store_->look_for_changes();
}

void Catalogue::no_longer_want(const std::string& id, const std::shared_ptr<Openers>& openers) {
  const std::lock_guard lock(mutex_);
  if (--openers->count > 0) return;
  const auto known = openers_.find(id);
  if (known == openers_.end() || known->second != openers) return;  // removed meanwhile
  openers_.erase(known);
  if (openers->brought) remove(id);
}

bool Catalogue::is_opened_later(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  const auto known = openers_.find(id);
  return known != openers_.end() && known->second->brought;
}

void Catalogue::forget(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const auto known = openers_.find(id);
  if (known == openers_.end() || !known->second->brought) return;
  openers_.erase(known);
  remove(id);
}

void Catalogue::remove(const std::string& id) {
  described_.erase(id);
  chosen_.remove(id);
  (void)store_->remove(id);  // not_found: already removed
}

Result<Catalogue::Checked> Catalogue::check(const protocol::View& view) const {
  const auto dataset = find_shown(*this, view);
  if (!dataset) return dataset.error();
  const auto outline = scene::outline(view, **dataset);
  if (!outline) return outline.error();
  if (auto ok = scene::check_difference(view, **dataset); !ok) return ok.error();
  std::size_t steps = (*dataset)->info().steps.size();
  if (const auto minus = (*dataset)->subtrahend(); minus && !minus->step) {
    steps = std::min(steps, minus->info->steps.size());
  }
  return Checked{static_cast<int>(steps), frame::cost_of(*outline, **dataset)};
}

Result<std::shared_ptr<data::Dataset>> find_shown(const Catalogue& catalogue,
                                                  const protocol::View& view) {
  auto dataset = catalogue.find(view.dataset);
  if (!dataset || !view.difference) return dataset;
  std::shared_ptr<data::Dataset> other;
  if (const auto& named = view.difference->dataset) {
    auto found = catalogue.find(*named);
    if (!found) {
      return make_error_at(ErrorKind::not_found, "/difference/dataset",
                           found.error().at.front().detail);
    }
    other = std::move(*found);
  }
  auto difference = scene::with_difference(view, **dataset, other.get());
  if (!difference) return difference.error();
  return std::make_shared<data::Dataset>(std::move(*difference));
}

Error with_dataset_name(Error error, const std::string& dataset, const std::string& field) {
  if (error.kind != ErrorKind::out_of_memory) return error;
  std::string message = "dataset '";
  message += printable(dataset);
  message += '\'';
  if (!field.empty()) {
    message += ", field '";
    message += printable(field);
    message += '\'';
  }
  message += ": ";
  message += error.message;
  error.message = std::move(message);
  return error;
}

}  // namespace windsplat::tasks
