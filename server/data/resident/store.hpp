// The resident store: every dataset opened once, every field and step loaded once on first need,
// shared by all sessions, the least recently used evicted beyond the memory limit.
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

// Something that may be wanted soon.
struct PrefetchRequest {
  Dataset dataset;
  std::string field;
  std::size_t step = 0;
  Coarsening how;
};

struct StoreOptions {
  std::uint64_t bytes_max = 0;
  Storage storage = Storage::float32;
  // Opens what is no sample; the default reads files in this process.
  std::function<Result<std::unique_ptr<Source>>(const Location&)> open;
  std::shared_ptr<Budget> budget = nullptr;  // in place of one of bytes_max, shared with sources
  // What a dataset must pass to be listed, or opened anew; none: nothing. Called under the store's
  // lock, so that it must not ask the store.
  std::function<Result<void>(const Dataset&)> check = nullptr;
};

// All datasets of a process. Thread-safe.
class Store {
 public:
  explicit Store(StoreOptions options);
  explicit Store(std::uint64_t bytes_max);
  ~Store();
  Store(const Store&) = delete;
  Store& operator=(const Store&) = delete;

  // Opens and registers; the id is the sample's name or the file's name without its extension,
  // made unique by -2, -3. A sample is named by its bare name or with a size of its own (see
  // sized_sample), files by a path or pattern (see locate). The same files are one dataset however
  // often and by however many callers they are added; so are samples of one name and size.
  Result<std::shared_ptr<Dataset>> add(const std::string& sample_or_path);
  Result<std::shared_ptr<Dataset>> add(const Location& location);
  // The same; and whether it was this call that opened it.
  struct Added {
    std::shared_ptr<Dataset> dataset;
    bool is_new = false;
  };
  Result<Added> add_or_find(const Location& location);
  // Forgets a dataset; who holds it keeps it. Errors: not_found.
  Result<void> remove(const std::string& id);
  [[nodiscard]] Result<std::shared_ptr<Dataset>> find(const std::string& id) const;
  [[nodiscard]] std::vector<std::shared_ptr<Dataset>> all() const;

  // What was to be served and cannot be opened, under an id like a dataset's, so that who looks for
  // it is told why. find() of the id gives the reason; add() of the same files replaces it, and so
  // does look_for_changes() once they can be opened.
  struct Failed {
    std::string id;
    std::string problem;
  };
  void list_failed(const std::string& sample_or_path, const Error& why);
  [[nodiscard]] std::vector<Failed> failed() const;  // in the order they were added
  // The next look_for_changes() tries all of them, whether their files have changed or not.
  void try_failed_again();
  // Takes it off the list. False: there is none of that id.
  bool remove_failed(const std::string& id);

  // What `owner` will want, the soonest first, in place of what it wished before: loaded by a
  // thread of the store's own as far as memory goes, and not evicted for what is less urgent.
  // Empty: no more. Owners take turns.
  void request_prefetch(std::uint64_t owner, std::vector<PrefetchRequest> requests);

  // Looks once whether files of a dataset changed since they were opened, and opens those anew that
  // did and have rested for `rest_s`: under the same id, what was resident of the old goes. One
  // that cannot be opened stays as it was (problem()). What is listed as failed is tried when its
  // files change, and once a minute as long as that is quick. Returns the ids that were opened.
  std::vector<std::string> look_for_changes(double rest_s = 1);
  // Ends every dataset, those to come too; returns when none is being read. What is resident stays.
  void end();
  // Ends what sources keep for their next read, of those that read nothing for so long.
  void release_idle(double idle_s = 10);
  // Why the files of a dataset, which changed, could not be opened anew; empty: nothing is wrong.
  [[nodiscard]] std::string problem(const std::string& id) const;
  // What is to be known of the dataset's files besides its own notes; empty: nothing.
  [[nodiscard]] std::string note(const std::string& id) const;

  [[nodiscard]] BudgetCounts counts() const;
  // The turn to load by Dataset::in_turn(), for as long as the answer is held, which the store must
  // outlive: one at a time. First ends idle loaders of other datasets, whose memory counts too.
  // Empty where it was cancelled before its turn came.
  using Turn = std::shared_ptr<const void>;
  [[nodiscard]] Turn take_turn(const Dataset& dataset, const CancelToken& cancel = {});
  // So many bytes of work count in the limit for as long as the answer is held. Errors:
  // out_of_memory.
  Result<std::shared_ptr<const void>> reserve(std::uint64_t bytes);
  // How many could be had now.
  [[nodiscard]] std::uint64_t room() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace windsplat::data
