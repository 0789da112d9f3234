// What each address has of the server and had of late, as a pure state machine: events with their
// times in, refusals out. It owns no socket, lock or clock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <optional>
#include <string>
#include <unordered_map>

#include "server/access/limits.hpp"
#include "server/metrics/limit_kind.hpp"

namespace windsplat::net {

struct Refusal {
  LimitKind kind = LimitKind::connections;
  double limit = 0;       // as Limits has it
  int retry_after_s = 1;  // until it would be let in, as far as that is known
};

class Quota {
 public:
  using Micros = std::int64_t;  // of a clock that never goes back

  static constexpr std::size_t addresses_max = 4096;  // known at a time
  // Beyond the limits so many connections more are taken in, of an address a quarter of them, in
  // which health alone is asked about.
  static constexpr std::size_t reserve_max = 64;
  static constexpr std::size_t reserve_per_address = reserve_max / 4;
  static constexpr double tls_arrivals = 5;  // a handshake takes so many plain connections' work

  explicit Quota(const Limits& limits) : limits_(limits) {}

  // What a connection that comes is: one like others, one of the reserve (and why), or too much.
  enum class Slot { ordinary, reserve, none };
  struct Arrival {
    Slot place = Slot::none;
    std::optional<Refusal> reason;  // of what is not ordinary
    bool known = false;             // a proxy, or the address has shown the token
  };
  // Before a connection is looked at any further: whether there were not too many of late.
  std::optional<Refusal> arrive(const std::string& address, bool trusted, bool tls, Micros now);
  // What a TLS handshake has taken of a processor so far. Needs no memory.
  void handshake_took(const std::string& address, bool trusted, Micros took, Micros now);
  // The address has shown the token: until it is forgotten its handshakes do not compete with those
  // of strangers.
  void authenticated(const std::string& address, Micros now);
  // `trusted`: a proxy's, which brings many and counts in total alone.
  Arrival connect(const std::string& address, bool trusted, Micros now);
  // Whether it found no place because the reserve is full, of others that is.
  [[nodiscard]] bool is_kept_out_by_others(const std::string& address, bool trusted, Micros now);
  void disconnect(const std::string& address, Slot place);  // needs no memory

  std::optional<Refusal> open_session(const std::string& address, Micros now);
  void close_session(const std::string& address);  // needs no memory

  // A request that was understood. Those for health have an allowance of their own, as large.
  std::optional<Refusal> request(const std::string& address, bool health, Micros now);
  // Whether a picture may be begun: nothing is owed of bytes and renderer's time.
  std::optional<Refusal> picture(const std::string& address, Micros now);
  // How long until nothing is owed.
  Micros throttle_delay(const std::string& address, Micros now);

  void sent(const std::string& address, std::size_t bytes, Micros now);
  void rendered(const std::string& address, Micros took, Micros now);
  // Asked before a token is compared: there were not too many wrong ones of late.
  std::optional<Refusal> may_try_login(const std::string& address, Micros now);
  // A message of a stream: how long nothing more is to be read of it.
  Micros message_received(const std::string& address, std::size_t bytes, Micros now);
  // Refused where there were too many of late; the others are let off with being told so.
  std::optional<Refusal> failed_login(const std::string& address, Micros now);

  [[nodiscard]] std::size_t known() const { return entries_.size(); }
  [[nodiscard]] std::size_t connections() const { return connections_; }
  [[nodiscard]] std::size_t reserved() const { return reserved_; }

 private:
  // What may be taken of something that comes back at a rate. It may go into debt.
  struct Rate {
    double a_second = 0;  // 0: as much as is wanted
    double at_once = 0;
  };
  struct Bucket {
    double taken = 0;  // less what came back: 0 is full
    Micros at = 0;
    void refill(const Rate& rate, Micros now);
  };
  struct Entry {
    std::string address;
    std::size_t connections = 0;
    std::size_t reserved = 0;
    std::size_t sessions = 0;
    bool authenticated = false;
    Bucket arrivals, handshakes, requests, health, messages, received, bytes, render, logins;
    Micros seen = 0;
  };
  using Entries = std::list<Entry>;  // the one not seen for longest first

  [[nodiscard]] static Rate rate_for_ten_seconds(double a_second);
  [[nodiscard]] Rate request_rate() const;
  std::optional<Refusal> may_handshake(Entry& entry, bool trusted, Micros now);
  // What counts an address's handshakes beside its own allowance; null: nothing.
  Bucket* shared_handshakes(const Entry* entry, bool trusted);
  [[nodiscard]] Rate byte_rate() const;
  [[nodiscard]] Rate render_rate() const;
  [[nodiscard]] Rate login_rate() const;
  static std::optional<Refusal> take_one(Bucket& bucket, const Rate& rate, LimitKind kind,
                                         double limit, Micros now);
  static Micros wait_for(Bucket& bucket, const Rate& rate, double room, Micros now);

  // Where memory fails for a new one, nothing has changed.
  Entry& entry(const std::string& address, Micros now);
  // Of one that has connections or sessions, and so is known. Needs no memory.
  Entry* known_entry(const std::string& address);
  void forget(Entries::iterator entry);
  void forget_idle(Micros now);
  bool is_idle(Entry& entry, Micros now) const;
  void make_room();

  Limits limits_;
  Entries entries_;
  std::unordered_map<std::string, Entries::iterator> by_address_;
  Bucket arrivals_;  // of all
  Bucket stranger_handshakes_, known_handshakes_;
  std::size_t connections_ = 0;
  std::size_t reserved_ = 0;
};

}  // namespace windsplat::net
