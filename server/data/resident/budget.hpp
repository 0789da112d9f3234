// The memory limit, shared by the datasets of a store: resident volumes and their levels, and
// what loaders and large pictures reserve. A load reserves its bytes first; the least recently used
// volumes are evicted if room is needed.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <limits>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/data/resident/brick_counts.hpp"

namespace windsplat::data {

// Key of a resident volume: number of the dataset in the budget, field, step and variant (empty: as
// loaded).
using ResidentKey = std::tuple<std::uint64_t, std::size_t, std::size_t, std::string>;
using Resident = std::shared_ptr<const void>;
// The field of the keys of what belongs to no field (Dataset::auxiliary()).
inline constexpr std::size_t no_field = std::numeric_limits<std::size_t>::max();

enum class Urgency {
  in_turn,   // exclusive: waits for volumes that others reference, see Budget::get()
  demand,    // the caller waits: any unreferenced volume may be evicted
  prefetch,  // needed soon: volumes with prefetch requests are not evicted
};

// References held by the caller of get() itself, for whose release it cannot wait.
using OwnPins = std::multiset<const void*>;

struct BudgetCounts {
  std::uint64_t bytes_max = 0;
  std::uint64_t bytes = 0;      // resident and reserved
  std::uint64_t hits = 0;       // found resident
  std::uint64_t misses = 0;     // had to be loaded or computed
  std::uint64_t evictions = 0;  // volumes evicted to make room
  std::uint64_t refusals = 0;   // loads that failed for lack of memory
  std::uint64_t reads = 0;      // volumes read from a source, and how many of them were prefetched
  std::uint64_t reads_failed = 0;
  std::uint64_t part_bytes = 0;  // of resident boxes of fields
  BrickCounts bricks;
};

// The name of the limit in messages.
struct LimitName {
  std::string text = "the memory limit";
  // The limit, as the operator would configure it, that leaves `bytes` for data; null: not
  // configurable.
  std::function<std::string(std::uint64_t bytes)> raised = nullptr;
};

// Thread-safe.
class Budget {
 public:
  using Make = std::function<Result<Resident>()>;

  explicit Budget(std::uint64_t bytes_max, LimitName name = {})
      : bytes_max_(bytes_max), name_(std::move(name)) {}

  std::uint64_t next_owner();

  // The volume under `key`, or the result of `make`, which takes `bytes` bytes. At most one caller
  // runs `make` for a key; others wait and get the same result. Failures are not cached.
  // If there is no room, in_turn unlists referenced volumes, so that they gain no new references,
  // and waits for their release; meanwhile other loads get room only if everything fits together.
  // It fails at once if `own` and lasting reservations leave too little, after
  // `reservation_patience` if temporary reservations do, otherwise if nothing was released for
  // `patience`; volumes still referenced are then listed again. `cancel` ends the wait for room.
  // Errors: out_of_memory, cancelled, those of `make`.
  Result<Resident> get(const ResidentKey& key, std::uint64_t bytes, Urgency urgency,
                       const Make& make, const OwnPins& own = {},
                       const CancelToken* cancel = nullptr);
  // The same for a volume that is resident or loading; nullopt otherwise.
  std::optional<Result<Resident>> find(const ResidentKey& key);
  // The resident volume; null if it is absent or still loading.
  Resident find_now(const ResidentKey& key);
  [[nodiscard]] bool has(const ResidentKey& key) const;
  // Resident volumes whose keys are `key`, apart from the end of the variant: these ends.
  [[nodiscard]] std::vector<std::string> endings_of(const ResidentKey& key) const;

  // Replaces the prefetch requests of `owner`.
  void request_prefetch(std::uint64_t owner, const std::vector<ResidentKey>& keys);

  [[nodiscard]] std::uint64_t bytes_of(std::uint64_t owner) const;
  // The same by level, as variants begin (level_variant); those with another beginning are of none.
  [[nodiscard]] std::vector<std::uint64_t> bytes_of_levels(std::uint64_t owner,
                                                           std::size_t levels) const;
  // Drops the unreferenced volumes of a dataset.
  void evict(std::uint64_t owner);
  // Drops all volumes of a removed dataset; those referenced count until released.
  void forget(std::uint64_t owner);
  void count_read(bool ok);
  [[nodiscard]] BrickMeter& bricks() { return bricks_; }
  // Ends all waits for room: later calls return resident volumes or an error.
  void end();
  [[nodiscard]] BudgetCounts counts() const;
  // Size of the largest request that can be met now: free bytes and those that can be evicted.
  [[nodiscard]] std::uint64_t room() const;
  [[nodiscard]] std::uint64_t bytes_max() const { return bytes_max_; }
  [[nodiscard]] const LimitName& name() const { return name_; }
  // "--memory-limit 192M leaves 68.0 MiB for data"
  [[nodiscard]] std::string limit_text() const;

  // Longer than the slowest frames, which reference volumes during rendering.
  static constexpr std::chrono::seconds patience{20};
  // Loaders of other datasets and large pictures usually end within moments; waiting longer rarely
  // helps.
  static constexpr std::chrono::seconds reservation_patience{12};

 private:
  friend class Reservation;
  struct Leaving {  // no longer listed, but still referenced
    ResidentKey key;
    std::weak_ptr<const void> held;
    std::uint64_t bytes = 0;
    bool in_the_way = false;  // unlisted for a load in turn, not because the dataset was removed
  };
  struct Entry {
    std::uint64_t bytes = 0;
    std::optional<Result<Resident>> answer;  // empty while it is being made
    std::list<ResidentKey>::iterator place;  // in recent_, if listed
    bool listed = false;
    std::list<Leaving>
        exit;  // its node of leaving_: allocated in advance, so that destructors need no memory
  };

