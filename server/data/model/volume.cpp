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
constexpr double infinite = std::numeric_limits<double>::infinity();

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

// Range and number of masked samples of a part of a volume. Compares the values of a scalar, or the
// squared lengths of a vector.
struct Measured {
  double low = infinite;
  double high = -infinite;
  std::int64_t masked = 0;
  bool sound = true;  // every sample is finite, or NaN in all components

  void add(const Volume& volume, std::size_t from, std::size_t to) {
    const auto count = static_cast<std::size_t>(volume.components);
    std::array<double, samples_at_once> compared{};
    bool all_finite = true;
    for (std::size_t c = 0; c < count; ++c) {
      const float* values = volume.component(static_cast<int>(c)) + from;
      all_finite = all_finite && are_finite(values, to - from);
      for (std::size_t i = 0; i < to - from; ++i) {
        const auto value = static_cast<double>(values[i]);
        compared[i] = count == 1 ? value : compared[i] + value * value;
      }
    }
    if (all_finite) {
      extend(compared.data(), to - from);
    } else {
      add_one_by_one(volume, from, to, compared.data());
    }
  }

 private:
  void extend(const double* compared, std::size_t count) {
    std::array<double, lanes> lows{};
    std::array<double, lanes> highs{};
    lows.fill(low);
    highs.fill(high);
    std::size_t i = 0;
    for (; i + lanes <= count; i += lanes) {
      for (std::size_t l = 0; l < lanes; ++l) {
        lows[l] = compared[i + l] < lows[l] ? compared[i + l] : lows[l];
        highs[l] = compared[i + l] > highs[l] ? compared[i + l] : highs[l];
      }
    }
    low = *std::min_element(lows.begin(), lows.end());
    high = *std::max_element(highs.begin(), highs.end());
    for (; i < count; ++i) {
      low = std::min(low, compared[i]);
      high = std::max(high, compared[i]);
    }
  }

  void add_one_by_one(const Volume& volume, std::size_t from, std::size_t to,
                      const double* compared) {
    for (std::size_t i = from; i < to; ++i) {
      int finite = 0;
      int missing = 0;
      for (int c = 0; c < volume.components; ++c) {
        const float value = volume.component(c)[i];
        finite += std::isfinite(value) ? 1 : 0;
        missing += std::isnan(value) ? 1 : 0;
      }
      if (finite == volume.components) {
        extend(compared + (i - from), 1);
      } else {
        ++masked;
        sound = sound && missing == volume.components;
      }
    }
  }
};

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
  const auto count = static_cast<std::size_t>(components);
  for (std::size_t from = 0; from < samples; from += samples_at_once) {
    const std::size_t to = std::min(samples, from + samples_at_once);
    bool all_finite = true;
    for (std::size_t c = 0; c < count; ++c) {
      all_finite = all_finite && are_finite(values + c * samples + from, to - from);
    }
    for (std::size_t i = from; i < to && !all_finite; ++i) {
      bool finite = true;
      for (std::size_t c = 0; c < count; ++c) {
        finite = finite && std::isfinite(values[c * samples + i]);
      }
      for (std::size_t c = 0; c < count && !finite; ++c) values[c * samples + i] = masked_value;
    }
  }
}

bool measure_volume(Volume& volume) {
  const std::size_t samples = volume.samples();
  WINDSPLAT_CHECK(volume.components >= 1 && volume.components <= 3);
  WINDSPLAT_CHECK(volume.values.size() == samples * static_cast<std::size_t>(volume.components));

  Measured all;
  for (std::size_t from = 0; from < samples; from += samples_at_once) {
    all.add(volume, from, std::min(samples, from + samples_at_once));
  }
  volume.masked = all.masked;
  volume.range = {0, 0};
  if (all.low <= all.high) {
    const bool scalar = volume.components == 1;
    volume.range[0] = scalar ? static_cast<float>(all.low) : length_of(all.low);
    volume.range[1] = scalar ? static_cast<float>(all.high) : length_of(all.high);
  }
  return all.sound;
}

void finish_volume(Volume& volume) {
  WINDSPLAT_CHECK(volume.values.size() ==
                  volume.samples() * static_cast<std::size_t>(volume.components));
  mask_volume(volume.values.data(), volume.samples(), volume.components);
  const bool sound = measure_volume(volume);
  WINDSPLAT_CHECK(sound);
}

}  // namespace windsplat::data
