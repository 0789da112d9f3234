// The bytes that the datasets of a store share, and what they were spent on: a cache of whatever is
// resident. A load reserves its bytes first; the least recently used goes when room is needed.
#pragma once

#include <chrono>
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
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"

namespace windsplat::data {

// What is kept: the dataset by its number in the budget, field, step, and what was made of it
// (empty: as it was loaded).
using ResidentKey = std::tuple<std::uint64_t, std::size_t, std::size_t, std::string>;
using Resident = std::shared_ptr<const void>;

enum class Urgency {
  in_turn,   // the only one of its kind at a time: waits for what others hold, see Budget::get()
  demand,    // somebody waits: whatever nobody holds may go for it
  prefetch,  // may be wanted soon: what is wished for stays
};

// What the caller of get() holds itself, and so cannot wait for.
using OwnPins = std::multiset<const void*>;

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

// How messages name the limit.
struct LimitName {
  std::string text = "the memory limit";
  // As it would have to be for so many bytes of data at least; none: nobody can change it.
  std::function<std::string(std::uint64_t bytes)> raised = nullptr;
};

// Thread-safe.
class Budget {
 public:
  using Make = std::function<Result<Resident>()>;

  explicit Budget(std::uint64_t bytes_max, LimitName name = {})
      : bytes_max_(bytes_max), name_(std::move(name)) {}

  std::uint64_t next_owner();

  // What is kept under `key`, or what `make` makes of `bytes` bytes, which at most one caller runs
  // at a time for a key; the others wait and get the same answer. A failure is not remembered.
  // Where there is no room, in_turn takes what others hold off the list, so that nobody holds it
  // anew, and waits until they let go of it; meanwhile others get room only where all of it fits
  // together. It fails at once where `own` and lasting reservations leave too little, where
  // temporary ones do after `reservation_patience`, else when nothing was let go of for `patience`;
  // what is still held then is listed again. `cancel` ends the wait for room.
  // Errors: out_of_memory, cancelled, those of `make`.
  Result<Resident> get(const ResidentKey& key, std::uint64_t bytes, Urgency urgency,
                       const Make& make, const OwnPins& own = {},
                       const CancelToken* cancel = nullptr);
  // The same for what is there or on its way; none if nobody has asked for it.
  std::optional<Result<Resident>> find(const ResidentKey& key);
  // What is there now; null for what is not, or not yet.
  Resident find_now(const ResidentKey& key);
  // The same, and what was taken off the list but is still held by somebody.
  Resident find_held(const ResidentKey& key);
  [[nodiscard]] bool has(const ResidentKey& key) const;

  // What `owner` wishes to have soon, in place of its earlier wishes.
  void request_prefetch(std::uint64_t owner, const std::vector<ResidentKey>& keys);

  [[nodiscard]] std::uint64_t bytes_of(std::uint64_t owner) const;
  // Drops what nobody holds of a dataset.
  void evict(std::uint64_t owner);
  // Drops all of a dataset that is no more; what somebody holds of it counts until it is let go of.
  void forget(std::uint64_t owner);
  void count_read(bool ok);
  // Ends all waits for room: later calls get what is there or an error.
  void end();
  [[nodiscard]] BudgetCounts counts() const;
  // The most that a demand could have now: what is free and what may go for it.
  [[nodiscard]] std::uint64_t room() const;
  [[nodiscard]] std::uint64_t bytes_max() const { return bytes_max_; }
  [[nodiscard]] const LimitName& name() const { return name_; }
  // "--memory-limit 192M leaves 68.0 MiB for data"
  [[nodiscard]] std::string limit_text() const;

  // Longer than the slowest frames that hold a volume while they are drawn.
  static constexpr std::chrono::seconds patience{20};
  // Loaders that read for others and large pictures end within moments or not soon.
  static constexpr std::chrono::seconds reservation_patience{12};

 private:
  friend class Reservation;
  struct Leaving {  // not listed any more, but still held by somebody
    ResidentKey key;
    std::weak_ptr<const void> held;
    std::uint64_t bytes = 0;
    bool in_the_way = false;  // taken off for a load in turn, and not because it is no more
  };
  struct Entry {
    std::uint64_t bytes = 0;
    std::optional<Result<Resident>> answer;  // none while it is being made
    std::list<ResidentKey>::iterator place;  // in recent_, if listed
    bool listed = false;
    std::list<Leaving> exit;  // its node of leaving_: destructors drop what is held
  };

