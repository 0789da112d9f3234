// One field at one step, and the last pass over its samples.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "server/data/model/sample_buffer.hpp"

namespace windsplat::data {

// One field at one step. Samples are x fastest, then y, then z; a vector's components follow each
// other as whole arrays. A masked sample is NaN (in a vector: in every component).
struct Volume {
  std::array<int, 3> dims{};
  int components = 1;  // 1 scalar, 2 a horizontal vector whose third component is zero, 3
  Samples values;
  std::array<float, 2> range{0, 0};  // of the values, or of a vector's magnitude; unmasked only
  std::int64_t masked = 0;

  [[nodiscard]] std::size_t samples() const {
    return static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]) *
           static_cast<std::size_t>(dims[2]);
  }
  [[nodiscard]] const float* component(int c) const {
    return values.data() + static_cast<std::size_t>(c) * samples();
  }
  [[nodiscard]] std::size_t bytes() const { return values.size() * sizeof(float); }
};

// Counts masked samples, makes a vector's mask common to its components, sets range. Readers and
// samples call it last. Infinite values are masked too.
void finish_volume(Volume& volume);
// The two halves of it. Makes what is not finite NaN in all components; `values` as in Volume.
void mask_volume(float* values, std::size_t samples, int components);
// Sets range and masked. False if values are infinite, or NaN in some components only.
[[nodiscard]] bool measure_volume(Volume& volume);

// |V| of a sample in double, where the square of no float overflows; clamped to what a float can
// say.
float magnitude(const float* const* components, int count, std::size_t sample);

}  // namespace windsplat::data
