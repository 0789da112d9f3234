// Weighted box averages. A row of the coarse volume first accumulates its fine rows at full width,
// so that inner loops access memory sequentially; then it is averaged along x.
#include "server/data/model/coarsen.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <utility>

#include "server/base/check.hpp"

namespace windsplat::data {

namespace {

struct Group {
  std::size_t first = 0;
  std::size_t count = 0;
};

Group group_at(std::size_t index, int halvings, int samples) {
  const std::size_t first = index << static_cast<unsigned>(halvings);
  const std::size_t size = std::size_t{1} << static_cast<unsigned>(halvings);
  return {first, std::min(size, static_cast<std::size_t>(samples) - first)};
}

// The weight of each sample within its group; normalised, so that weighted sums cannot overflow.
std::vector<float> shares(const std::vector<double>& widths, int samples, int halvings) {
  std::vector<float> out(static_cast<std::size_t>(samples), 1.0F);
  if (halvings == 0) return out;
  WINDSPLAT_CHECK(widths.size() == out.size());
  for (std::size_t i = 0; i < static_cast<std::size_t>(halved(samples, halvings)); ++i) {
    const Group group = group_at(i, halvings, samples);
    double total = 0;
    for (std::size_t n = 0; n < group.count; ++n) total += widths[group.first + n];
    WINDSPLAT_CHECK(total > 0);
    for (std::size_t n = 0; n < group.count; ++n) {
      out[group.first + n] = static_cast<float>(widths[group.first + n] / total);
    }
  }
  return out;
}

// sum += w v and weight += w where v is not masked.
void add_row(const float* row, std::size_t count, float w, float* sum, float* weight) {
  for (std::size_t i = 0; i < count; ++i) {
    const float v = row[i];
    const bool there = v == v;  // a masked sample is NaN
    sum[i] += there ? w * v : 0.0F;
    weight[i] += there ? w : 0.0F;
  }
}

class Coarsener {
 public:
  Coarsener(const Volume& fine, const Coarsening& how) : fine_(fine), halvings_(how.halvings) {
    for (std::size_t a = 0; a < 3; ++a) {
      weights_[a] = shares(how.widths[a], fine.dims[a], halvings_[a]);
      coarse_.dims[a] = halved(fine.dims[a], halvings_[a]);
    }
    coarse_.components = fine.components;
    coarse_.values = Samples(coarse_.samples() * static_cast<std::size_t>(fine.components));
    sum_.resize(static_cast<std::size_t>(fine.dims[0]));
    weight_.resize(sum_.size());
  }

  Volume run() {
    float* out = coarse_.values.data();
    const auto rows = static_cast<std::size_t>(coarse_.dims[1]);
    const auto layers = static_cast<std::size_t>(coarse_.dims[2]);
    for (int c = 0; c < fine_.components; ++c) {
      for (std::size_t k = 0; k < layers; ++k) {
        for (std::size_t j = 0; j < rows; ++j) {
          gather(fine_.component(c), j, k);
          shrink(out);
          out += coarse_.dims[0];
        }
      }
    }
    finish_volume(coarse_);
    return std::move(coarse_);
  }

 private:
  void gather(const float* values, std::size_t j, std::size_t k) {
    std::fill(sum_.begin(), sum_.end(), 0.0F);
    std::fill(weight_.begin(), weight_.end(), 0.0F);
    const Group y = group_at(j, halvings_[1], fine_.dims[1]);
    const Group z = group_at(k, halvings_[2], fine_.dims[2]);
    const auto row = static_cast<std::size_t>(fine_.dims[0]);
    const auto layer = row * static_cast<std::size_t>(fine_.dims[1]);
    for (std::size_t b = z.first; b < z.first + z.count; ++b) {
      for (std::size_t a = y.first; a < y.first + y.count; ++a) {
        add_row(values + b * layer + a * row, row, weights_[1][a] * weights_[2][b], sum_.data(),
                weight_.data());
      }
    }
  }

  void shrink(float* out) const {
    for (std::size_t i = 0; i < static_cast<std::size_t>(coarse_.dims[0]); ++i) {
      const Group x = group_at(i, halvings_[0], fine_.dims[0]);
      float sum = 0;
      float weight = 0;
      for (std::size_t n = x.first; n < x.first + x.count; ++n) {
        sum += weights_[0][n] * sum_[n];
        weight += weights_[0][n] * weight_[n];
      }
      out[i] = weight > 0 ? sum / weight : std::numeric_limits<float>::quiet_NaN();
    }
  }

  const Volume& fine_;
  std::array<int, 3> halvings_;
  std::array<std::vector<float>, 3> weights_;
  std::vector<float> sum_, weight_;
  Volume coarse_;
};

}  // namespace

int halved(int samples, int halvings) {
  const int size = 1 << halvings;
  return (samples - 1) / size + 1;
}

Volume coarsen(const Volume& fine, const Coarsening& how) { return Coarsener(fine, how).run(); }

std::string key_of(const Coarsening& how) {
  std::string key;
  for (std::size_t a = 0; a < 3; ++a) {
    key += std::to_string(how.halvings[a]) + ':';
    if (how.halvings[a] == 0) continue;
    const auto samples = static_cast<int>(how.widths[a].size());
    const std::vector<float> weights = shares(how.widths[a], samples, how.halvings[a]);
    key.append(reinterpret_cast<const char*>(weights.data()), weights.size() * sizeof(float));
  }
  return key;
}

}  // namespace windsplat::data