  // All under the mutex.
  std::optional<Result<Resident>> wait_for(const ResidentKey& key,
                                           std::unique_lock<std::mutex>& lock);
  void touch(Entry& entry);
  void drop(std::list<ResidentKey>::iterator listed);
  void drop_held(std::list<ResidentKey>::iterator listed);
  // Nobody outside can gain a reference while the lock is held, so a count of one stays one.
  [[nodiscard]] static bool is_held(const Entry& entry) {
    return entry.answer->value().use_count() > 1;
  }
  [[nodiscard]] bool is_requested(const ResidentKey& key) const {
    return requested_.count(key) > 0;
  }
  void drop_all(std::uint64_t owner, bool held_too);
  // A volume whose packed form is kept too, or an average of a volume that is: had again at little
  // cost.
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
  [[nodiscard]] std::uint64_t released() const;  // of those that are leaving
  [[nodiscard]] Error no_room(const char* what, std::uint64_t bytes) const;

  const std::uint64_t bytes_max_;
  const LimitName name_;
  mutable std::mutex mutex_;
  std::condition_variable arrived_;
  std::uint64_t owners_ = 0;
  std::map<ResidentKey, std::shared_ptr<Entry>> entries_;
  std::list<ResidentKey> recent_;  // what was made, the most recently used first
  std::map<std::uint64_t, std::vector<ResidentKey>> requests_;
  std::multiset<ResidentKey> requested_;  // of all owners
  std::list<Leaving> leaving_;
  std::uint64_t used_ = 0;            // all of it: listed, being made, leaving and reserved
  std::uint64_t reserved_ = 0;        // of this by Reservations
  std::uint64_t lasting_ = 0;         // of these by lasting ones
  std::uint64_t released_total_ = 0;  // by what was leaving, ever
  bool in_turn_waits_ = false;
  std::uint64_t turn_needs_ = 0;  // while it waits: all that it holds and wants, and what others
                                  // got beside it
  // Who makes something in turn, so that its reservations wait for room as it did itself.
  struct Turn {
    std::thread::id thread;
    std::uint64_t bytes = 0;  // of what is being made
    OwnPins own;
    const CancelToken* cancel = nullptr;
  } turn_;
  bool ended_ = false;
  BudgetCounts counts_;
};

// Memory that is no volume but counts in the limit for as long as this lives. One thread at a time.
class Reservation {
 public:
  enum class Term {
    temporary,  // for some work: who loads in turn waits for its end
    lasting,    // as long as a dataset
  };
  explicit Reservation(std::shared_ptr<Budget> budget = nullptr, Term term = Term::temporary)
      : budget_(std::move(budget)), term_(term) {}
  ~Reservation() { static_cast<void>(resize(0)); }
  Reservation(const Reservation&) = delete;
  Reservation& operator=(const Reservation&) = delete;

  // So many from none, by the rules of Budget::get(): in_turn waits for what others hold, and
  // others get what is there beside one in turn that waits. Errors: out_of_memory, cancelled.
  Result<void> take(std::uint64_t bytes, Urgency urgency, const OwnPins& own,
                    const CancelToken* cancel);
  // Errors: out_of_memory, where volumes that nobody holds do not make room for more (`ahead`:
  // those that nobody wishes for either); the size stays. Waits as Budget::get() does where it is
  // called by what that makes in turn. Without a budget all is allowed.
  Result<void> resize(std::uint64_t bytes, Urgency urgency = Urgency::demand);
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  void set(std::uint64_t bytes);  // under the budget's mutex
  std::shared_ptr<Budget> budget_;
  Term term_;
  std::uint64_t bytes_ = 0;
};

// Of a message: in MiB.
std::string megabytes(std::uint64_t bytes);

// The variant of a key under which a volume's packed twin is kept.
inline constexpr const char* packed_variant = "packed16";

}  // namespace windsplat::data
