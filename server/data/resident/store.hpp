// The resident store: opens every dataset once, loads every field and step once on first need,
// shares them among all sessions, and evicts the least recently used beyond the memory limit.
#pragma once

#include <any>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/data/files/files.hpp"
#include "server/data/model/coarsen.hpp"
#include "server/data/resident/budget.hpp"
#include "server/data/resident/dataset.hpp"

namespace windsplat::data {

// A prefetch request: a field at a step, or what is derived from it. `with`, which is shown
// together with it, is not loaded, but not evicted either.
struct PrefetchRequest {
  Dataset dataset;
  std::string field;
  std::size_t step = 0;
  Derivation how;
  std::optional<ResidentKey> with;
};

struct StoreOptions {
  std::uint64_t bytes_max = 0;
  Storage storage = Storage::float32;
  // Opens datasets other than samples; the default reads files in this process.
  std::function<Result<std::unique_ptr<Source>>(const Location&, const CancelToken&)> open;
  std::shared_ptr<Budget> budget =
      nullptr;  // replaces the store's own budget of bytes_max; shared with sources
  // A check that a dataset must pass to be listed or reopened; null: no check. Called under the
  // store's lock, so it must not call the store.
  std::function<Result<void>(const Dataset&, const Dataset* before)> check = nullptr;
};

// All datasets of a process. Thread-safe.
class Store {
 public:
  explicit Store(StoreOptions options);
  explicit Store(std::uint64_t bytes_max);
  ~Store();
  Store(const Store&) = delete;
  Store& operator=(const Store&) = delete;

  // Opens and registers a dataset; its id is the name of the sample or the file name without
  // extension, made unique by -2, -3. A sample is given by its name or by name and size (see
  // sized_sample), files by a path or pattern (see locate). The same files are one dataset, however
  // often they are added; so are samples of equal name and size.
  Result<std::shared_ptr<Dataset>> add(const std::string& sample_or_path);
  Result<std::shared_ptr<Dataset>> add(const Location& location);
  // The same; also returns whether this call opened it.
  struct Added {
    std::shared_ptr<Dataset> dataset;
    bool is_new = false;
  };
  // Errors also: cancelled.
  Result<Added> add_or_find(const Location& location, const CancelToken& cancel = {});
  // Removes a dataset; existing references stay valid. Errors: not_found.
  Result<void> remove(const std::string& id);
  [[nodiscard]] Result<std::shared_ptr<Dataset>> find(const std::string& id) const;
  [[nodiscard]] std::vector<std::shared_ptr<Dataset>> all() const;
  // The location of its files; nullopt: unknown, or a sample.
  [[nodiscard]] std::optional<Location> location(const std::string& id) const;

  // Lists a configured dataset that cannot be opened, under an id like that of a dataset, so that
  // find() of the id reports the reason. Replaced by add() of the same files, and by
  // look_for_changes() once they can be opened.
  struct Failed {
    std::string id;
    std::string problem;
  };
  void list_failed(const std::string& sample_or_path, const Error& why);
  [[nodiscard]] std::vector<Failed> failed() const;  // in the order they were added
  // The next look_for_changes() retries all of them, whether or not their files have changed.
  void try_failed_again();
  // Removes it from the list. False: unknown id.
  bool remove_failed(const std::string& id);

  // Replaces the prefetch requests of `owner`, in order of urgency: a thread of the store loads
  // them as far as memory allows, and they are not evicted for less urgent data. Empty: no
  // requests. Owners take turns.
  void request_prefetch(std::uint64_t owner, std::vector<PrefetchRequest> requests);

  // Checks once whether files of a dataset changed since they were opened, and reopens those that
  // changed and were stable for `rest_s`, under the same id; resident volumes of the old state are
  // dropped. A dataset that cannot be reopened stays as it was (problem()). Failed datasets are
  // retried when their files change, and once a minute while retrying is quick. Returns the
  // reopened ids.
  std::vector<std::string> look_for_changes(double rest_s = 1);
  // Ends all present and future datasets; returns when no read is running. Resident volumes stay.
  void end();
  // Frees the read caches of sources that were idle for `idle_s`.
  void release_idle(double idle_s = 10);
  // Why the changed files of a dataset could not be reopened; empty: no error.
  [[nodiscard]] std::string problem(const std::string& id) const;
  // Notes on the dataset's files besides its own; empty: none.
  [[nodiscard]] std::string note(const std::string& id) const;

  [[nodiscard]] BudgetCounts counts() const;
  // The lock for Dataset::in_turn(), with one holder at a time, until the result is destroyed; the
  // store must outlive it. First ends idle loaders of other datasets, because their memory counts
  // too. Empty if cancelled while waiting.
  using Turn = std::shared_ptr<const void>;
  [[nodiscard]] Turn take_turn(const Dataset& dataset, const CancelToken& cancel = {});
  // Reserves `bytes` of working memory in the limit while the result exists. Errors: out_of_memory.
  Result<std::shared_ptr<const void>> reserve(std::uint64_t bytes);
  // Number of bytes that can be reserved now.
  [[nodiscard]] std::uint64_t room() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace windsplat::data
