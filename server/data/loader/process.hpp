// One loader process: started, talked to, ended. Never outlives its object, nor the daemon.
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

// What a loader finds under these numbers when it starts.
inline constexpr int socket_of_loader = 3;
inline constexpr int life_of_loader = 4;  // pipe whose other end closes when the daemon exits

class Process {
 public:
  Process() = default;
  ~Process() { reap(std::chrono::milliseconds(0)); }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  // Runs `program load` with an empty environment and nothing else that is open here. Errors:
  // internal.
  Result<void> start(const std::string& program);

  // Kills the process, from any thread; end() must still be called. No effect if there is none.
  void kill();
  // Waits a moment for one that is about to end, kills it otherwise; closes what belongs to it. How
  // it ended: "was ended by signal 11", "ended with code 1"; empty if there was none.
  std::string end(std::chrono::milliseconds patience = std::chrono::milliseconds(0));
  // What it has used, and its memory that no file or other process has; 0 if there is none.
  [[nodiscard]] std::chrono::nanoseconds cpu_time() const;
  [[nodiscard]] std::uint64_t private_bytes() const;
  // From now on at most that many seconds of processor time.
  void allow_cpu(std::chrono::seconds more);
  // Raises the private memory limit, at most to the one set by confinement.
  void allow_memory(std::uint64_t bytes);

  // Started, and not known to have exited.
  [[nodiscard]] bool runs() const;
  [[nodiscard]] int socket() const { return socket_.number(); }
  [[nodiscard]] pid_t id() const;  // -1 if there is none

 private:
  // The same without words, for which there may be no memory: its status, as of waitpid.
  std::optional<int> reap(std::chrono::milliseconds patience) noexcept;

  mutable std::mutex mutex_;  // of id_: a number is signalled only before it is waited for
  pid_t id_ = -1;
  Descriptor socket_;
  Descriptor life_;
};

}  // namespace windsplat::data::loader
