// Dataset registry: location -> one shared dataset, reopened when its files change.
#include "server/data/resident/store.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <filesystem>
#include <map>
#include <mutex>
#include <new>
#include <set>
#include <thread>
#include <utility>

#include "server/base/log.hpp"
#include "server/base/nearest_word.hpp"
#include "server/data/derived/source.hpp"
#include "server/data/files/locate_parts.hpp"
#include "server/data/open/open.hpp"
#include "server/data/resident/prefetch_thread.hpp"
#include "server/data/resident/watched_files.hpp"
#include "server/data/samples/samples.hpp"

namespace windsplat::data {

namespace {

using DatasetPtr = std::shared_ptr<Dataset>;

Result<std::unique_ptr<Source>> open_here(const Location& location, const CancelToken& /*cancel*/) {
  auto source = open_dataset(direct_files(location));
  if (!source) return source.error();
  return std::unique_ptr<Source>(std::move(*source));
}

Result<std::unique_ptr<Source>> sample_source(const SizedSample& sample) {
  auto source = open_sample(sample.name, sample.dims);
  if (!source) return source.error();
  return std::unique_ptr<Source>(derived::with_derived_fields(std::move(*source)));
}

double now_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace

struct Store::State {
  using Clock = std::chrono::steady_clock;

  explicit State(StoreOptions given)
      : options(std::move(given)),
        budget(options.budget ? options.budget : std::make_shared<Budget>(options.bytes_max)),
        prefetcher(budget) {
    if (!options.open) options.open = open_here;
  }

  struct Entry {
    DatasetPtr dataset;
    std::string key;  // key of its files, or the name of the sample
    std::optional<Location> location;
    std::vector<Companion> companions;
    std::string listed;   // for a series: stamp of the folder at the last match of its pattern
    std::string stamp;    // stamp of the files when opened
    std::string refused;  // stamp at which reopening failed
    std::string problem;
    std::string note;
  };
  struct FailedEntry {
    std::string named;
    std::string key;                   // key of its files at the last scan
    std::optional<std::string> tried;  // their stamp at that time; nullopt: retry in any case
    Clock::time_point retry_at;        // retry even if the stamp is unchanged
    Failed listed;
  };

  // All guarded by the mutex.
  [[nodiscard]] const Entry* find(const std::string& id) const {
    const auto at = std::ranges::find_if(
        entries, [&](const Entry& entry) { return entry.dataset->info().id == id; });
    return at == entries.end() ? nullptr : &*at;
  }
  [[nodiscard]] DatasetPtr known(const std::string& key) const {
    const auto at = std::ranges::find(entries, key, &Entry::key);
    return at == entries.end() ? nullptr : at->dataset;
  }
  [[nodiscard]] FailedEntry* find_failed(const std::string& id) {
    const auto at = std::ranges::find_if(failed, [&](auto& one) { return one.listed.id == id; });
    return at == failed.end() ? nullptr : &*at;
  }
  [[nodiscard]] Error no_dataset(const std::string& id) const {
    std::vector<std::string> ids;
    for (const Entry& entry : entries) ids.push_back(entry.dataset->info().id);
    return make_error(ErrorKind::not_found,
                      "there is no dataset " + in_quotes(id) + did_you_mean(id, ids));
  }
  // `key`: key of a failed dataset to be replaced, whose id becomes free; empty: none.
  [[nodiscard]] std::string unique_id(const std::string& wanted, const std::string& key) {
    std::string id = wanted;
    const auto is_taken = [&] {
      const FailedEntry* const known = find_failed(id);
      return find(id) != nullptr || (known != nullptr && (key.empty() || known->key != key));
    };
    for (int n = 2; is_taken(); ++n) id = wanted + '-' + std::to_string(n);
    return id;
  }

  // Called without the mutex. Must not allocate: an allocation failure here would end the daemon.
  [[nodiscard]] DatasetPtr one_that_reads() const {
    const std::lock_guard lock(mutex);
    const auto at = std::find_if(entries.begin(), entries.end(),
                                 [](const Entry& entry) { return reads(*entry.dataset); });
    return at == entries.end() ? nullptr : at->dataset;
  }
  static bool reads(const Dataset& dataset) {
    try {
      return dataset.loading().has_value();
    } catch (const std::bad_alloc&) {
      return true;  // the name exists, but allocation failed
    }
  }

  // Called with the mutex held.
  void unlist_failed(const std::string& key) {
    failed.erase(std::remove_if(failed.begin(), failed.end(),
                                [&](const FailedEntry& one) { return one.key == key; }),
                 failed.end());
  }

