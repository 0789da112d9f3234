// A map of resident volumes, and a list in order of use.
#include "server/data/resident/budget.hpp"

#include <algorithm>
#include <array>
#include <exception>
#include <iterator>
#include <new>
#include <utility>

#include "server/base/log.hpp"

namespace windsplat::data {

namespace {

bool is_box(const ResidentKey& key) {
  return std::get<3>(key).find(part_variant) != std::string::npos;
}

constexpr const char* other_memory = "memory other than fields";

// Other threads wait for the result, so exceptions become errors.
Result<Resident> made(const Budget::Make& make) {
  try {
    return make();
  } catch (const std::bad_alloc&) {
    return make_error(ErrorKind::out_of_memory, "the machine has no memory left");
  } catch (const std::exception& fault) {
    log::error("failed to create a resident volume", {{"fault", fault.what()}});
    return make_error(ErrorKind::internal, "loading failed");
  }
}

}  // namespace

std::string megabytes(std::uint64_t bytes) {
  const std::uint64_t tenths = (bytes * 10 + (1U << 19)) >> 20;
  return std::to_string(tenths / 10) + '.' + std::to_string(tenths % 10) + " MiB";
}

std::uint64_t Budget::next_owner() {
  const std::lock_guard lock(mutex_);
  return owners_++;
}

Result<Resident> Budget::get(const ResidentKey& key, std::uint64_t bytes, Urgency urgency,
                             const Make& make, const OwnPins& own, const CancelToken* cancel) {
  std::unique_lock lock(mutex_);
  for (;;) {
    if (auto there = wait_for(key, lock)) {
      return *there;
    }
    const bool there_is_room = urgency == Urgency::in_turn ? wait_for_room(bytes, own, cancel, lock)
                                                           : make_room_beside_turn(bytes, urgency);
    if (!there_is_room && cancel != nullptr && cancel->cancelled()) {
      return make_error(ErrorKind::cancelled, "request cancelled");
    }
    if (!there_is_room) {
      ++counts_.refusals;
      return no_room(std::get<1>(key) == no_field ? other_memory : "the field", bytes);
    }
    // Another thread may have started the same load during the wait.
    if (entries_.count(key) == 0) break;
  }
  ++counts_.misses;
  const auto entry = std::make_shared<Entry>();
  entry->bytes = bytes;
  entry->exit.push_back({key, {}, bytes});
  Turn turn;
  if (urgency == Urgency::in_turn) turn = {std::this_thread::get_id(), bytes, own, cancel};
  entries_.emplace(key, entry);
  used_ += bytes;

  if (urgency == Urgency::in_turn) turn_ = std::move(turn);
  lock.unlock();
  Result<Resident> answer = made(make);
  lock.lock();
  if (urgency == Urgency::in_turn) turn_ = {};

  if (answer.has_value()) {
    recent_.push_front(key);
    entry->place = recent_.begin();
    entry->listed = true;
    if (is_box(key)) drop_old_boxes();
  } else {
    used_ -= bytes;
    entries_.erase(key);
  }
  entry->answer.emplace(answer);
  arrived_.notify_all();
  return answer;
}

std::optional<Result<Resident>> Budget::find(const ResidentKey& key) {
  std::unique_lock lock(mutex_);
  return wait_for(key, lock);
}

Resident Budget::find_now(const ResidentKey& key) {
  const std::lock_guard lock(mutex_);
  const auto found = entries_.find(key);
  if (found == entries_.end() || !found->second->listed) return nullptr;
  ++counts_.hits;
  touch(*found->second);
  return found->second->answer->value();
}

bool Budget::has(const ResidentKey& key) const {
  const std::lock_guard lock(mutex_);
  const auto found = entries_.find(key);
  return found != entries_.end() && found->second->listed;
}

std::vector<std::string> Budget::endings_of(const ResidentKey& key) const {
  const auto& [owner, field, step, beginning] = key;
  const std::lock_guard lock(mutex_);
  std::vector<std::string> out;
  for (auto at = entries_.lower_bound(key); at != entries_.end(); ++at) {
    const auto& [its_owner, its_field, its_step, variant] = at->first;
    if (its_owner != owner || its_field != field || its_step != step) break;
    if (!variant.starts_with(beginning)) break;
    if (at->second->listed) out.push_back(variant.substr(beginning.size()));
  }
  return out;
}

void Budget::request_prefetch(std::uint64_t owner, const std::vector<ResidentKey>& keys) {
  const std::lock_guard lock(mutex_);
  // Removing prefetch requests needs no memory, because destructors do it.
  if (const auto before = requests_.find(owner); before != requests_.end()) {
    for (const ResidentKey& key : before->second) requested_.erase(requested_.find(key));
    requests_.erase(before);
  }
  if (keys.empty()) return;
  std::multiset<ResidentKey> requested(keys.begin(), keys.end());
  requests_.emplace(owner, keys);
  requested_.merge(requested);  // insert both or none if allocation fails
}

std::uint64_t Budget::bytes_of(std::uint64_t owner) const {
  const std::lock_guard lock(mutex_);
  std::uint64_t bytes = 0;
  for (auto at = entries_.lower_bound({owner, 0, 0, ""});
       at != entries_.end() && std::get<0>(at->first) == owner; ++at) {
    bytes += at->second->listed ? at->second->bytes : 0;
  }
  return bytes;
}

void Budget::evict(std::uint64_t owner) {
  const std::lock_guard lock(mutex_);
  drop_all(owner, false);
}

void Budget::forget(std::uint64_t owner) {
  const std::lock_guard lock(mutex_);
  drop_all(owner, true);
}

void Budget::count_read(bool ok) {
  const std::lock_guard lock(mutex_);
  ++counts_.reads;
  counts_.reads_failed += ok ? 0 : 1;
}

void Budget::end() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  arrived_.notify_all();
}

