// A volume or the slice of it -> some of its values, from which defaults are derived.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

#include "server/data/model/volume.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

inline constexpr std::size_t some_samples_max = std::size_t{1} << 15U;

// Indices of the samples that are shown.
class SampleOrder {
 public:
  SampleOrder(const std::array<int, 3>& dims, const std::optional<Slice>& slice) {
    for (const int length : dims) all_ *= static_cast<std::size_t>(length);
    if (!slice) return;
    const auto axis = static_cast<std::size_t>(slice->axis);
    length_ = static_cast<std::size_t>(dims.at(axis));
    for (std::size_t a = 0; a < axis; ++a) stride_ *= static_cast<std::size_t>(dims[a]);
    sample_ = static_cast<std::size_t>(slice->sample);
  }
  [[nodiscard]] std::size_t count() const { return all_ / length_; }
  [[nodiscard]] std::size_t operator[](std::size_t n) const {
    return (n / stride_ * length_ + sample_) * stride_ + n % stride_;
  }

 private:
  std::size_t all_ = 1;
  std::size_t length_ = 1;  // length of the axis normal to the slice
  std::size_t stride_ = 1;
  std::size_t sample_ = 0;
};

// Calls body(index, value) for at most 2^15 unmasked samples spread evenly over the volume or over
// its slice; the value of a vector is its magnitude.
template <class Body>
void for_some_samples(const data::Volume& volume, const std::optional<Slice>& slice,
                      const Body& body) {
  const SampleOrder order(volume.dims, slice);
  const std::size_t samples = order.count();
  const std::size_t count = std::min(samples, some_samples_max);
  for (std::size_t n = 0; n < count; ++n) {
    // Golden-ratio steps avoid aliasing with periods of the lattice.
    const double turn = static_cast<double>(n) * 0.6180339887498949;
    const double share = turn - std::floor(turn);
    const std::size_t at =
        order[samples <= some_samples_max
                  ? n
                  : std::min(samples - 1,
                             static_cast<std::size_t>(share * static_cast<double>(samples)))];
    double value = static_cast<double>(volume.component(0)[at]);
    if (volume.components > 1) {
      const double v = static_cast<double>(volume.component(1)[at]);
      const double w = volume.components > 2 ? static_cast<double>(volume.component(2)[at]) : 0.0;
      value = std::hypot(value, v, w);
    }
    if (std::isfinite(value)) body(at, value);
  }
}

}  // namespace windsplat::scene
