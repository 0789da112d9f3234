// The resident store. One budget of bytes for all datasets of a store: a load reserves its bytes
// first, evicting the least recently used volumes that nobody holds; every volume is loaded once.
#include "server/data/store.hpp"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <filesystem>
#include <list>
#include <map>
#include <mutex>
#include <new>
#include <optional>
#include <tuple>
#include <utility>

#include "server/base/log.hpp"
#include "server/data/digest.hpp"

namespace windsplat::data {

namespace {

// Which volume: the dataset by its number in the budget, field, step, and the digest of how it was
// coarsened (empty: as it was loaded).
using Key = std::tuple<std::uint64_t, std::size_t, std::size_t, std::string>;
using VolumePtr = std::shared_ptr<const Volume>;

std::string megabytes(std::uint64_t bytes) {
  const std::uint64_t tenths = (bytes * 10 + (1U << 19)) >> 20;
  return std::to_string(tenths / 10) + '.' + std::to_string(tenths % 10) + " MiB";
}

}  // namespace

// The shared budget and the cache it pays for. Thread-safe.
class Budget {
 public:
  explicit Budget(std::uint64_t bytes_max) : bytes_max_(bytes_max) {}

  std::uint64_t next_owner() { return owners_.fetch_add(1); }

  // The volume of `key`, from the cache or from `load`, which at most one caller runs at a time
  // for a key; the others wait and get the same answer. A failure is not remembered.
  template <class Load>
  Result<VolumePtr> get(const Key& key, std::uint64_t bytes, const Load& load) {
    std::unique_lock lock(mutex_);
    if (const auto there = wait_for(key, lock)) {
      return *there;
    }
    if (!make_room(bytes)) {
      return no_room(bytes);
    }
    const auto entry = std::make_shared<Entry>();
    entry->bytes = bytes;
    entries_.emplace(key, entry);
    used_ += bytes;

    lock.unlock();
    Result<VolumePtr> answer = load();
    lock.lock();

    if (answer.has_value()) {
      recent_.push_front(key);
      entry->place = recent_.begin();
      entry->listed = true;
    } else {
      used_ -= bytes;
      entries_.erase(key);
    }
    entry->answer.emplace(answer);
    arrived_.notify_all();
    return answer;
  }

  // The same for a volume that is there or on its way; none if nobody has asked for it.
  std::optional<Result<VolumePtr>> find(const Key& key) {
    std::unique_lock lock(mutex_);
    return wait_for(key, lock);
  }

  [[nodiscard]] std::uint64_t bytes_of(std::uint64_t owner) const {
    const std::lock_guard lock(mutex_);
    std::uint64_t bytes = 0;
    for (const auto& [key, entry] : entries_) {
      bytes += std::get<0>(key) == owner && entry->listed ? entry->bytes : 0;
    }
    return bytes;
  }

  void forget(std::uint64_t owner) {
    const std::lock_guard lock(mutex_);
    for (auto at = recent_.begin(); at != recent_.end();) {
      const auto next = std::next(at);
      if (std::get<0>(*at) == owner) {
        drop(at);
      }
      at = next;
    }
  }

 private:
  struct Entry {
    std::uint64_t bytes = 0;
    std::optional<Result<VolumePtr>> answer;  // none while it is being loaded
    std::list<Key>::iterator place;           // in recent_, if listed
    bool listed = false;
  };

  std::optional<Result<VolumePtr>> wait_for(const Key& key, std::unique_lock<std::mutex>& lock) {
    const auto found = entries_.find(key);
    if (found == entries_.end()) {
      return std::nullopt;
    }
    const std::shared_ptr<Entry> entry = found->second;
    arrived_.wait(lock, [&] { return entry->answer.has_value(); });
    if (entry->answer->has_value()) {
      touch(*entry);
    }
    return entry->answer;
  }

  void touch(Entry& entry) {
    if (entry.listed) {
      recent_.splice(recent_.begin(), recent_, entry.place);
    }
  }

  void drop(std::list<Key>::iterator listed) {
    const auto at = entries_.find(*listed);
    used_ -= at->second->bytes;
    at->second->listed = false;
    entries_.erase(at);
    recent_.erase(listed);
  }

  // Nobody outside can gain a reference while the lock is held, so a count of one stays one.
  static bool is_held(const Entry& entry) { return entry.answer->value().use_count() > 1; }