  // The dataset of `key`, opened by at most one caller at a time. `failed_id`: id of a failed
  // dataset that is retried, which may be removed meanwhile; empty: none.
  template <class Open>
  Result<Added> add(const std::string& key, const std::string& wanted_id,
                    std::optional<Location> location, const Open& open,
                    const std::string& failed_id = "", const CancelToken& cancel = {}) {
    constexpr std::chrono::milliseconds look_every{100};
    std::unique_lock lock(mutex);
    while (!opened.wait_for(lock, look_every, [&] { return opening.count(key) == 0; })) {
      if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "opening was cancelled");
    }
    if (auto there = known(key)) {
      unlist_failed(key);
      return Added{std::move(there), false};
    }
    opening.insert(key);
    lock.unlock();
    auto made = open_entry(key, std::move(location), open);
    lock.lock();
    opening.erase(key);
    opened.notify_all();
    if (!made) return made.error();
    Entry& entry = made->entry;
    entry.dataset = std::make_shared<Dataset>(std::move(made->source), unique_id(wanted_id, key),
                                              budget, options.storage);
    auto usable = entry.dataset->charge_info();
    if (usable && options.check) usable = options.check(*entry.dataset, nullptr);
    if (usable && !failed_id.empty() && find_failed(failed_id) == nullptr) {
      usable = make_error(ErrorKind::not_found, "it is no longer listed");
    }
    if (!usable) {
      lock.unlock();  // outside the lock: the loader of `usable` ends with it
      return usable.error();
    }
    unlist_failed(key);
    if (ended) entry.dataset->end();
    entries.push_back(std::move(entry));
    return Added{entries.back().dataset, true};
  }

  struct Opened {
    Entry entry;  // an entry without dataset
    std::unique_ptr<Source> source;
  };
  // Does not throw: other threads wait for this key.
  template <class Open>
  static Result<Opened> open_entry(const std::string& key, std::optional<Location> location,
                                   const Open& open) {
    try {
      Opened out;
      out.entry.key = key;
      // The stamp is taken before reading, so that changes during the read are detected.
      FileStamp before;
      if (location) {
        before = stamp_of_all(*location, {});
        out.entry.listed = stamp_of(location->folder).text;
        out.entry.note = links_left_out(*location);
      }
      auto source = open();
      if (!source) return source.error();
      out.source = std::move(*source);
      out.entry.companions = out.source->companions();
      out.entry.location = std::move(location);
      out.entry.stamp = stamp_as_opened(std::move(before), out.entry.companions);
      return out;
    } catch (const std::bad_alloc&) {
      return make_error(ErrorKind::out_of_memory, "the machine has no memory left to open it");
    } catch (const std::exception& fault) {
      log::error("opening failed", {{"fault", fault.what()}});
      return make_error(ErrorKind::internal, "opening it failed");
    }
  }

  // Retries failed datasets if their files changed and are stable, once a minute while retrying is
  // quick (files they refer to may have changed), and if a retry is forced. Returns the ids of
  // those opened.
  std::vector<std::string> open_failed(double rest_s) {
    constexpr std::chrono::minutes retry_every{1};
    constexpr int share = 20;  // a slow disk must not monopolise the scans
    std::vector<FailedEntry> looked_at;
    {
      const std::lock_guard lock(mutex);
      looked_at = failed;
    }
    std::vector<std::string> out;
    for (const FailedEntry& entry : looked_at) {
      if (sized_sample(entry.named)) continue;  // would fail for the same reason
      const auto location = locate(entry.named);
      const FileStamp now = location ? stamp_of_all(*location, {}) : FileStamp{};
      const bool changed = now_s() - now.changed_s >= rest_s && now.text != entry.tried;
      const Clock::time_point begin = Clock::now();
      if (entry.tried && !changed && begin < entry.retry_at) continue;
      const std::string& id = entry.listed.id;
      const std::string key = location ? key_of(*location) : "";
      {
        const std::lock_guard lock(mutex);
        FailedEntry* const listed = find_failed(id);
        if (ended || listed == nullptr) continue;  // removed meanwhile
        listed->key = key;
        listed->tried = now.text;
        listed->retry_at = begin + retry_every;
      }
      if (!location) continue;
      const auto added = add(
          key, id, *location, [&] { return options.open(*location, {}); }, id);
      if (added) {
        if (!added->is_new) continue;
        out.push_back(added->dataset->info().id);
        log::info("opened: it was listed as failed", {{"dataset", out.back()}});
        continue;
      }
      const std::lock_guard lock(mutex);
      FailedEntry* const listed = find_failed(id);
      if (listed == nullptr) continue;
      listed->retry_at += share * (Clock::now() - begin);
      if (listed->listed.problem == added.error().message) continue;
      listed->listed.problem = added.error().message;
      log::warn("a dataset that is listed as failed still cannot be opened",
                {{"dataset", id}, {"fault", listed->listed.problem}});
    }
    return out;
  }

