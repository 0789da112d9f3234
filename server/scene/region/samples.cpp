#include "server/scene/region/samples.hpp"

#include <cstddef>
#include <limits>

#include "server/base/check.hpp"

namespace windsplat::scene {

namespace {

constexpr float left_out_value = std::numeric_limits<float>::quiet_NaN();

}  // namespace

data::Volume cropped(const data::Volume& volume, const Crop& crop) {
  data::Volume out;
  out.dims = crop.count;
  out.components = volume.components;
  out.values = data::Samples(crop.samples() * static_cast<std::size_t>(volume.components));
  const auto width = static_cast<std::size_t>(volume.dims[0]);
  const auto rows = static_cast<std::size_t>(volume.dims[1]);
  const auto columns = static_cast<std::size_t>(crop.count[0]);
  float* to = out.values.data();
  for (int c = 0; c < volume.components; ++c) {
    for (int k = 0; k < crop.count[2]; ++k) {
      for (int j = 0; j < crop.count[1]; ++j) {
        const std::size_t layer = static_cast<std::size_t>(crop.first[2] + k) * rows;
        const float* const from =
            volume.component(c) + (layer + static_cast<std::size_t>(crop.first[1] + j)) * width;
        const unsigned char* const kept =
            crop.columns ? crop.columns->data() + static_cast<std::size_t>(j) * columns : nullptr;
        for (int i = 0; i < crop.count[0]; ++i) {
          const bool there = kept == nullptr || kept[i] != 0;
          *to++ = there ? from[crop.x_of(i)] : left_out_value;
        }
      }
    }
  }
  data::finish_volume(out);
  return out;
}

data::Volume masked_by(const data::Volume& volume, const data::Volume& scalar,
                       const std::array<double, 2>& range) {
  WINDSPLAT_CHECK(volume.dims == scalar.dims && scalar.components == 1);
  const std::size_t samples = volume.samples();
  data::Volume out;
  out.dims = volume.dims;
  out.components = volume.components;
  out.values = data::Samples(samples * static_cast<std::size_t>(volume.components));
  for (std::size_t n = 0; n < samples; ++n) {
    const auto value = static_cast<double>(scalar.values[n]);
    const bool there = value >= range[0] && value <= range[1];  // false for NaN
    for (int c = 0; c < volume.components; ++c) {
      out.values[static_cast<std::size_t>(c) * samples + n] =
          there ? volume.component(c)[n] : left_out_value;
    }
  }
  data::finish_volume(out);
  return out;
}

}  // namespace windsplat::scene
