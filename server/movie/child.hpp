// Another program that reads a stream of bytes: started without a shell, fed with backpressure,
// killed and reaped in every case. A process that died leaves an error, not a signal.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/data/files/descriptor.hpp"

namespace windsplat::movie {

// The number that Child::start() gives an open file, which the program opens as /dev/fd/3.
inline constexpr int file_of_child = 3;

class Child {
 public:
  // What messages() returns: the last 4 KiB of standard error, or the last MiB of both outputs.
  enum class Keeps { errors, all };

  // Starts a program, an absolute path. It gets a stream as standard input, `file` (-1: none) as
  // descriptor 3, and no other descriptors, an environment of LC_ALL and LD_LIBRARY_PATH alone, and
  // a process group of its own, so that Ctrl-C in a terminal does not reach it. A program that for
  // `patience` reads nothing, or does not end, is terminated: write() or finish() fail. Errors:
  // internal.
  static Result<Child> start(const std::string& program, std::vector<std::string> arguments,
                             int file, Keeps keeps = Keeps::errors,
                             std::chrono::milliseconds patience = std::chrono::minutes(5));

  Child(Child&& other) noexcept;
  Child& operator=(Child&& other) = delete;
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child();  // kills it

  // Writes all bytes, waiting while the program does not read. Errors: internal with the program's
  // message if it ended, or out_of_memory if that says that the disk is full; cancelled.
  Result<void> write(std::span<const std::uint8_t> bytes, const CancelToken& cancel);

  // Ends its input and waits for its end. Errors: internal if it fails, with its message;
  // cancelled.
  Result<void> finish(const CancelToken& cancel);

  [[nodiscard]] const std::string& messages() const { return messages_; }

 private:
  Child() = default;
  void read_messages();
  void kill_and_reap() noexcept;
  // Waits up to 50 ms for messages, and with `to_write` for room in the input. The time waited: not
  // longer, if this process was stopped meanwhile.
  std::chrono::steady_clock::duration wait(bool to_write);
  // Waits for its end. Errors: cancelled.
  Result<int> status(const CancelToken& cancel);
  [[nodiscard]] Error failed(int status) const;
  [[nodiscard]] Error stalled(const char* how) const;

  std::string name_;  // of the program, without its folder
  pid_t id_ = -1;     // -1: reaped
  data::Descriptor input_;
  data::Descriptor errors_;
  std::string messages_;
  std::size_t messages_bytes_max_ = 0;
  std::chrono::milliseconds patience_{0};
};

}  // namespace windsplat::movie
