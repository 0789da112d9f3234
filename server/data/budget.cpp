// One map of what is kept, one list in the order of use.
#include "server/data/budget.hpp"

#include <array>
#include <exception>
#include <iterator>
#include <new>
#include <utility>

#include "server/base/log.hpp"

namespace windsplat::data {

namespace {

// Others wait for the answer, so there is one whatever happens.
Result<Resident> made(const Budget::Make& make) {
  try {
    return make();
  } catch (const std::bad_alloc&) {
    return make_error(ErrorKind::out_of_memory, "the machine has no memory left");
  } catch (const std::exception& fault) {
    log::error("making what is to be resident failed", {{"fault", fault.what()}});
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
                             const Make& make) {
  std::unique_lock lock(mutex_);
  if (auto there = wait_for(key, lock)) {
    return *there;
  }
  if (!make_room(bytes, urgency)) {
    ++counts_.refusals;
    return no_room(bytes);
  }
  ++counts_.misses;
  const auto entry = std::make_shared<Entry>();
  entry->bytes = bytes;
  entries_.emplace(key, entry);
  used_ += bytes;

  lock.unlock();
  Result<Resident> answer = made(make);
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

void Budget::wish(std::uint64_t owner, const std::vector<ResidentKey>& keys) {
  const std::lock_guard lock(mutex_);
  // Taking wishes back needs no memory: destructors do it.
  if (const auto before = wishes_.find(owner); before != wishes_.end()) {
    for (const ResidentKey& key : before->second) wished_.erase(wished_.find(key));
    wishes_.erase(before);
  }
  if (keys.empty()) return;
  std::multiset<ResidentKey> wished(keys.begin(), keys.end());
  wishes_.emplace(owner, keys);
  wished_.merge(wished);  // both or none, should memory fail
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

BudgetCounts Budget::counts() const {
  const std::lock_guard lock(mutex_);
  BudgetCounts out = counts_;
  out.bytes_max = bytes_max_;
  out.bytes = used_;
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

void Budget::drop_all(std::uint64_t owner, bool held_too) {
  for (auto at = recent_.begin(); at != recent_.end();) {
    const auto next = std::next(at);
    if (std::get<0>(*at) == owner && (held_too || !is_held(*entries_.at(*at)))) drop(at);
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
  return is_kept(packed_variant) || (!variant.empty() && is_kept(""));
}

bool Budget::may_go(const ResidentKey& key, Urgency urgency) const {
  return !is_held(*entries_.at(key)) && (urgency == Urgency::demand || !is_wished(key));
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
  return bytes_max_ - used_ + evictable_for(Urgency::demand);
}

bool Budget::make_room(std::uint64_t bytes, Urgency urgency) {
  if (bytes > bytes_max_) {
    return false;
  }
  if (used_ <= bytes_max_ - bytes) {
    return true;
  }
  // Only evict if that will do: a request that fails must not empty the cache for others.
  if (used_ - evictable_for(urgency) > bytes_max_ - bytes) {
    return false;
  }
  // First what can be had again without its file, then what nobody wishes for, then the rest.
  using Rule = bool (*)(const Budget&, const ResidentKey&);
  constexpr std::array<Rule, 3> rules{
      [](const Budget& self, const ResidentKey& key) {
        return self.is_derived(key) && !self.is_wished(key);
      },
      [](const Budget& self, const ResidentKey& key) { return !self.is_wished(key); },
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

Error Budget::no_room(std::uint64_t bytes) const {
  return make_error(ErrorKind::out_of_memory, "the field needs " + megabytes(bytes) +
                                                  "; the memory limit is " + megabytes(bytes_max_) +
                                                  ", of which " + megabytes(used_) + " are in use");
}

}  // namespace windsplat::data