BudgetCounts Budget::counts() const {
  const std::lock_guard lock(mutex_);
  BudgetCounts out = counts_;
  out.bytes_max = bytes_max_;
  out.bytes = used_ - released();
  for (const ResidentKey& key : recent_) {
    out.part_bytes += is_box(key) ? entries_.at(key)->bytes : 0;
  }
  out.bricks = bricks_.counts();
  return out;
}

std::optional<Result<Resident>> Budget::wait_for(const ResidentKey& key,
                                                 std::unique_lock<std::mutex>& lock) {
  const auto found = entries_.find(key);
  if (found == entries_.end()) {
    return std::nullopt;
  }
  const std::shared_ptr<Entry> entry = found->second;
  arrived_.wait(lock, [&] { return entry->answer.has_value(); });
  if (entry->answer->has_value()) {
    ++counts_.hits;
    touch(*entry);
  }
  return entry->answer;
}

void Budget::touch(Entry& entry) {
  if (entry.listed) {
    recent_.splice(recent_.begin(), recent_, entry.place);
  }
}

void Budget::drop(std::list<ResidentKey>::iterator listed) {
  const auto at = entries_.find(*listed);
  used_ -= at->second->bytes;
  at->second->listed = false;
  entries_.erase(at);
  recent_.erase(listed);
}

// No longer listed, but counted until the last reference is released.
void Budget::drop_held(std::list<ResidentKey>::iterator listed) {
  Entry& entry = *entries_.find(*listed)->second;
  entry.exit.front().held = entry.answer->value();
  leaving_.splice(leaving_.end(), entry.exit);
  used_ += entry.bytes;
  drop(listed);
}

void Budget::drop_all(std::uint64_t owner, bool held_too) {
  for (Leaving& one : leaving_) {
    if (held_too && std::get<0>(one.key) == owner) one.in_the_way = false;
  }
  for (auto at = recent_.begin(); at != recent_.end();) {
    const auto next = std::next(at);
    if (std::get<0>(*at) == owner) {
      if (!is_held(*entries_.at(*at))) {
        drop(at);
      } else if (held_too) {
        drop_held(at);
      }
    }
    at = next;
  }
}

void Budget::drop_old_boxes() {
  std::size_t boxes = 0;
  for (auto at = recent_.begin(); at != recent_.end();) {
    const auto next = std::next(at);
    if (is_box(*at) && ++boxes > parts_kept_max && !is_held(*entries_.at(*at))) drop(at);
    at = next;
  }
}

bool Budget::is_derived(const ResidentKey& key) const {
  const auto& [owner, field, step, variant] = key;
  const auto is_kept = [&, &owner = owner, &field = field, &step = step](const char* origin) {
    const auto at = entries_.find({owner, field, step, origin});
    return at != entries_.end() && at->second->listed;
  };
  if (variant == packed_variant) return false;
  if (field == no_field || is_box(key)) return true;
  return is_kept(packed_variant) || (!variant.empty() && is_kept(""));
}

