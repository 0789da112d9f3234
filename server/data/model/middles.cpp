#include "server/data/model/middles.hpp"

namespace windsplat::data {

Volume middles(const Volume& all, int stride, const Box& kernels) {
  Volume out;
  out.dims = kernels.count;
  out.components = all.components;
  out.values = Samples(kernels.samples() * static_cast<std::size_t>(all.components));
  const auto sample = [&](std::size_t a, int n) {
    return static_cast<std::size_t>(
        strided_sample(kernels.first.at(a) + n, stride, all.dims.at(a)));
  };
  const auto width = static_cast<std::size_t>(all.dims[0]);
  const auto height = static_cast<std::size_t>(all.dims[1]);
  float* to = out.values.data();
  for (int c = 0; c < all.components; ++c) {
    for (int k = 0; k < kernels.count[2]; ++k) {
      for (int j = 0; j < kernels.count[1]; ++j) {
        const float* const row = all.component(c) + (sample(2, k) * height + sample(1, j)) * width;
        for (int i = 0; i < kernels.count[0]; ++i) *to++ = row[sample(0, i)];
      }
    }
  }
  finish_volume(out);
  return out;
}

}  // namespace windsplat::data