  bool make_room(std::uint64_t bytes) {
    if (bytes > bytes_max_) {
      return false;
    }
    // Only evict if that will do: a request that fails must not empty the cache for others.
    std::uint64_t evictable = 0;
    for (const Key& key : recent_) {
      const Entry& entry = *entries_.at(key);
      evictable += is_held(entry) ? 0 : entry.bytes;
    }
    if (used_ - evictable > bytes_max_ - bytes) {
      return false;
    }
    for (auto at = recent_.end(); at != recent_.begin() && used_ > bytes_max_ - bytes;) {
      --at;
      if (!is_held(*entries_.at(*at))) {
        drop(at++);
      }
    }
    return used_ <= bytes_max_ - bytes;
  }

  [[nodiscard]] Error no_room(std::uint64_t bytes) const {
    return make_error(ErrorKind::out_of_memory,
                      "the field needs " + megabytes(bytes) + "; the memory limit is " +
                          megabytes(bytes_max_) + ", of which " + megabytes(used_) + " are in use");
  }

  const std::uint64_t bytes_max_;
  std::atomic<std::uint64_t> owners_{0};
  mutable std::mutex mutex_;
  std::condition_variable arrived_;
  std::map<Key, std::shared_ptr<Entry>> entries_;
  std::list<Key> recent_;   // loaded ones, the most recently used first
  std::uint64_t used_ = 0;  // loaded and reserved
};

struct Dataset::State {
  std::unique_ptr<Source> source;
  DatasetInfo info;
  std::shared_ptr<Budget> budget;
  std::uint64_t owner = 0;
  std::mutex source_mutex;
  std::mutex kept_mutex;
  std::string kept_key;
  std::any kept_value;
  std::atomic<std::uint64_t> loads{0};
  std::atomic<std::uint64_t> averages{0};

  // Checked: where a field and a step are. Errors: not_found.
  Result<std::size_t> find(const std::string& field, std::size_t step) const {
    const FieldInfo* found = info.find(field);
    if (found == nullptr) {
      return make_error(ErrorKind::not_found, "dataset '" + printable(info.id) +
                                                  "' has no field '" + printable(field) + "'");
    }
    if (step >= info.steps.size()) {
      return make_error(ErrorKind::not_found, "dataset '" + printable(info.id) + "' has no step " +
                                                  std::to_string(step) + "; its last is " +
                                                  std::to_string(info.steps.size() - 1));
    }
    return static_cast<std::size_t>(found - info.fields.data());
  }

  Result<VolumePtr> load(std::size_t field, std::size_t step) {
    const std::lock_guard lock(source_mutex);
    loads.fetch_add(1);
    return guarded(field, [&] { return source->read(field, step); });
  }

