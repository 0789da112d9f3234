#include "server/access/address_table.hpp"

#include <algorithm>

namespace windsplat::access {
namespace {

constexpr TokenBucket::Micros forget_after = 600'000'000;
constexpr double bytes_at_once_s = 10;
constexpr double render_at_once_s = 60;

}  // namespace

AddressTable::AddressTable(const Limits& limits)
    : byte_rate_{limits.bytes_per_address, bytes_at_once_s * limits.bytes_per_address},
      render_rate_{limits.render_s_per_address / render_at_once_s, limits.render_s_per_address} {}

AddressUsage& AddressTable::entry(const std::string& address, Micros now) {
  forget_idle(now);
  const auto known = by_address_.find(address);
  if (known == by_address_.end()) {
    if (entries_.size() >= addresses_max) make_room();
    Entries fresh(1);
    fresh.front().address = address;
    by_address_.emplace(address, fresh.begin());
    entries_.splice(entries_.end(), fresh);
  } else {
    entries_.splice(entries_.end(), entries_, known->second);
  }
  AddressUsage& here = entries_.back();
  here.seen = now;
  return here;
}

AddressUsage* AddressTable::find(const std::string& address) {
  const auto known = by_address_.find(address);
  return known == by_address_.end() ? nullptr : &*known->second;
}

void AddressTable::forget(Entries::iterator entry) {
  by_address_.erase(by_address_.find(entry->address));
  entries_.erase(entry);
}

bool AddressTable::is_idle(AddressUsage& entry, Micros now) const {
  if (entry.is_present()) return false;
  entry.bytes.refill(byte_rate_, now);
  entry.render.refill(render_rate_, now);
  return entry.bytes.taken <= 0 && entry.render.taken <= 0;  // the other buckets refilled long ago
}

// Evict one or two at a time to bound the time of a call.
void AddressTable::forget_idle(Micros now) {
  for (int n = 0; n < 2 && !entries_.empty(); ++n) {
    AddressUsage& oldest = entries_.front();
    if (now - oldest.seen < forget_after) return;
    if (!is_idle(oldest, now)) {
      oldest.seen = now;
      entries_.splice(entries_.end(), entries_, entries_.begin());
      continue;
    }
    forget(entries_.begin());
  }
}

// Addresses with connections stay: there are fewer of them than entries. Evict unknown addresses
// first, as only they can come in large numbers.
void AddressTable::make_room() {
  const auto is_away = [](const AddressUsage& known) { return !known.is_present(); };
  auto oldest = std::find_if(entries_.begin(), entries_.end(), [&](const AddressUsage& known) {
    return is_away(known) && !known.authenticated;
  });
  if (oldest == entries_.end()) oldest = std::find_if(entries_.begin(), entries_.end(), is_away);
  if (oldest != entries_.end()) forget(oldest);
}

}  // namespace windsplat::access
