// The memory in which a loader hands over a volume: sized and sealed here, filled there, copied out
// here, and used again for the next volume.
#pragma once

#include <cstddef>

#include "server/base/error.hpp"
#include "server/data/files/descriptor.hpp"
#include "server/data/model/sample_buffer.hpp"

namespace windsplat::data::loader {

// A descriptor's memory, mapped whole.
class Mapping {
 public:
  Mapping() = default;
  // Errors: out_of_memory.
  static Result<Mapping> of(const Descriptor& memory, bool writable);
  Mapping(Mapping&& other) noexcept;
  Mapping& operator=(Mapping&& other) noexcept;
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;
  ~Mapping();

  [[nodiscard]] float* data() const { return data_; }  // null if there is none
  [[nodiscard]] std::size_t floats() const { return floats_; }
  [[nodiscard]] std::size_t bytes() const { return floats_ * sizeof(float); }

 private:
  float* data_ = nullptr;
  std::size_t floats_ = 0;
};

// The daemon's side of it.
class Transfer {
 public:
  // Memory that is larger is never kept. What is not kept is for one volume: unmapped by the loader
  // before it says so, given back as the volume is copied out of it, and closed.
  static constexpr std::size_t kept_bytes_max = std::size_t{32} << 20;

  // Room for so many floats, whose size nobody can change. Errors: out_of_memory.
  static Result<Transfer> make(std::size_t floats, bool kept);

  [[nodiscard]] int descriptor() const { return memory_.number(); }
  [[nodiscard]] std::size_t floats() const { return mapping_.floats(); }
  [[nodiscard]] bool is_kept() const { return kept_; }

  // What the first floats are now: whatever a loader does to them later is of no matter. Memory
  // that is not kept is given back as it is copied, so that a volume is not there twice.
  [[nodiscard]] Samples take(std::size_t floats);
  // No process can write to it any more. False: a writer may remain.
  [[nodiscard]] bool close();

 private:
  Descriptor memory_;
  Mapping mapping_;
  bool kept_ = false;
};

}  // namespace windsplat::data::loader
