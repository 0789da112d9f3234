// Two values of each group by its weighted mean, and drawn samples. A row of means first
// accumulates its fine rows at full width, so that inner loops access memory sequentially; then it
// is averaged along x.
#include "server/data/model/coarsen.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

#include "server/base/check.hpp"
#include "server/base/pcg3d.hpp"

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

// Means and two values of the groups of a scalar.
class TwoValueReducer {
 public:
  TwoValueReducer(const Volume& fine, const Coarsening& how)
      : fine_(fine), halvings_(how.halvings) {
    WINDSPLAT_CHECK(fine.components == 1);
    for (std::size_t a = 0; a < 3; ++a) {
      weights_[a] = shares(how.widths[a], fine.dims[a], halvings_[a]);
      coarse_.dims[a] = halved(fine.dims[a], halvings_[a]);
    }
    coarse_.components = TwoValues::components;
    coarse_.values = Samples(coarse_.samples() * TwoValues::components);
    sum_.resize(static_cast<std::size_t>(fine.dims[0]));
    weight_.resize(sum_.size());
    const auto row = static_cast<std::size_t>(coarse_.dims[0]);
    mean_.resize(row);
    for (Half* half : {&low_, &high_}) {
      half->sum.resize(row);
      half->share.resize(row);
    }
  }

  Volume run() {
    const auto rows = static_cast<std::size_t>(coarse_.dims[1]);
    const auto layers = static_cast<std::size_t>(coarse_.dims[2]);
    std::size_t to = 0;
    for (std::size_t k = 0; k < layers; ++k) {
      for (std::size_t j = 0; j < rows; ++j) {
        find_means(j, k);
        divide(j, k);
        write(to);
        to += static_cast<std::size_t>(coarse_.dims[0]);
      }
    }
    coarse_.range = fine_.range;
    return std::move(coarse_);
  }

 private:
  struct Half {
    std::vector<float> sum, share;
  };

  // Calls visit(row of samples, its weight) for every fine row of a coarse row.
  template <class Visit>
  void each_row(std::size_t j, std::size_t k, const Visit& visit) const {
    const Group y = group_at(j, halvings_[1], fine_.dims[1]);
    const Group z = group_at(k, halvings_[2], fine_.dims[2]);
    const auto row = static_cast<std::size_t>(fine_.dims[0]);
    const auto layer = row * static_cast<std::size_t>(fine_.dims[1]);
    for (std::size_t b = z.first; b < z.first + z.count; ++b) {
      for (std::size_t a = y.first; a < y.first + y.count; ++a) {
        visit(fine_.values.data() + b * layer + a * row, weights_[1][a] * weights_[2][b]);
      }
    }
  }

  // NaN where all samples of a group are masked.
  void find_means(std::size_t j, std::size_t k) {
    std::fill(sum_.begin(), sum_.end(), 0.0F);
    std::fill(weight_.begin(), weight_.end(), 0.0F);
    each_row(j, k, [&](const float* row, float w) {
      add_row(row, sum_.size(), w, sum_.data(), weight_.data());
    });
    for (std::size_t i = 0; i < mean_.size(); ++i) {
      const Group x = group_at(i, halvings_[0], fine_.dims[0]);
      float sum = 0;
      float weight = 0;
      for (std::size_t n = x.first; n < x.first + x.count; ++n) {
        sum += weights_[0][n] * sum_[n];
        weight += weights_[0][n] * weight_[n];
      }
      mean_[i] = weight > 0 ? sum / weight : std::numeric_limits<float>::quiet_NaN();
    }
  }

  void divide(std::size_t j, std::size_t k) {
    for (Half* half : {&low_, &high_}) {
      std::fill(half->sum.begin(), half->sum.end(), 0.0F);
      std::fill(half->share.begin(), half->share.end(), 0.0F);
    }
    each_row(j, k, [&](const float* row, float w) {
      for (std::size_t n = 0; n < sum_.size(); ++n) {
        const float v = row[n];
        if (v != v) continue;  // masked
        const std::size_t i = n >> static_cast<unsigned>(halvings_[0]);
        Half& half = v < mean_[i] ? low_ : high_;
        const float share = w * weights_[0][n];
        half.sum[i] += share * v;
        half.share[i] += share;
      }
    });
  }

