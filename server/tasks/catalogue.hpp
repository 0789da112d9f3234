// The datasets of the API: lookup by id, descriptions, and checks of views.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "protocol/messages.hpp"
#include "protocol/view.hpp"
#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/data/files/files.hpp"
#include "server/data/resident/chosen_datasets.hpp"
#include "server/data/resident/store.hpp"
#include "server/frame/cost.hpp"

namespace windsplat::tasks {

// Thread-safe.
class Catalogue {
 public:
  explicit Catalogue(std::shared_ptr<data::Store> store) : store_(std::move(store)) {}

  [[nodiscard]] Result<std::shared_ptr<data::Dataset>> find(const std::string& id) const;
  // Keeps a dataset that open_entries() opened from being closed while the result exists.
  [[nodiscard]] data::ChosenDatasets::Use use(const std::string& id) { return chosen_.use(id); }

  // All datasets, with ranges where they are known. Loads nothing.
  [[nodiscard]] Result<std::vector<protocol::DatasetDescription>> list() const;

  // The full description. Loads the fields of the default view once: do not call on the io thread.
  Result<protocol::DatasetDescription> describe(const std::string& id,
                                                const CancelToken& cancel = {});

  // Opens a located dataset and lists it, so that forget() can remove it; the value is its id. All
  // callers that open a dataset share it. Errors: those of opening; cancelled, in which case the
  // dataset is listed only if another caller still holds it. May block for a long time.
  Result<std::string> open(const data::Location& location, const CancelToken& cancel);

  // The files of a listed dataset at `chosen`, which replaces entries that it shows. Reads nothing.
  // Errors: not_found at /from; invalid for a dimension that is not one of its choices.
  [[nodiscard]] Result<data::ChosenEntries> entries_of(const std::string& id,
                                                       const data::Selection& chosen) const;
  // Opens them like open(), unless a listed dataset already shows these entries of these files.
  // The dataset is closed once it is not used any more (data::ChosenDatasets). Errors: those of
  // open(); busy.
  Result<std::string> open_entries(const data::ChosenEntries& entries, const CancelToken& cancel);
  // For memory, prefetching and the end of all reads.
  [[nodiscard]] data::Store& store() const { return *store_; }
  // Reopens datasets that changed on disk, closes files that are not being read, and datasets that
  // open_entries() opened and nobody uses; returns the ids of the changed ones. Do not call it on
  // the io thread.
  std::vector<std::string> look_after();
  // Calls load(data::Dataset&). If memory does not suffice, waits for its turn until others release
  // memory (data::Dataset::in_turn()) and calls it once more. `cancel` ends the wait, and the
  // computation of traced lines, surfaces and sunlight, with the error cancelled.
  template <class Load>
  auto load(const data::Dataset& dataset, const Load& load, const CancelToken& cancel = {}) {
    data::Dataset handle = dataset.cancelled_by(cancel);
    auto loaded = load(handle);
    if (loaded || loaded.error().kind != ErrorKind::out_of_memory) return loaded;
    const auto turn = store_->take_turn(dataset, cancel);
    if (!turn) {
      loaded = make_error(ErrorKind::cancelled, "request cancelled");
      return loaded;
    }
    handle = dataset.in_turn(cancel);
    return load(handle);
  }
  // Whether open() added it after the start of the server.
  [[nodiscard]] bool is_opened_later(const std::string& id) const;
  void forget(const std::string& id);
  // Removes a dataset that failed to open from the list. False: no failed dataset has that id.
  bool forget_failed(const std::string& id) { return store_->remove_failed(id); }

  // Checks whether the view can be drawn, without loading. Errors: not_found (dataset), invalid
  // (with a pointer).
  struct Checked {
    int steps = 0;  // number of steps that can be shown
    frame::Cost cost;
  };
  [[nodiscard]] Result<Checked> check(const protocol::View& view) const;

 private:
  struct Described {
    std::weak_ptr<const data::DatasetInfo> of;  // a reopened dataset has a new info
    protocol::DatasetDescription description;
    protocol::DatasetDescription brief;  // without steps and axes, of which there may be millions
  };
  // Number of requests that opened a dataset by open() and still hold it. Guarded by the mutex.
  struct Openers {
    int count = 0;
    bool brought = false;  // added by one of them; removed with the last one
  };
  // The last value: whether this call opened it.
  [[nodiscard]] Result<std::tuple<std::shared_ptr<data::Dataset>, std::shared_ptr<Openers>, bool>>
  open_and_want(const data::Location& location, const CancelToken& cancel);
  // The id, and whether this call opened it.
  [[nodiscard]] Result<std::pair<std::string, bool>> open_listed(const data::Location& location,
                                                                 const CancelToken& cancel);
  void remove(const std::string& id);  // requires the mutex
  void no_longer_want(const std::string& id, const std::shared_ptr<Openers>& openers);
  // The cached description of a dataset; `brief`: for a list.
  [[nodiscard]] std::optional<protocol::DatasetDescription> known(const data::Dataset& dataset,
                                                                  bool brief) const;
  [[nodiscard]] protocol::DatasetDescription refreshed(
      const data::Dataset& dataset, protocol::DatasetDescription description) const;

  std::shared_ptr<data::Store> store_;
  mutable std::mutex mutex_;
  std::map<std::string, Described> described_;
  std::map<std::string, std::shared_ptr<Openers>> openers_;  // keyed by dataset
  mutable data::ChosenDatasets chosen_;                      // find() notes the time of use
};

// The dataset of a view, as the handle that yields its fields, which are differences if the view
// has one. Errors: those of Catalogue::find(); not_found at /difference/dataset; those of
// scene::with_difference().
Result<std::shared_ptr<data::Dataset>> find_shown(const Catalogue& catalogue,
                                                  const protocol::View& view);

// An out-of-memory error extended by the name of what was being loaded; other errors are unchanged.
Error with_dataset_name(Error error, const std::string& dataset, const std::string& field = "");

}  // namespace windsplat::tasks
