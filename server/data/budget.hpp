// The bytes that the datasets of a store share, and what they were spent on: a cache of whatever is
// resident. A load reserves its bytes first; the least recently used goes when room is needed.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "server/base/error.hpp"

namespace windsplat::data {

// What is kept: the dataset by its number in the budget, field, step, and what was made of it
// (empty: as it was loaded).
using ResidentKey = std::tuple<std::uint64_t, std::size_t, std::size_t, std::string>;
using Resident = std::shared_ptr<const void>;

enum class Urgency {
  demand,  // somebody waits: whatever nobody holds may go for it
  ahead,   // may be wanted soon: what is wished for stays
};

struct BudgetCounts {
  std::uint64_t bytes_max = 0;
  std::uint64_t bytes = 0;      // resident and reserved
  std::uint64_t hits = 0;       // found resident
  std::uint64_t misses = 0;     // had to be made
  std::uint64_t evictions = 0;  // made room
  std::uint64_t refusals = 0;   // found no room
  std::uint64_t reads = 0;      // volumes read from a source, and of these
  std::uint64_t reads_failed = 0;
};

// Thread-safe.
class Budget {
 public:
  using Make = std::function<Result<Resident>()>;

  explicit Budget(std::uint64_t bytes_max) : bytes_max_(bytes_max) {}

  std::uint64_t next_owner();

  // What is kept under `key`, or what `make` makes of `bytes` bytes, which at most one caller runs
  // at a time for a key; the others wait and get the same answer. A failure is not remembered.
  // Errors: out_of_memory, those of `make`.
  Result<Resident> get(const ResidentKey& key, std::uint64_t bytes, Urgency urgency,
                       const Make& make);
  // The same for what is there or on its way; none if nobody has asked for it.
  std::optional<Result<Resident>> find(const ResidentKey& key);
  // What is there now; null for what is not, or not yet.
  Resident find_now(const ResidentKey& key);
  [[nodiscard]] bool has(const ResidentKey& key) const;

  // What `owner` wishes to have soon, in place of its earlier wishes.
  void wish(std::uint64_t owner, const std::vector<ResidentKey>& keys);

  [[nodiscard]] std::uint64_t bytes_of(std::uint64_t owner) const;
  // Drops what nobody holds of a dataset.
  void evict(std::uint64_t owner);
  // Drops all of a dataset that is no more; what somebody holds of it is not counted any longer.
  void forget(std::uint64_t owner);
  void count_read(bool ok);
  [[nodiscard]] BudgetCounts counts() const;
  // The most that a demand could have now: what is free and what may go for it.
  [[nodiscard]] std::uint64_t room() const;

 private:
  struct Entry {
    std::uint64_t bytes = 0;
    std::optional<Result<Resident>> answer;  // none while it is being made
    std::list<ResidentKey>::iterator place;  // in recent_, if listed
    bool listed = false;
  };

  // All under the mutex.
  std::optional<Result<Resident>> wait_for(const ResidentKey& key,
                                           std::unique_lock<std::mutex>& lock);
  void touch(Entry& entry);
  void drop(std::list<ResidentKey>::iterator listed);
  // Nobody outside can gain a reference while the lock is held, so a count of one stays one.
  [[nodiscard]] static bool is_held(const Entry& entry) {
    return entry.answer->value().use_count() > 1;
  }
  [[nodiscard]] bool is_wished(const ResidentKey& key) const { return wished_.count(key) > 0; }
  void drop_all(std::uint64_t owner, bool held_too);
  // A volume whose packed form is kept too, or an average of a volume that is: had again at little
  // cost.
  [[nodiscard]] bool is_derived(const ResidentKey& key) const;
  [[nodiscard]] bool may_go(const ResidentKey& key, Urgency urgency) const;
  [[nodiscard]] std::uint64_t evictable_for(Urgency urgency) const;
  bool make_room(std::uint64_t bytes, Urgency urgency);
  [[nodiscard]] Error no_room(std::uint64_t bytes) const;

  const std::uint64_t bytes_max_;
  mutable std::mutex mutex_;
  std::condition_variable arrived_;
  std::uint64_t owners_ = 0;
  std::map<ResidentKey, std::shared_ptr<Entry>> entries_;
  std::list<ResidentKey> recent_;  // what was made, the most recently used first
  std::map<std::uint64_t, std::vector<ResidentKey>> wishes_;
  std::multiset<ResidentKey> wished_;  // of all owners
  std::uint64_t used_ = 0;             // loaded and reserved
  BudgetCounts counts_;
};

// Of a message: in MiB.
std::string megabytes(std::uint64_t bytes);

// The variant of a key under which a volume's packed twin is kept.
inline constexpr const char* packed_variant = "packed16";

}  // namespace windsplat::data
