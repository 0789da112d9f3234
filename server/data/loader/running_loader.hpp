// A loader as the daemon runs it: its process, the files that it may open, its memory in the limit,
// and one call at a time.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/data/loader/channel.hpp"
#include "server/data/loader/loader.hpp"
#include "server/data/loader/messages.hpp"
#include "server/data/loader/process.hpp"

namespace windsplat::data::loader {

// The executable of loaders (set_program()); empty: none is set.
std::string program_path();

class RunningLoader {
 public:
  // One call to the loader.
  struct Call {
    Kind kind = Kind::open;
    std::string payload;
    int descriptor = -1;
    Kind answer = Kind::opened;
    std::string doing;  // "opening it", "reading 'u'"
    std::chrono::milliseconds time{};
    // Takes the part of a volume that a message describes. False: it violates the protocol.
    std::function<bool(const std::string& payload)> take{};
  };

  RunningLoader(Location location, const Limits& limits);

  // Starts a loader, which opens the dataset; returns the encoded info.
  Result<std::string> open();
  // Serves the loader's requests until it answers. Any other event ends the loader and is an error.
  Result<Message> call(const Call& what);
  // Private memory of the loader counts towards the memory limit.
  Result<void> count_memory();
  void release();
  void on_progress(Progress progress) { progress_ = std::move(progress); }

  [[nodiscard]] bool is_released() const { return files_ == nullptr; }
  [[nodiscard]] Process& process() { return process_; }
  // Total size of the files read to open the dataset.
  [[nodiscard]] std::uint64_t opened_bytes() const { return opened_bytes_; }
  [[nodiscard]] const std::vector<Companion>& companions() const { return companions_; }

 private:
  struct Patience;
  [[nodiscard]] Deadline next_deadline(const Patience& patience) const;
  Result<Fate> wait(Patience& patience);
  Fate hear_progress(const std::string& payload) const;
  Fate hear_part(const std::string& payload, const Call& what, const Patience& patience);
  Fate answer(const Message& question, Kind during, Patience& patience);
  Error crowded_out(const Error& error, const Call& what);
  Error ended(Fate fate, const Call& what, const Patience& patience);
  [[nodiscard]] std::string loader_text() const;

  const Location location_;
  const Limits& limits_;
  Progress progress_;
  std::shared_ptr<Files> files_;  // set while a loader runs
  Process process_;
  Reservation memory_;
  std::uint64_t opened_bytes_ = 0;
  std::vector<Companion> companions_;
};

}  // namespace windsplat::data::loader
