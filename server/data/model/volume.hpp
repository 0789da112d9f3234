// One field at one step, and the last pass over its samples.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "server/data/model/sample_buffer.hpp"

namespace windsplat::data {

// Components of a volume reduced to two values.
struct TwoValues {
  static constexpr int components = 4;
  static constexpr int low = 0;
  static constexpr int high = 1;
  // Of the volume of the group, of which masked samples have no part: the shares add up to 1 where
  // none is masked. All four components are NaN where all samples are.
  static constexpr int low_share = 2;
  static constexpr int high_share = 3;
};

// Of a volume that is only read as a whole.
inline constexpr std::size_t volume_bytes_max = std::size_t{16} << 30;

// One field at one step. Samples are x fastest, then y, then z; the components of a vector are
// consecutive arrays. A masked sample is NaN (for a vector: in every component).
struct Volume {
  std::array<int, 3> dims{};
  int components = 1;  // 1: scalar; 2: horizontal vector, whose third component is zero; 3: vector;
                       // 4: TwoValues of a scalar
  Samples values;
  std::array<float, 2> range{0, 0};  // range of the values, or of the magnitudes of vectors;
                                     // unmasked samples only
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

// Range and number of masked samples of a volume whose samples come in parts.
class VolumeMeasure {
 public:
  // Samples [from, to), each once.
  void add(const Volume& volume, std::size_t from, std::size_t to);
  // Sets range and masked. False if values are infinite, or NaN in some components only.
  [[nodiscard]] bool finish(Volume& volume) const;

 private:
  void add_block(const Volume& volume, std::size_t from, std::size_t to);
  void add_vectors(const Volume& volume, std::size_t from, std::size_t to);
  void add_one_by_one(const Volume& volume, std::size_t from, std::size_t to);

  // Of the values of a scalar, or the squared lengths of a vector.
  double low_ = std::numeric_limits<double>::infinity();
  double high_ = -std::numeric_limits<double>::infinity();
  std::int64_t masked_ = 0;
  bool sound_ = true;  // every sample is finite, or NaN in all components
};

// Counts masked samples, makes the mask of a vector common to its components, and sets the range.
// Readers and samples call it last. Infinite values are masked too.
void finish_volume(Volume& volume);
// The two parts of finish_volume(). The first sets samples that are not finite to NaN in all
// components; `values` as in Volume.
void mask_volume(float* values, std::size_t samples, int components);
// The same for samples [from, to) of a volume.
void mask_samples(Volume& volume, std::size_t from, std::size_t to);
// The second, as VolumeMeasure of the whole.
[[nodiscard]] bool measure_volume(Volume& volume);

// Magnitude of a sample, computed in double, where squares of floats cannot overflow; clamped to
// the range of float.
float magnitude(const float* const* components, int count, std::size_t sample);

}  // namespace windsplat::data