  // Replaces the entry of dataset `old` with `entry` if still present; returns the old entry, to be
  // destroyed outside the lock.
  Entry put(Entry entry, const DatasetPtr& old) {
    const std::lock_guard lock(mutex);
    const auto at = std::ranges::find(entries, old, &Entry::dataset);
    if (ended) entry.dataset->end();
    if (at != entries.end()) std::swap(*at, entry);
    return entry;
  }

  StoreOptions options;
  std::shared_ptr<Budget> budget;
  mutable std::mutex mutex;  // guards all members below
  bool turn_is_taken = false;
  std::condition_variable turn_ended;
  std::condition_variable opened;
  std::set<std::string> opening;  // keys
  std::vector<Entry> entries;
  std::vector<FailedEntry> failed;
  bool ended = false;
  PrefetchThread prefetcher;  // last: its thread uses datasets
};

Store::Store(StoreOptions options) : state_(std::make_unique<State>(std::move(options))) {}
Store::Store(std::uint64_t bytes_max)
    : Store(StoreOptions{bytes_max, Storage::float32, {}, {}, {}}) {}
Store::~Store() = default;

Result<DatasetPtr> Store::add(const std::string& sample_or_path) {
  if (const auto sample = sized_sample(sample_or_path)) {
    auto added = state_->add("sample:" + sample_or_path, printable(sample_or_path), std::nullopt,
                             [&] { return sample_source(*sample); });
    if (!added) return added.error();
    return std::move(added->dataset);
  }
  auto location = locate(sample_or_path);
  if (location) return add(*location);
  Error error = location.error();
  if (error.kind == ErrorKind::not_found && sample_or_path.find('/') == std::string::npos) {
    const std::string meant = did_you_mean(sample_or_path, sample_names());
    error.message += meant.empty() ? "; the" : meant + " The";
    error.message += " built-in samples are";
    for (const std::string& name : sample_names()) {
      error.message += ' ' + name;
    }
  }
  return error;
}

Result<DatasetPtr> Store::add(const Location& location) {
  auto added = add_or_find(location);
  if (!added) return added.error();
  return std::move(added->dataset);
}

Result<Store::Added> Store::add_or_find(const Location& location, const CancelToken& cancel) {
  // Ends idle loaders, so that their number is limited when many files are opened in sequence.
  constexpr double hardly_idle_s = 0.5;
  release_idle(hardly_idle_s);
  return state_->add(
      key_of(location), printable(location.wanted_id()), location,
      [&] { return state_->options.open(location, cancel); }, "", cancel);
}

Result<void> Store::remove(const std::string& id) {
  DatasetPtr removed;
  {
    const std::lock_guard lock(state_->mutex);
    const State::Entry* found = state_->find(id);
    if (found == nullptr) return state_->no_dataset(id);
    removed = found->dataset;
    state_->entries.erase(state_->entries.begin() + (found - state_->entries.data()));
  }
  state_->prefetcher.forget(removed->info());
  removed->forget();
  return {};
}

Result<DatasetPtr> Store::find(const std::string& id) const {
  const std::lock_guard lock(state_->mutex);
  if (const State::Entry* found = state_->find(id)) return found->dataset;
  if (const State::FailedEntry* failed = state_->find_failed(id)) {
    return make_error(ErrorKind::not_found, "dataset " + in_quotes(id) +
                                                " could not be opened: " + failed->listed.problem);
  }
  return state_->no_dataset(id);
}

void Store::list_failed(const std::string& sample_or_path, const Error& why) {
  const auto location = locate(sample_or_path);
  State::FailedEntry entry;
  entry.named = sample_or_path;
  if (location) entry.key = key_of(*location);
  entry.listed.problem = why.message;
  std::string wanted =
      location ? location->wanted_id() : std::filesystem::path(sample_or_path).stem().native();
  const std::lock_guard lock(state_->mutex);
  entry.listed.id = state_->unique_id(printable(wanted.empty() ? "dataset" : wanted), "");
  state_->failed.push_back(std::move(entry));
}

void Store::try_failed_again() {
  const std::lock_guard lock(state_->mutex);
  for (State::FailedEntry& entry : state_->failed) entry.tried.reset();
}

bool Store::remove_failed(const std::string& id) {
  const std::lock_guard lock(state_->mutex);
  const State::FailedEntry* found = state_->find_failed(id);
  if (found == nullptr) return false;
  state_->failed.erase(state_->failed.begin() + (found - state_->failed.data()));
  return true;
}

std::vector<Store::Failed> Store::failed() const {
  const std::lock_guard lock(state_->mutex);
  std::vector<Failed> out;
  for (const State::FailedEntry& one : state_->failed) out.push_back(one.listed);
  return out;
}

std::vector<DatasetPtr> Store::all() const {
  const std::lock_guard lock(state_->mutex);
  std::vector<DatasetPtr> out;
  for (const State::Entry& entry : state_->entries) out.push_back(entry.dataset);
  return out;
}

std::optional<Location> Store::location(const std::string& id) const {
  const std::lock_guard lock(state_->mutex);
  const State::Entry* found = state_->find(id);
  return found == nullptr ? std::nullopt : found->location;
}

void Store::request_prefetch(std::uint64_t owner, std::vector<PrefetchRequest> requests) {
  state_->prefetcher.request_prefetch(owner, std::move(requests));
}

std::vector<std::string> Store::look_for_changes(double rest_s) {
  std::vector<std::string> changed = state_->open_failed(rest_s);
  std::vector<State::Entry> looked_at;
  {
    const std::lock_guard lock(state_->mutex);
    looked_at = state_->entries;
  }
  for (State::Entry& entry : looked_at) {
    if (!entry.location) continue;
    const DatasetPtr old = entry.dataset;
    const bool matched = match_again(entry.location, entry.listed);
    if (matched) entry.note = links_left_out(*entry.location);
    const FileStamp now = stamp_of_all(*entry.location, entry.companions);
    const bool same = now.text == entry.stamp || now.text == entry.refused;
    if (same || now_s() - now.changed_s < rest_s) {  // or still being written
      if (matched && same) state_->put(std::move(entry), old);
      continue;
    }
    const std::string id = old->info().id;
    auto opened = State::open_entry(key_of(*entry.location), entry.location,
                                    [&] { return state_->options.open(*entry.location, {}); });
    Result<void> usable = opened ? Result<void>() : opened.error();
    // Out of memory is retried; other errors persist until the files change.
    bool lasts = !usable && usable.error().kind != ErrorKind::out_of_memory;
    if (opened) {
      DatasetPtr& anew = opened->entry.dataset;
      anew = std::make_shared<Dataset>(std::move(opened->source), id, state_->budget,
                                       state_->options.storage);
      (void)anew->charge_info();  // it was resident before: keep it even if the budget refuses it
      if (state_->options.check) usable = state_->options.check(*anew, old.get());
      lasts = !usable;
    }
    if (usable) {
      entry = std::move(opened->entry);
      changed.push_back(id);
      log::info("reopened: its files have changed", {{"dataset", id}});
    } else {
      if (lasts) entry.refused = now.text;
      entry.problem = "its files have changed and cannot be reopened: " + usable.error().message;
      log::warn("the files of a dataset have changed and cannot be reopened",
                {{"dataset", id}, {"error", usable.error().message}});
    }
    state_->put(std::move(entry), old);
    if (usable) state_->prefetcher.forget(old->info());
  }
  return changed;
}

void Store::end() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->ended = true;
    for (const State::Entry& entry : state_->entries) entry.dataset->end();
  }
  state_->budget->end();
  while (const DatasetPtr dataset = state_->one_that_reads()) {
    dataset->end();
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

void Store::release_idle(double idle_s) {
  for (const DatasetPtr& dataset : all()) dataset->release_idle(idle_s);
}

std::string Store::problem(const std::string& id) const {
  const std::lock_guard lock(state_->mutex);
  const State::Entry* found = state_->find(id);
  return found == nullptr ? "" : found->problem;
}

std::string Store::note(const std::string& id) const {
  const std::lock_guard lock(state_->mutex);
  const State::Entry* found = state_->find(id);
  return found == nullptr ? "" : found->note;
}

BudgetCounts Store::counts() const { return state_->budget->counts(); }

Store::Turn Store::take_turn(const Dataset& dataset, const CancelToken& cancel) {
  constexpr std::chrono::milliseconds look_every{20};
  {
    std::unique_lock lock(state_->mutex);
    while (state_->turn_is_taken && !cancel.cancelled()) {
      state_->turn_ended.wait_for(lock, look_every);
    }
    if (cancel.cancelled()) return nullptr;
    state_->turn_is_taken = true;
  }
  Turn turn(state_.get(), [](State* state) {
    const std::lock_guard lock(state->mutex);
    state->turn_is_taken = false;
    state->turn_ended.notify_one();
  });
  for (const DatasetPtr& other : all()) {
    if (&other->info() != &dataset.info()) other->release_idle(0);
  }
  return turn;
}

std::uint64_t Store::room() const { return state_->budget->room(); }

Result<std::shared_ptr<const void>> Store::reserve(std::uint64_t bytes) {
  const auto held = std::make_shared<Reservation>(state_->budget);
  if (auto reserved = held->resize(bytes); !reserved) return reserved.error();
  return std::shared_ptr<const void>(held);
}

}  // namespace windsplat::data
