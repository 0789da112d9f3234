// Every connection that lives, so that a drain reaches them all. Used by the io thread alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <utility>
#include <vector>

namespace windsplat::net {

class Connection {
 public:
  virtual ~Connection() = default;
  virtual void drain() = 0;  // end as soon as what is being answered is answered
  virtual void abort() = 0;  // end now
};

class Connections {
 public:
  // Told whenever the last one has gone.
  void on_empty(std::function<void()> call) { empty_ = std::move(call); }

  std::uint64_t next_id() { return ++ids_; }
  void add(std::uint64_t id, std::weak_ptr<Connection> connection, bool stream) {
    live_[id] = {std::move(connection), stream};
    streams_ += stream ? 1U : 0U;
  }
  void remove(std::uint64_t id) {
    const auto found = live_.find(id);
    if (found == live_.end()) return;
    streams_ -= found->second.stream ? 1U : 0U;
    live_.erase(found);
    if (live_.empty() && empty_) empty_();
  }

  [[nodiscard]] std::size_t size() const { return live_.size(); }
  [[nodiscard]] std::size_t streams() const { return streams_; }

  // A copy: a connection may go while the others are told.
  [[nodiscard]] std::vector<std::shared_ptr<Connection>> all() const {
    std::vector<std::shared_ptr<Connection>> out;
    for (const auto& [id, entry] : live_) {
      if (auto connection = entry.connection.lock()) out.push_back(std::move(connection));
    }
    return out;
  }

 private:
  struct Entry {
    std::weak_ptr<Connection> connection;
    bool stream = false;
  };

  std::map<std::uint64_t, Entry> live_;
  std::size_t streams_ = 0;
  std::uint64_t ids_ = 0;
  std::function<void()> empty_;
};

}  // namespace windsplat::net