  // Runs what makes a volume; what it throws becomes an error.
  template <class Make>
  Result<VolumePtr> guarded(std::size_t field, const Make& make) const {
    try {
      Result<Volume> volume = make();
      if (!volume) {
        return volume.error();
      }
      return std::make_shared<const Volume>(std::move(*volume));
    } catch (const std::bad_alloc&) {
      return make_error(ErrorKind::out_of_memory,
                        "the machine has no memory left for '" + info.fields[field].name + "'");
    } catch (const std::exception& fault) {
      // What a fault of ours says is for the log: it may name places in the source.
      log::error("loading failed", {{"field", info.fields[field].name}, {"fault", fault.what()}});
      return make_error(ErrorKind::internal, "loading '" + info.fields[field].name + "' failed");
    }
  }
};

Dataset::Dataset(std::unique_ptr<Source> source, std::string id, std::uint64_t bytes_max)
    : Dataset(std::move(source), std::move(id), std::make_shared<Budget>(bytes_max)) {}

Dataset::Dataset(std::unique_ptr<Source> source, std::string id, std::shared_ptr<Budget> budget)
    : state_(std::make_unique<State>()) {
  state_->source = std::move(source);
  state_->info = state_->source->info();
  state_->info.id = std::move(id);
  state_->budget = std::move(budget);
  state_->owner = state_->budget->next_owner();
}

Dataset::~Dataset() { state_->budget->forget(state_->owner); }

const DatasetInfo& Dataset::info() const { return state_->info; }

Result<std::shared_ptr<const Volume>> Dataset::volume(const std::string& field, std::size_t step) {
  const Result<std::size_t> index = state_->find(field, step);
  if (!index) {
    return index.error();
  }
  const DatasetInfo& info = state_->info;
  const std::uint64_t bytes =
      info.grid.samples() * info.fields[*index].components.size() * sizeof(float);
  return state_->budget->get({state_->owner, *index, step, ""}, bytes,
                             [&] { return state_->load(*index, step); });
}

Result<std::shared_ptr<const Volume>> Dataset::level(const std::string& field, std::size_t step,
                                                     const Coarsening& how) {
  if (how.halvings == std::array{0, 0, 0}) {
    return volume(field, step);
  }
  const Result<std::size_t> index = state_->find(field, step);
  if (!index) {
    return index.error();
  }
  const DatasetInfo& info = state_->info;
  std::uint64_t bytes = info.fields[*index].components.size() * sizeof(float);
  for (std::size_t a = 0; a < 3; ++a) {
    bytes *= static_cast<std::uint64_t>(halved(info.grid.dims()[a], how.halvings[a]));
  }
  const Key key{state_->owner, *index, step, digest_of(key_of(how))};
  if (const auto there = state_->budget->find(key)) {
    return *there;
  }
  // Held first, so that it is never evicted for a level that could not then be made of it.
  const auto fine = volume(field, step);
  if (!fine) {
    return fine.error();
  }
  return state_->budget->get(key, bytes, [&] {
    state_->averages.fetch_add(1);
    return state_->guarded(*index, [&]() -> Result<Volume> { return coarsen(**fine, how); });
  });
}

std::any Dataset::kept(const std::string& key) const {
  const std::lock_guard lock(state_->kept_mutex);
  return state_->kept_key == key ? state_->kept_value : std::any();
}

void Dataset::keep(std::string key, std::any value) {
  const std::lock_guard lock(state_->kept_mutex);
  state_->kept_key = std::move(key);
  state_->kept_value = std::move(value);
}

std::uint64_t Dataset::resident_bytes() const { return state_->budget->bytes_of(state_->owner); }

std::uint64_t Dataset::loads() const { return state_->loads.load(); }

std::uint64_t Dataset::averages() const { return state_->averages.load(); }

struct Store::State {
  explicit State(std::uint64_t bytes_max) : budget(std::make_shared<Budget>(bytes_max)) {}

  // Both under the mutex.
  [[nodiscard]] std::shared_ptr<Dataset> find(const std::string& id) const {
    const auto at = std::find_if(datasets.begin(), datasets.end(),
                                 [&](const auto& dataset) { return dataset->info().id == id; });
    return at == datasets.end() ? nullptr : *at;
  }
  [[nodiscard]] std::string unique_id(const std::string& wanted) const {
    std::string id = wanted;
    for (int n = 2; find(id) != nullptr; ++n) {
      id = wanted + '-' + std::to_string(n);
    }
    return id;
  }

  std::shared_ptr<Budget> budget;
  mutable std::mutex mutex;
  std::vector<std::shared_ptr<Dataset>> datasets;
};

Store::Store(std::uint64_t bytes_max) : state_(std::make_unique<State>(bytes_max)) {}
Store::~Store() = default;

Result<std::shared_ptr<Dataset>> Store::add(const std::string& sample_or_path) {
  const auto sample = sized_sample(sample_or_path);
  auto source = sample ? open_sample(sample->name, sample->dims) : open_file(sample_or_path);
  if (!source) {
    Error error = source.error();
    if (error.kind == ErrorKind::not_found && sample_or_path.find('/') == std::string::npos) {
      error.message += "; the built-in samples are";
      for (const std::string& name : sample_names()) {
        error.message += ' ' + name;
      }
    }
    return error;
  }
  const std::string wanted =
      sample ? sample_or_path : std::filesystem::path(sample_or_path).stem().native();
  const std::lock_guard lock(state_->mutex);
  auto dataset = std::make_shared<Dataset>(std::move(*source), state_->unique_id(printable(wanted)),
                                           state_->budget);
  state_->datasets.push_back(dataset);
  return dataset;
}

Result<std::shared_ptr<Dataset>> Store::find(const std::string& id) const {
  const std::lock_guard lock(state_->mutex);
  auto found = state_->find(id);
  if (found == nullptr) {
    return make_error(ErrorKind::not_found, "there is no dataset '" + printable(id) + "'");
  }
  return found;
}

std::vector<std::shared_ptr<Dataset>> Store::all() const {
  const std::lock_guard lock(state_->mutex);
  return state_->datasets;
}

}  // namespace windsplat::data
