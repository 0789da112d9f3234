// The daemon's network side in this process, with one small dataset, and a peer over loopback.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

namespace fuzz {

// A connection to the one server of this process, which is started by the first of them.
class Peer {
 public:
  Peer();
  ~Peer();  // resets what is still open, so that no port is held
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  // Sends what it can of `bytes` and hears meanwhile, until the server ends the connection, `done`
  // says that all was heard, or nothing moved for `patience`.
  void talk(std::string_view bytes, std::chrono::milliseconds patience,
            const std::function<bool(const std::string& heard)>& done);
  // Tells that nothing more comes.
  void half_close();
  void forget() { heard_.clear(); }
  [[nodiscard]] const std::string& heard() const { return heard_; }
  [[nodiscard]] bool ended() const { return ended_; }  // by the server

 private:
  int socket_ = -1;
  std::string heard_;
  bool ended_ = false;
};

// What a server says to any bytes: answers one after the other, each well-formed and none of them
// a fault of its own (500). `whole`: the last one is not cut off. Returns their number.
std::size_t expect_answers(std::string_view heard, bool whole);

// Says how long the server takes to tell that it lives; it must.
void expect_alive();

}  // namespace fuzz