  void write(std::size_t to) {
    const std::size_t samples = coarse_.samples();
    const auto set = [&](int component, std::size_t i, float v) {
      coarse_.values[static_cast<std::size_t>(component) * samples + to + i] = v;
    };
    for (std::size_t i = 0; i < mean_.size(); ++i) {
      if (mean_[i] != mean_[i]) {
        for (int c = 0; c < TwoValues::components; ++c) set(c, i, mean_[i]);
        ++coarse_.masked;
        continue;
      }
      const auto value = [&](const Half& half) {
        return half.share[i] > 0 ? half.sum[i] / half.share[i] : mean_[i];
      };
      set(TwoValues::low, i, value(low_));
      set(TwoValues::high, i, value(high_));
      set(TwoValues::low_share, i, low_.share[i]);
      set(TwoValues::high_share, i, high_.share[i]);
    }
  }

  const Volume& fine_;
  std::array<int, 3> halvings_;
  std::array<std::vector<float>, 3> weights_;
  std::vector<float> sum_, weight_, mean_;
  Half low_, high_;
  Volume coarse_;
};

// The place in a group that the highest bits of a hash draw; lines of the engine's kernels repeat
// it (drawn_samples in server/engine/kernels).
std::size_t drawn_place(int halvings, std::uint32_t hash) {
  return std::uint64_t{hash} >> static_cast<unsigned>(32 - halvings);
}

// Copies drawn samples, group by group. Hashes are of the group's indices alone.
class Drawer {
 public:
  Drawer(const Volume& fine, const std::array<int, 3>& halvings)
      : fine_(fine), halvings_(halvings) {
    for (std::size_t a = 0; a < 3; ++a) coarse_.dims[a] = halved(fine.dims[a], halvings[a]);
    coarse_.components = fine.components;
    coarse_.values = Samples(coarse_.samples() * static_cast<std::size_t>(fine.components));
  }

  Volume run() {
    const std::size_t samples = coarse_.samples();
    std::size_t to = 0;
    std::array<int, 3> group{};
    for (group[2] = 0; group[2] < coarse_.dims[2]; ++group[2]) {
      for (group[1] = 0; group[1] < coarse_.dims[1]; ++group[1]) {
        for (group[0] = 0; group[0] < coarse_.dims[0]; ++group[0], ++to) {
          const std::optional<std::size_t> from = drawn(group);
          for (int c = 0; c < fine_.components; ++c) {
            coarse_.values[samples * static_cast<std::size_t>(c) + to] =
                from ? fine_.component(c)[*from] : std::numeric_limits<float>::quiet_NaN();
          }
        }
      }
    }
    finish_volume(coarse_);
    return std::move(coarse_);
  }

 private:
  // Empty: a place beyond the last sample.
  [[nodiscard]] std::optional<std::size_t> drawn(const std::array<int, 3>& group) const {
    const auto hash =
        pcg3d({static_cast<std::uint32_t>(group[0]), static_cast<std::uint32_t>(group[1]),
               static_cast<std::uint32_t>(group[2])});
    std::size_t at = 0;
    for (std::size_t a = 3; a-- > 0;) {
      const Group along = group_at(static_cast<std::size_t>(group[a]), halvings_[a], fine_.dims[a]);
      const std::size_t place = drawn_place(halvings_[a], hash[a]);
      if (place >= along.count) return std::nullopt;
      at = at * static_cast<std::size_t>(fine_.dims[a]) + along.first + place;
    }
    return at;
  }

  const Volume& fine_;
  std::array<int, 3> halvings_;
  Volume coarse_;
};

}  // namespace

int halved(int samples, int halvings) {
  const int size = 1 << halvings;
  return (samples - 1) / size + 1;
}

Volume coarsen(const Volume& fine, const Coarsening& how) {
  if (how.reduction == Reduction::drawn) return Drawer(fine, how.halvings).run();
  return TwoValueReducer(fine, how).run();
}

int reduced_components(int components, Reduction reduction) {
  return reduction == Reduction::two_values ? TwoValues::components : components;
}

std::string key_of(const Coarsening& how) {
  std::string key = how.reduction == Reduction::drawn ? "drawn" : "two values";
  for (std::size_t a = 0; a < 3; ++a) {
    key += std::to_string(how.halvings[a]) + ':';
    if (how.halvings[a] == 0 || how.reduction == Reduction::drawn) continue;
    const auto samples = static_cast<int>(how.widths[a].size());
    const std::vector<float> weights = shares(how.widths[a], samples, how.halvings[a]);
    key.append(reinterpret_cast<const char*>(weights.data()), weights.size() * sizeof(float));
  }
  return key;
}

}  // namespace windsplat::data
