// The service manager that started the daemon: its socket, and what it is told (sd_listen_fds(3),
// sd_notify(3), sd_watchdog_enabled(3)). Without libsystemd, whose part of these protocols is an
// environment variable each.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "server/base/error.hpp"

namespace windsplat::cli {

struct PassedSocket {
  int descriptor = -1;  // a listening TCP or UNIX socket, closed on exec
  std::string address;  // as of --listen: "127.0.0.1:8080", "[::1]:8080", "unix:/run/w.sock"
};

class ServiceManager {
 public:
  // Reads the variables and removes them from the environment: call it before threads start.
  // Variables meant for another process are ignored. Errors: invalid, if other than one listening
  // socket of TCP, or of a UNIX path, was passed.
  static Result<std::shared_ptr<const ServiceManager>> from_environment();
  ~ServiceManager();
  ServiceManager(const ServiceManager&) = delete;
  ServiceManager& operator=(const ServiceManager&) = delete;

  [[nodiscard]] const std::optional<PassedSocket>& socket() const { return socket_; }
  // How often to call alive(): half of the time after which the manager ends the daemon. Zero:
  // never.
  [[nodiscard]] std::chrono::milliseconds alive_every() const { return alive_every_; }

  // No effect without a manager that listens. They may be called from any thread.
  void ready(std::string_view status) const;
  void reloading() const;  // until ready() is called again
  void stopping() const;
  void alive() const;

 private:
  ServiceManager() = default;
  void tell(const std::string& text, int flags) const;

  std::optional<PassedSocket> socket_;
  std::chrono::milliseconds alive_every_{0};
  int told_ = -1;  // connected to the manager; -1: none
};

}  // namespace windsplat::cli
