// The datasets as the edge sees them: by id, described, and views checked against them.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "protocol/messages.hpp"
#include "protocol/view.hpp"
#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/data/files/files.hpp"
#include "server/data/resident/store.hpp"
#include "server/frame/cost.hpp"

namespace windsplat::net {

// Thread-safe.
class Catalogue {
 public:
  explicit Catalogue(std::shared_ptr<data::Store> store) : store_(std::move(store)) {}

  [[nodiscard]] Result<std::shared_ptr<data::Dataset>> find(const std::string& id) const;

  // Every dataset, with ranges where they are known. Loads nothing.
  [[nodiscard]] Result<std::vector<protocol::DatasetDescription>> list() const;

  // The long form. Loads the fields of the default view, once: not for the io thread.
  Result<protocol::DatasetDescription> describe(const std::string& id,
                                                const CancelToken& cancel = {});

  // Opens what was located and lists it, so that forget() may take it back; the value is its id.
  // What is listed already is the same dataset, and whoever listed it keeps it. Errors: those of
  // opening; cancelled, and then it is not listed unless somebody else wants it. Takes as long as
  // it takes.
  Result<std::string> open(const data::Location& location, const CancelToken& cancel);
  // What a session will want; see data::Store::wish.
  void request_prefetch(std::uint64_t owner, std::vector<data::PrefetchRequest> requests) {
    store_->request_prefetch(owner, std::move(requests));
  }
  // Opens anew what changed on disk and lets go of what is not read; the ids of what changed. Not
  // for the io thread.
  std::vector<std::string> look_after() {
    store_->release_idle();
    return store_->look_for_changes();
  }
  [[nodiscard]] data::BudgetCounts counts() const { return store_->counts(); }
  // Calls load(data::Dataset&), and where there is no room for it once more when its turn has come,
  // which waits until others let go of what they hold (data::Dataset::in_turn()). `cancel` ends
  // that; the error is cancelled then.
  template <class Load>
  auto load(const data::Dataset& dataset, const Load& load, const CancelToken& cancel = {}) {
    data::Dataset handle = dataset;
    auto loaded = load(handle);
    if (loaded || loaded.error().kind != ErrorKind::out_of_memory) return loaded;
    const auto turn = store_->take_turn(dataset, cancel);
    if (!turn) {
      loaded = make_error(ErrorKind::cancelled, "nobody waits for the answer");
      return loaded;
    }
    handle = dataset.in_turn(cancel);
    return load(handle);
  }
  // See data::Store::reserve.
  Result<std::shared_ptr<const void>> reserve(std::uint64_t bytes) {
    return store_->reserve(bytes);
  }
  [[nodiscard]] std::uint64_t room() const { return store_->room(); }
  // See data::Store::end.
  void end() { store_->end(); }
  // Whether open() brought it: it was not there when the server began.
  [[nodiscard]] bool is_opened_later(const std::string& id) const;
  void forget(const std::string& id);
  // Takes what could not be opened off the list. False: nothing of that id is listed as failed.
  bool forget_failed(const std::string& id) { return store_->remove_failed(id); }

  // Whether the view can be drawn, without loading anything. Errors: not_found (dataset), invalid
  // (with a pointer).
  struct Checked {
    int steps = 0;  // of the dataset
    frame::Cost cost;
  };
  [[nodiscard]] Result<Checked> check(const protocol::View& view) const;

 private:
  struct Described {
    std::weak_ptr<const data::DatasetInfo> of;  // a dataset opened anew has another one
    protocol::DatasetDescription description;
    protocol::DatasetDescription brief;  // without steps and axes, which may be millions
  };
  // Who opened a dataset by open() and still wants it.
  struct Openers {
    int count = 0;
    bool brought = false;  // by one of them, so that it may go with the last one
  };
  using OpenersPtr = std::shared_ptr<Openers>;  // used under the mutex
  [[nodiscard]] Result<std::pair<std::shared_ptr<data::Dataset>, OpenersPtr>> open_and_want(
      const data::Location& location);
  void remove(const std::string& id);  // under the mutex
  void no_longer_want(const std::string& id, const OpenersPtr& openers);
  // What is remembered of a dataset; `brief`: for a list.
  [[nodiscard]] std::optional<protocol::DatasetDescription> known(const data::Dataset& dataset,
                                                                  bool brief) const;
  [[nodiscard]] protocol::DatasetDescription refreshed(
      const data::Dataset& dataset, protocol::DatasetDescription description) const;

  std::shared_ptr<data::Store> store_;
  mutable std::mutex mutex_;
  std::map<std::string, Described> described_;
  std::map<std::string, OpenersPtr> openers_;  // by dataset
};

// Where memory is the reason: the same, naming what was to be loaded. Others as they are.
Error with_dataset_name(Error error, const std::string& dataset, const std::string& field = "");

}  // namespace windsplat::net
