// The state of each address, for a bounded number of addresses: idle ones are evicted.
#pragma once

#include <cstddef>
#include <list>
#include <string>
#include <unordered_map>

#include "server/access/limits.hpp"
#include "server/access/token_bucket.hpp"

namespace windsplat::access {

struct AddressUsage {
  std::string address;
  std::size_t connections = 0;
  std::size_t reserved = 0;
  std::size_t sessions = 0;
  bool authenticated = false;  // has shown the token
  TokenBucket arrivals, handshakes, requests, health, messages, received, bytes, render, logins;
  TokenBucket::Micros seen = 0;

  [[nodiscard]] bool is_present() const { return connections + reserved + sessions > 0; }
};

class AddressTable {
 public:
  using Micros = TokenBucket::Micros;
  static constexpr std::size_t addresses_max = 4096;  // tracked at a time

  explicit AddressTable(const Limits& limits);

  // Added if absent, which may evict another. Strong exception guarantee if an allocation fails.
  AddressUsage& entry(const std::string& address, Micros now);
  // Null if absent; an address with connections or sessions is never absent. Does not allocate.
  AddressUsage* find(const std::string& address);
  [[nodiscard]] std::size_t size() const { return entries_.size(); }

  // Rates granted to each address; the rate of rendering is in seconds.
  [[nodiscard]] TokenBucket::Rate byte_rate() const { return byte_rate_; }
  [[nodiscard]] TokenBucket::Rate render_rate() const { return render_rate_; }

 private:
  using Entries = std::list<AddressUsage>;  // least recently seen first

  bool is_idle(AddressUsage& entry, Micros now) const;
  void forget(Entries::iterator entry);
  void forget_idle(Micros now);
  void make_room();

  const TokenBucket::Rate byte_rate_;
  const TokenBucket::Rate render_rate_;
  Entries entries_;
  std::unordered_map<std::string, Entries::iterator> by_address_;
};

}  // namespace windsplat::access
