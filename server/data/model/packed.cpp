// Linear quantisation, component by component.
#include "server/data/model/packed.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace windsplat::data {

namespace {

constexpr std::uint16_t masked_code = 65535;
constexpr double top_code = 65534;

constexpr float extreme = std::numeric_limits<float>::max() / 4;

std::optional<PackedVolume::Component> scale_of(const float* values, std::size_t count) {
  float low = std::numeric_limits<float>::infinity();
  float high = -std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < count; ++i) {  // NaN compares false
    low = values[i] < low ? values[i] : low;
    high = values[i] > high ? values[i] : high;
  }
  if (low < -extreme || high > extreme) {
    return low > high ? std::optional(PackedVolume::Component{}) : std::nullopt;
  }
  return PackedVolume::Component{low, (high - low) / static_cast<float>(top_code)};
}

}  // namespace

float PackedVolume::error(int component) const {
  return 0.5F * scale.at(static_cast<std::size_t>(component)).step;
}

std::optional<PackedVolume> pack(const Volume& volume) {
  PackedVolume out;
  out.dims = volume.dims;
  out.components = volume.components;
  out.range = volume.range;
  out.masked = volume.masked;
  out.codes.resize(volume.values.size());
  const std::size_t samples = volume.samples();
  for (int c = 0; c < volume.components; ++c) {
    const float* from = volume.component(c);
    std::uint16_t* to = out.codes.data() + static_cast<std::size_t>(c) * samples;
    const auto scale = scale_of(from, samples);
    if (!scale) return std::nullopt;
    out.scale.at(static_cast<std::size_t>(c)) = *scale;
    const auto low = static_cast<double>(scale->low);
    const double inverse = scale->step > 0 ? 1 / static_cast<double>(scale->step) : 0;
    for (std::size_t i = 0; i < samples; ++i) {
      const double code = (static_cast<double>(from[i]) - low) * inverse + 0.5;
      to[i] = std::isnan(from[i])
                  ? masked_code
                  : static_cast<std::uint16_t>(std::min(top_code, std::floor(code)));
    }
  }
  return out;
}

Volume unpack(const PackedVolume& packed) {
  Volume out;
  out.dims = packed.dims;
  out.components = packed.components;
  out.range = packed.range;
  out.masked = packed.masked;
  out.values = Samples(packed.codes.size());
  const std::size_t samples = out.samples();
  for (int c = 0; c < packed.components; ++c) {
    const std::uint16_t* from = packed.codes.data() + static_cast<std::size_t>(c) * samples;
    float* to = out.values.data() + static_cast<std::size_t>(c) * samples;
    const auto [low, step] = packed.scale.at(static_cast<std::size_t>(c));
    for (std::size_t i = 0; i < samples; ++i) {
      const float value = low + step * static_cast<float>(from[i]);
      to[i] = from[i] == masked_code ? std::numeric_limits<float>::quiet_NaN() : value;
    }
  }
  return out;
}

}  // namespace windsplat::data
