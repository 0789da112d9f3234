// One loader process: start, communication, end. It outlives neither this object nor the daemon.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

#include "server/base/error.hpp"
#include "server/data/files/descriptor.hpp"

namespace windsplat::data::loader {

// Numbers of the descriptors that a loader has at its start.
inline constexpr int socket_of_loader = 3;
inline constexpr int life_of_loader = 4;  // pipe whose other end closes when the daemon exits

class Process {
 public:
  Process() = default;
  ~Process() { reap(std::chrono::milliseconds(0)); }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  // Runs `program load` with an empty environment and no other open descriptors. Errors: internal.
  Result<void> start(const std::string& program);

  // Kills the process, from any thread; end() must still be called. No effect if there is none.
  void kill();
  // Waits briefly for a process that is about to exit, kills it otherwise; closes its resources.
  // Returns the cause: "was terminated by signal 11", "ended with code 1"; empty if there was none.
  std::string end(std::chrono::milliseconds patience = std::chrono::milliseconds(0));
  // Processor time used, and private memory; 0 if there is no process.
  [[nodiscard]] std::chrono::nanoseconds cpu_time() const;
  [[nodiscard]] std::uint64_t private_bytes() const;
  // Limits further processor time to that many seconds.
  void allow_cpu(std::chrono::seconds more);
  // Raises the private memory limit, up to that of confinement.
  void allow_memory(std::uint64_t bytes);

  // Started, and not known to have ended.
  [[nodiscard]] bool runs() const;
  [[nodiscard]] int socket() const { return socket_.number(); }
  [[nodiscard]] pid_t id() const;  // -1 if there is none

 private:
  // The same without allocation: the status as waitpid returns it.
  std::optional<int> reap(std::chrono::milliseconds patience) noexcept;

  mutable std::mutex mutex_;  // protects id_: signals must not be sent after the process is reaped
  pid_t id_ = -1;
  Descriptor socket_;
  Descriptor life_;
};

}  // namespace windsplat::data::loader
