// The network side of the daemon in this process, with one small dataset, and a loopback client.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

namespace fuzz {

// A connection to the single server of this process, which is started by the first connection.
class Peer {
 public:
  Peer();
  ~Peer();  // resets an open connection, so that no port is held
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  // Sends `bytes` as far as possible while reading, until the server closes, `done` returns true,
  // or nothing moved for `patience`.
  void talk(std::string_view bytes, std::chrono::milliseconds patience,
            const std::function<bool(const std::string& heard)>& done);
  // Shuts down the sending side.
  void half_close();
  void forget() { heard_.clear(); }
  [[nodiscard]] const std::string& heard() const { return heard_; }
  [[nodiscard]] bool ended() const { return ended_; }  // by the server

 private:
  int socket_ = -1;
  std::string heard_;
  bool ended_ = false;
};

// Checks the responses to any bytes: each is well-formed and none is a server error (500). `whole`:
// the last one is complete. Returns their number.
std::size_t expect_answers(std::string_view heard, bool whole);

// Time until the server answers a health check, which it must.
void expect_alive();

}  // namespace fuzz