  // All guarded by the mutex.
  std::optional<Result<Resident>> wait_for(const ResidentKey& key,
                                           std::unique_lock<std::mutex>& lock);
  void touch(Entry& entry);
  void drop(std::list<ResidentKey>::iterator listed);
  void drop_held(std::list<ResidentKey>::iterator listed);
  // No reference can be added from outside while the lock is held, so a use count of one is stable.
  [[nodiscard]] static bool is_held(const Entry& entry) {
    return entry.answer->value().use_count() > 1;
  }
  [[nodiscard]] bool is_requested(const ResidentKey& key) const {
    return requested_.count(key) > 0;
  }
  void drop_all(std::uint64_t owner, bool held_too);
  void drop_old_boxes();
  // Whether a volume can be recomputed cheaply: from its packed form, from a resident volume, or
  // without a field; or is a box, which is read in less time than the whole.
  [[nodiscard]] bool is_derived(const ResidentKey& key) const;
  [[nodiscard]] bool may_go(const ResidentKey& key, Urgency urgency) const;
  [[nodiscard]] std::uint64_t evictable_for(Urgency urgency) const;
  bool make_room(std::uint64_t bytes, Urgency urgency);
  bool wait_for_room(std::uint64_t bytes, const OwnPins& own, const CancelToken* cancel,
                     std::unique_lock<std::mutex>& lock);
  bool make_room_beside_turn(std::uint64_t bytes, Urgency urgency);
  void list_again();
  void take_off_list(std::uint64_t bytes, const OwnPins& own);
  [[nodiscard]] std::uint64_t bytes_of_pins(const OwnPins& own) const;
  void count_released();
  [[nodiscard]] std::uint64_t released() const;  // bytes released of the volumes in leaving_
  [[nodiscard]] Error no_room(const char* what, std::uint64_t bytes) const;

  const std::uint64_t bytes_max_;
  const LimitName name_;
  mutable std::mutex mutex_;
  std::condition_variable arrived_;
  std::uint64_t owners_ = 0;
  std::map<ResidentKey, std::shared_ptr<Entry>> entries_;
  std::list<ResidentKey> recent_;  // most recently used first
  std::map<std::uint64_t, std::vector<ResidentKey>> requests_;
  std::multiset<ResidentKey> requested_;  // requests of all owners
  std::list<Leaving> leaving_;
  std::uint64_t used_ = 0;            // total: listed, in construction, leaving and reserved
  std::uint64_t reserved_ = 0;        // part of used_ that is held by Reservations
  std::uint64_t lasting_ = 0;         // part of reserved_ that is held by lasting ones
  std::uint64_t released_total_ = 0;  // bytes released from leaving_ so far
  bool in_turn_waits_ = false;
  std::uint64_t turn_needs_ = 0;  // during the wait: all that the load holds and needs, and what
                                  // others got meanwhile
  // The thread that loads in turn; its reservations wait for room as its load does.
  struct Turn {
    std::thread::id thread;
    std::uint64_t bytes = 0;  // size of the volume in construction
    OwnPins own;
    const CancelToken* cancel = nullptr;
  } turn_;
  bool ended_ = false;
  BudgetCounts counts_;
  BrickMeter bricks_;  // not guarded
};

// Memory other than volumes that counts towards the limit during its lifetime. One thread at a
// time.
class Reservation {
 public:
  enum class Term {
    temporary,  // temporary: a load in turn waits for its end
    lasting,    // lasting: as long as a dataset
  };
  explicit Reservation(std::shared_ptr<Budget> budget = nullptr, Term term = Term::temporary)
      : budget_(std::move(budget)), term_(term) {}
  ~Reservation() { static_cast<void>(resize(0)); }
  Reservation(const Reservation&) = delete;
  Reservation& operator=(const Reservation&) = delete;

  // Reserves `bytes` by the rules of Budget::get(): in_turn waits for volumes that others
  // reference, and others get only room beside a waiting load in turn. Errors: out_of_memory,
  // cancelled.
  Result<void> take(std::uint64_t bytes, Urgency urgency, const OwnPins& own,
                    const CancelToken* cancel);
  // Changes the size. Errors: out_of_memory if evicting unreferenced volumes (`ahead`: those
  // without prefetch requests) does not make room; the size is then unchanged. Waits as
  // Budget::get() does if called within a load in turn. Always succeeds without a budget.
  Result<void> resize(std::uint64_t bytes, Urgency urgency = Urgency::demand);
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  void set(std::uint64_t bytes);  // requires the mutex of the budget
  std::shared_ptr<Budget> budget_;
  Term term_;
  std::uint64_t bytes_ = 0;
};

// Formats bytes in MiB, for messages.
std::string megabytes(std::uint64_t bytes);

// The variant of a key under which the packed form of a volume is cached.
inline constexpr const char* packed_variant = "packed16";
// What the variant of a box of a field contains. The last few of all datasets are kept, so that
// their number does not make the search for room slow.
inline constexpr const char* part_variant = "box ";
inline constexpr std::size_t parts_kept_max = 256;
// What follows in the variant of what is of a level, after that of a box: this and its number.
// Without it, the volume, its packed form and boxes are of level 0.
std::string level_variant(std::size_t level);

}  // namespace windsplat::data
