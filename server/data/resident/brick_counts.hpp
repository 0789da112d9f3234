// Counts of bricks: chunks of stores with levels, of which samples were wanted.
#pragma once

#include <atomic>
#include <cstdint>

namespace windsplat::data {

struct BrickCounts {
  std::uint64_t resident = 0;    // had in memory
  std::uint64_t read = 0;        // read from the store
  std::uint64_t bytes_read = 0;  // of their samples that were wanted, in memory
  std::uint64_t waiting = 0;     // now: of reads in work, and of those that wait for the reader
};

// Thread-safe, without locks.
class BrickMeter {
 public:
  void had(std::uint64_t bricks) { resident_ += bricks; }
  void wait_for(std::uint64_t bricks) { waiting_ += bricks; }
  // bytes: zero if the read failed.
  void end_wait(std::uint64_t bricks, std::uint64_t bytes) {
    waiting_ -= bricks;
    if (bytes == 0) return;
    read_ += bricks;
    bytes_read_ += bytes;
  }
  [[nodiscard]] BrickCounts counts() const { return {resident_, read_, bytes_read_, waiting_}; }

 private:
  std::atomic<std::uint64_t> resident_{0};
  std::atomic<std::uint64_t> read_{0};
  std::atomic<std::uint64_t> bytes_read_{0};
  std::atomic<std::uint64_t> waiting_{0};
};

}  // namespace windsplat::data
