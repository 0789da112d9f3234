// The last pass over a volume: mask, range and number of masked samples.
#include "server/data/model/volume.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "server/base/check.hpp"

namespace windsplat::data {

namespace {

constexpr float masked_value = std::numeric_limits<float>::quiet_NaN();

// Number of samples tested for finiteness together; if one is not finite, the block is repeated
// value by value.
constexpr std::size_t samples_at_once = 1024;
// As many numbers as a compiler can keep in vector lanes, each with its own partial result.
constexpr std::size_t lanes = 16;

bool are_finite(const float* values, std::size_t count) {
  std::array<float, lanes> zeros{};  // 0 * x is 0 unless x is not finite
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    for (std::size_t l = 0; l < lanes; ++l) zeros[l] += 0.0F * values[i + l];
  }
  for (; i < count; ++i) zeros[0] += 0.0F * values[i];
  return std::all_of(zeros.begin(), zeros.end(), [](float zero) { return zero == 0; });
}

// The length of a vector from its squared length, which does not overflow in double.
float length_of(double square) {
  return static_cast<float>(
      std::min(std::sqrt(square), static_cast<double>(std::numeric_limits<float>::max())));
}

// Extends a range by numbers that are finite.
template <class T>
void extend(const T* values, std::size_t count, double& low, double& high) {
  std::array<T, lanes> lows{};
  std::array<T, lanes> highs{};
  lows.fill(values[0]);
  highs.fill(values[0]);
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    for (std::size_t l = 0; l < lanes; ++l) {
      lows[l] = values[i + l] < lows[l] ? values[i + l] : lows[l];
      highs[l] = values[i + l] > highs[l] ? values[i + l] : highs[l];
    }
  }
  low = std::min(low, static_cast<double>(*std::min_element(lows.begin(), lows.end())));
  high = std::max(high, static_cast<double>(*std::max_element(highs.begin(), highs.end())));
  for (; i < count; ++i) {
    low = std::min(low, static_cast<double>(values[i]));
    high = std::max(high, static_cast<double>(values[i]));
  }
}

// As mask_volume(), for components that begin `stride` floats apart.
void mask_components(float* values, std::size_t stride, std::size_t samples, int components) {
  const auto count = static_cast<std::size_t>(components);
  for (std::size_t from = 0; from < samples; from += samples_at_once) {
    const std::size_t to = std::min(samples, from + samples_at_once);
    bool all_finite = true;
    for (std::size_t c = 0; c < count; ++c) {
      all_finite = all_finite && are_finite(values + c * stride + from, to - from);
    }
    for (std::size_t i = from; i < to && !all_finite; ++i) {
      bool finite = true;
      for (std::size_t c = 0; c < count; ++c) {
        finite = finite && std::isfinite(values[c * stride + i]);
      }
      for (std::size_t c = 0; c < count && !finite; ++c) values[c * stride + i] = masked_value;
    }
  }
}

}  // namespace

float magnitude(const float* const* components, int count, std::size_t i) {
  double sum = 0;
  for (int c = 0; c < count; ++c) {
    const auto v = static_cast<double>(components[c][i]);
    sum += v * v;
  }
  return length_of(sum);
}

void mask_volume(float* values, std::size_t samples, int components) {
  mask_components(values, samples, samples, components);
}

void mask_samples(Volume& volume, std::size_t from, std::size_t to) {
  mask_components(volume.values.data() + from, volume.samples(), to - from, volume.components);
}

void VolumeMeasure::add(const Volume& volume, std::size_t from, std::size_t to) {
  for (; from < to; from += std::min(samples_at_once, to - from)) {
    add_block(volume, from, std::min(to, from + samples_at_once));
  }
}

void VolumeMeasure::add_block(const Volume& volume, std::size_t from, std::size_t to) {
  bool all_finite = true;
  for (int c = 0; c < volume.components; ++c) {
    all_finite = all_finite && are_finite(volume.component(c) + from, to - from);
  }
  if (!all_finite) {
    add_one_by_one(volume, from, to);
  } else if (volume.components == 1) {
    extend(volume.component(0) + from, to - from, low_, high_);
  } else {
    add_vectors(volume, from, to);
  }
}

void VolumeMeasure::add_vectors(const Volume& volume, std::size_t from, std::size_t to) {
  std::array<double, samples_at_once> squares{};
  for (int c = 0; c < volume.components; ++c) {
    const float* values = volume.component(c) + from;
    for (std::size_t i = 0; i < to - from; ++i) {
      const auto value = static_cast<double>(values[i]);
      squares[i] += value * value;
    }
  }
  extend(squares.data(), to - from, low_, high_);
}

void VolumeMeasure::add_one_by_one(const Volume& volume, std::size_t from, std::size_t to) {
  for (std::size_t i = from; i < to; ++i) {
    int finite = 0;
    int missing = 0;
    double compared = 0;
    for (int c = 0; c < volume.components; ++c) {
      const float value = volume.component(c)[i];
      finite += std::isfinite(value) ? 1 : 0;
      missing += std::isnan(value) ? 1 : 0;
      const auto wide = static_cast<double>(value);
      compared = volume.components == 1 ? wide : compared + wide * wide;
    }
    if (finite == volume.components) {
      extend(&compared, 1, low_, high_);
    } else {
      ++masked_;
      sound_ = sound_ && missing == volume.components;
    }
  }
}

bool VolumeMeasure::finish(Volume& volume) const {
  volume.masked = masked_;
  volume.range = {0, 0};
  if (low_ <= high_) {
    const bool scalar = volume.components == 1;
    volume.range[0] = scalar ? static_cast<float>(low_) : length_of(low_);
    volume.range[1] = scalar ? static_cast<float>(high_) : length_of(high_);
    for (float& bound : volume.range) bound += 0.0F;  // -0 becomes 0, in any order of samples
  }
  return sound_;
}

bool measure_volume(Volume& volume) {
  WINDSPLAT_CHECK(volume.components >= 1 && volume.components <= 3);
  WINDSPLAT_CHECK(volume.values.size() ==
                  volume.samples() * static_cast<std::size_t>(volume.components));
  VolumeMeasure all;
  all.add(volume, 0, volume.samples());
  return all.finish(volume);
}

void finish_volume(Volume& volume) {
  WINDSPLAT_CHECK(volume.values.size() ==
                  volume.samples() * static_cast<std::size_t>(volume.components));
  mask_volume(volume.values.data(), volume.samples(), volume.components);
  const bool sound = measure_volume(volume);
  WINDSPLAT_CHECK(sound);
}

}  // namespace windsplat::data
