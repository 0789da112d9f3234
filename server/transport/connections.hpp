// Registry of open connections, so that a drain reaches all of them. Used by the io thread only.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace windsplat::transport {

class Connection {
 public:
  virtual ~Connection() = default;
  virtual void drain() = 0;  // close after the current response
  virtual void abort() = 0;  // end immediately
  // A dataset was reopened because its files changed.
  virtual void on_changed(const std::string& /*dataset*/) {}
  // The access token has changed.
  virtual void on_new_token() {}

  // Used to admit a new connection in place of this one: the time at which it entered a state;
  // nullopt in other states, or after its slot was freed.
  using Since = std::optional<std::chrono::steady_clock::time_point>;
  virtual Since idle_since() const { return {}; }     // waiting for the first byte of a request
  virtual Since unasked_since() const { return {}; }  // in the reserve, without a complete request
  virtual Since handshaking_since() const {
    return {};
  }                                                        // in the TLS handshake; only then the
                                                           // next two members are used
  virtual std::string_view address() const { return {}; }  // as counted by quotas
  virtual bool is_known() const { return false; }  // a proxy, or the address has shown the token
};

class Connections {
 public:
  // Called when the last connection that a drain waits for has closed.
  void on_empty(std::function<void()> call) { empty_ = std::move(call); }

  std::uint64_t next_id() { return ++ids_; }
  // `late`: accepted during a drain, which does not wait for it.
  void add(std::uint64_t id, std::weak_ptr<Connection> connection, bool stream, bool late = false) {
    live_[id] = {std::move(connection), stream, late};
    streams_ += stream ? 1U : 0U;
    waited_for_ += late ? 0U : 1U;
  }
  void remove(std::uint64_t id) {
    const auto found = live_.find(id);
    if (found == live_.end()) return;
    streams_ -= found->second.stream ? 1U : 0U;
    const bool late = found->second.late;
    waited_for_ -= late ? 0U : 1U;
    live_.erase(found);
    if (!late && waited_for_ == 0 && empty_) empty_();
  }

  [[nodiscard]] std::size_t size() const { return waited_for_; }
  [[nodiscard]] std::size_t streams() const { return streams_; }

  // Calls the function for each connection; any of them may close during its call. Does not
  // allocate.
  template <class Call>
  void each(const Call& call) const {
    for (auto at = live_.begin(); at != live_.end();) {
      const std::uint64_t id = at->first;
      if (const auto connection = at->second.connection.lock()) call(*connection);
      at = live_.upper_bound(id);
    }
  }

  // If more than `most` connections are in a state, closes the one that has been in it longest,
  // which frees its slot at once. False: none was closed. `since`: takes a const Connection& and
  // returns its Since.
  template <class Since>
  bool end_longest(const Since& since, std::size_t most = 0) const {
    std::size_t count = 0;
    std::shared_ptr<Connection> longest;
    for (const auto& [id, entry] : live_) {
      auto connection = entry.connection.lock();
      const Connection::Since time = connection ? std::invoke(since, *connection) : std::nullopt;
      if (!time) continue;
      ++count;
      if (!longest || *time < *std::invoke(since, *longest)) longest = std::move(connection);
    }
    if (count <= most) return false;
    longest->abort();
    return true;
  }

  // If more than `most` handshakes are in progress, closes one: of unknown addresses if there are
  // any, the oldest of the address with the most handshakes.
  bool end_handshake(std::size_t most) const {
    struct Held {
      std::size_t count = 0;
      std::shared_ptr<Connection> oldest;
    };
    std::size_t total = 0;
    each([&](const Connection& one) { total += one.handshaking_since() ? 1U : 0U; });
    if (total <= most) return false;
    std::map<std::pair<bool, std::string_view>, Held> held;
    for (const auto& [id, entry] : live_) {
      auto one = entry.connection.lock();
      if (!one || !one->handshaking_since()) continue;
      Held& of = held[{one->is_known(), one->address()}];
      ++of.count;
      if (!of.oldest || one->handshaking_since() < of.oldest->handshaking_since()) {
        of.oldest = std::move(one);
      }
    }
    const bool known = held.begin()->first.first;
    const auto most_of = std::max_element(held.begin(), held.end(), [&](auto& a, auto& b) {
      const auto rank = [&](auto& of) {
        return std::pair(of.first.first == known, of.second.count);
      };
      if (rank(a) != rank(b)) return rank(a) < rank(b);
      return a.second.oldest->handshaking_since() > b.second.oldest->handshaking_since();
    });
    most_of->second.oldest->abort();
    return true;
  }

 private:
  struct Entry {
    std::weak_ptr<Connection> connection;
    bool stream = false;
    bool late = false;
  };

  std::map<std::uint64_t, Entry> live_;
  std::size_t streams_ = 0;
  std::size_t waited_for_ = 0;
  std::uint64_t ids_ = 0;
  std::function<void()> empty_;
};

}  // namespace windsplat::transport