bool Budget::may_go(const ResidentKey& key, Urgency urgency) const {
  return !is_held(*entries_.at(key)) && (urgency == Urgency::demand || !is_requested(key));
}

std::uint64_t Budget::evictable_for(Urgency urgency) const {
  std::uint64_t bytes = 0;
  for (const ResidentKey& key : recent_) {
    bytes += may_go(key, urgency) ? entries_.at(key)->bytes : 0;
  }
  return bytes;
}

std::uint64_t Budget::room() const {
  const std::lock_guard lock(mutex_);
  return bytes_max_ - used_ + released() + evictable_for(Urgency::demand);
}

std::uint64_t Budget::released() const {
  std::uint64_t bytes = 0;
  for (const Leaving& one : leaving_) bytes += one.held.expired() ? one.bytes : 0;
  return bytes;
}

void Budget::count_released() {
  for (auto at = leaving_.begin(); at != leaving_.end();) {
    if (at->held.expired()) {
      used_ -= at->bytes;
      released_total_ += at->bytes;
      if (at->in_the_way) ++counts_.evictions;
      at = leaving_.erase(at);
    } else {
      ++at;
    }
  }
}

std::uint64_t Budget::bytes_of_pins(const OwnPins& own) const {
  std::uint64_t bytes = 0;
  for (const ResidentKey& key : recent_) {
    const Entry& entry = *entries_.at(key);
    if (own.count(entry.answer->value().get()) > 0 && is_held(entry)) bytes += entry.bytes;
  }
  return bytes;
}

// Evicts the least recently used first, until enough room is free.
void Budget::take_off_list(std::uint64_t bytes, const OwnPins& own) {
  std::uint64_t coming = bytes_max_ - std::min(used_, bytes_max_) + evictable_for(Urgency::demand);
  for (const Leaving& one : leaving_) coming += one.bytes;
  for (auto at = recent_.end(); at != recent_.begin() && coming < bytes;) {
    --at;
    const Entry& entry = *entries_.at(*at);
    if (!is_held(entry) || own.count(entry.answer->value().get()) > 0) continue;
    coming += entry.bytes;
    drop_held(at++);
    leaving_.back().in_the_way = true;
  }
}

// After a timed-out wait: referenced volumes occupy memory anyway, so list them again.
void Budget::list_again() {
  for (auto at = leaving_.begin(); at != leaving_.end();) {
    const auto next = std::next(at);
    Resident held = at->held.lock();
    if (held && at->in_the_way && entries_.count(at->key) == 0) {
      const auto entry = std::make_shared<Entry>();
      entry->bytes = at->bytes;
      entry->answer.emplace(std::move(held));
      std::list<ResidentKey> place(1, at->key);
      entries_.emplace(at->key, entry);
      entry->place = place.begin();
      entry->listed = true;
      recent_.splice(recent_.end(), place);
      at->held.reset();
      at->in_the_way = false;
      entry->exit.splice(entry->exit.end(), leaving_, at);
    }
    at = next;
  }
}

// While a load in turn waits, other loads get only the room that it does not need.
bool Budget::make_room_beside_turn(std::uint64_t bytes, Urgency urgency) {
  if (!in_turn_waits_) return make_room(bytes, urgency);
  const bool fits = turn_needs_ <= bytes_max_ && bytes <= bytes_max_ - turn_needs_;
  if (!fits || urgency == Urgency::prefetch || !make_room(bytes, urgency)) return false;
  turn_needs_ += bytes;
  return true;
}

bool Budget::wait_for_room(std::uint64_t bytes, const OwnPins& own, const CancelToken* cancel,
                           std::unique_lock<std::mutex>& lock) {
  // Reference counts send no notifications, so they are polled.
  constexpr std::chrono::milliseconds look_every{5};
  using Clock = std::chrono::steady_clock;
  std::uint64_t released_before = released_total_;
  Clock::time_point changed = Clock::now();
  Clock::time_point reservations_fit_at = changed;
  bool there_is_room = false;
  const std::uint64_t needs = bytes + turn_.bytes + bytes_of_pins(own);
  in_turn_waits_ = true;
  turn_needs_ = needs + reserved_;
  for (;;) {
    there_is_room = make_room(bytes, Urgency::demand);
    const bool cannot_fit = needs + lasting_ > bytes_max_;
    const bool cancelled = cancel != nullptr && cancel->cancelled();
    if (there_is_room || cannot_fit || ended_ || cancelled) break;
    if (needs + reserved_ <= bytes_max_) {
      reservations_fit_at = Clock::now();
    } else if (Clock::now() - reservations_fit_at > reservation_patience) {
      break;
    }
    if (released_before != released_total_) {
      released_before = released_total_;
      changed = Clock::now();
    }
    if (Clock::now() - changed > patience) break;
    // Resident volumes stay listed if only reservations prevent the load.
    if (needs + reserved_ <= bytes_max_) take_off_list(bytes, own);
    arrived_.wait_for(lock, look_every);
  }
  in_turn_waits_ = false;
  if (!there_is_room) list_again();
  return there_is_room;
}

