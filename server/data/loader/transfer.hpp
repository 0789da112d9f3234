// Shared memory for volumes: created and sealed by the daemon, filled by the loader, copied by the
// daemon, and reused for the next volume.
#pragma once

#include <cstddef>

#include "server/base/error.hpp"
#include "server/data/files/descriptor.hpp"
#include "server/data/model/sample_buffer.hpp"

namespace windsplat::data::loader {

// A mapping of the whole memory of a descriptor.
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

// The transfer memory as seen by the daemon.
class Transfer {
 public:
  // Memory larger than this is never reused. Memory that is not reused serves one volume: unmapped
  // by the loader before it answers, freed while the volume is copied, and closed.
  static constexpr std::size_t kept_bytes_max = std::size_t{32} << 20;

  // Allocates memory for `floats` floats, sealed against resizing. Errors: out_of_memory.
  static Result<Transfer> make(std::size_t floats, bool kept);

  [[nodiscard]] int descriptor() const { return memory_.number(); }
  [[nodiscard]] std::size_t floats() const { return mapping_.floats(); }
  [[nodiscard]] bool is_kept() const { return kept_; }
  // As the loader may change them at any time.
  [[nodiscard]] const float* values() const { return mapping_.data(); }

  // Copies the first floats, so that later writes by a loader have no effect. Memory that is not
  // reused is freed during the copy, so that a volume is never in memory twice.
  [[nodiscard]] Samples take(std::size_t floats);
  // Whether no process can write to it any more. False: there may be a writer.
  [[nodiscard]] bool close();

 private:
  Descriptor memory_;
  Mapping mapping_;
  bool kept_ = false;
};

}  // namespace windsplat::data::loader