bool Budget::make_room(std::uint64_t bytes, Urgency urgency) {
  count_released();
  if (bytes > bytes_max_) {
    return false;
  }
  if (used_ <= bytes_max_ - bytes) {
    return true;
  }
  // Evict only if that makes enough room: a failed request must not empty the cache.
  if (used_ - evictable_for(urgency) > bytes_max_ - bytes) {
    return false;
  }
  // Evicts first what can be recomputed without the file, then volumes without prefetch requests,
  // then the rest.
  using Rule = bool (*)(const Budget&, const ResidentKey&);
  constexpr std::array<Rule, 3> rules{
      [](const Budget& self, const ResidentKey& key) {
        return self.is_derived(key) && !self.is_requested(key);
      },
      [](const Budget& self, const ResidentKey& key) { return !self.is_requested(key); },
      [](const Budget&, const ResidentKey&) { return true; }};
  for (const Rule rule : rules) {
    for (auto at = recent_.end(); at != recent_.begin() && used_ > bytes_max_ - bytes;) {
      --at;
      if (may_go(*at, urgency) && rule(*this, *at)) {
        ++counts_.evictions;
        drop(at++);
      }
    }
  }
  return used_ <= bytes_max_ - bytes;
}

Error Budget::no_room(const char* what, std::uint64_t bytes) const {
  return make_error(ErrorKind::out_of_memory, std::string(what) + " needs " + megabytes(bytes) +
                                                  "; " + limit_text() + ", of which " +
                                                  megabytes(used_) + " are in use");
}

std::string Budget::limit_text() const {
  return name_.text + " leaves " + megabytes(bytes_max_) + " for data";
}

Result<void> Reservation::take(std::uint64_t bytes, Urgency urgency, const OwnPins& own,
                               const CancelToken* cancel) {
  if (budget_ == nullptr) return {};
  std::unique_lock lock(budget_->mutex_);
  const bool there_is_room = urgency == Urgency::in_turn
                                 ? budget_->wait_for_room(bytes, own, cancel, lock)
                                 : budget_->make_room_beside_turn(bytes, urgency);
  if (!there_is_room && cancel != nullptr && cancel->cancelled()) {
    return make_error(ErrorKind::cancelled, "request cancelled");
  }
  if (!there_is_room) {
    ++budget_->counts_.refusals;
    return budget_->no_room(other_memory, bytes);
  }
  set(bytes);
  return {};
}

void Reservation::set(std::uint64_t bytes) {
  budget_->used_ = budget_->used_ - bytes_ + bytes;
  budget_->reserved_ = budget_->reserved_ - bytes_ + bytes;
  if (term_ == Term::lasting) budget_->lasting_ = budget_->lasting_ - bytes_ + bytes;
  if (bytes < bytes_) budget_->arrived_.notify_all();
  bytes_ = bytes;
}

Result<void> Reservation::resize(std::uint64_t bytes, Urgency urgency) {
  if (budget_ == nullptr) return {};
  std::unique_lock lock(budget_->mutex_);
  // Failed prefetches are ignored.
  const bool in_turn =
      urgency != Urgency::prefetch && budget_->turn_.thread == std::this_thread::get_id();
  if (bytes > bytes_ && !budget_->make_room(bytes - bytes_, urgency) &&
      !(in_turn &&
        budget_->wait_for_room(bytes - bytes_, budget_->turn_.own, budget_->turn_.cancel, lock))) {
    ++budget_->counts_.refusals;
    return budget_->no_room(other_memory, bytes - bytes_);
  }
  set(bytes);
  return {};
}

}  // namespace windsplat::data
