// Two values of each group by its weighted mean, means, and drawn samples. A row of groups
// accumulates its fine rows at full width, in loops without branches over consecutive memory, and
// is then added up along x. Coarse layers are independent of each other; large volumes are reduced
// by several threads.
#include "server/data/model/coarsen.hpp"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "server/base/check.hpp"
#include "server/base/pcg3d.hpp"
#include "server/base/thread_pool.hpp"

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

// The dimensions of the data of which the volume is a box.
std::array<int, 3> data_dims_of(const Volume& fine, const Coarsening& how) {
  if (how.data_dims == std::array{0, 0, 0}) {
    WINDSPLAT_CHECK((how.first == std::array{0, 0, 0}));
    return fine.dims;
  }
  for (std::size_t a = 0; a < 3; ++a) {
    const int group = 1 << how.halvings[a];
    const int end = how.first[a] + fine.dims[a];
    WINDSPLAT_CHECK(how.first[a] >= 0 && how.first[a] % group == 0);
    WINDSPLAT_CHECK(end == how.data_dims[a] || (end < how.data_dims[a] && end % group == 0));
  }
  return how.data_dims;
}

// Masks of all bits or none, since compilers do not vectorise choices between floats that may trap.
std::int32_t if_there(float v) {
  constexpr std::int32_t magnitude = 0x7fffffff;
  constexpr std::int32_t infinity = 0x7f800000;
  return (std::bit_cast<std::int32_t>(v) & magnitude) <= infinity ? -1 : 0;  // masked: NaN
}
// A zero has no sign here, so that equal values are not below.
std::int32_t if_below(float v, float mean) {
  return std::bit_cast<std::int32_t>((v - mean) + 0.0F) >> 31;
}
float under(std::int32_t mask, float v) {
  return std::bit_cast<float>(std::bit_cast<std::int32_t>(v) & mask);
}

// A thread for every million samples.
std::unique_ptr<ThreadPool> threads_for(const Volume& fine) {
  constexpr std::size_t samples_a_thread = std::size_t{1} << 20;
  return few_threads(fine.samples() / samples_a_thread);
}

// Weighted sums of the samples of groups and their weights. Full width: of the samples of a row.
struct Sums {
  std::vector<float> sum, weight;
  void reset(std::size_t count) {
    sum.assign(count, 0.0F);
    weight.assign(count, 0.0F);
  }
};

// sum += w v and weight += w where v is not masked.
void add_row(const float* values, float w, Sums& sums) {
  float* const sum = sums.sum.data();
  float* const weight = sums.weight.data();
  for (std::size_t i = 0; i < sums.sum.size(); ++i) {
    const std::int32_t there = if_there(values[i]);
    sum[i] += under(there, w * values[i]);
    weight[i] += under(there, w);
  }
}

// What a thread computes of a row of groups.
struct RowOfGroups {
  Sums all, low, high;            // full width
  std::vector<float> magnitudes;  // of the samples of a row of a vector
  std::vector<float> mean;        // of the group of every sample of a row; NaN: all are masked
  std::int64_t masked = 0;        // groups
};

// The same for the samples below the mean of their group, and for the others. No two of the six
// arrays overlap, which a compiler could otherwise not know.
void add_halves(const float* __restrict values, const float* __restrict mean, std::size_t count,
                float w, float* __restrict low_sum, float* __restrict low_weight,
                float* __restrict high_sum, float* __restrict high_weight) {
  for (std::size_t i = 0; i < count; ++i) {
    const float v = values[i];
    const std::int32_t there = if_there(v);
    const std::int32_t below = there & if_below(v, mean[i]);
    const std::int32_t above = there & ~below;
    low_sum[i] += under(below, w * v);
    low_weight[i] += under(below, w);
    high_sum[i] += under(above, w * v);
    high_weight[i] += under(above, w);
  }
}

// Two values or means of the groups of a scalar, and mean magnitudes of vectors.
class WeightedReducer {
 public:
  WeightedReducer(const Volume& fine, const Coarsening& how)
      : fine_(fine), halvings_(how.halvings), reduction_(how.reduction) {
    WINDSPLAT_CHECK((fine.components == 1) == (reduction_ != Reduction::mean_magnitude));
    const std::array<int, 3> data_dims = data_dims_of(fine, how);
    for (std::size_t a = 0; a < 3; ++a) {
      const std::vector<float> all = shares(how.widths[a], data_dims[a], halvings_[a]);
      const auto first = all.begin() + how.first[a];
      weights_[a].assign(first, first + fine.dims[a]);
      coarse_.dims[a] = halved(fine.dims[a], halvings_[a]);
    }
    coarse_.components = reduced_components(fine.components, reduction_);
    coarse_.values = Samples(coarse_.samples() * static_cast<std::size_t>(coarse_.components));
  }

  Volume run() {
    const auto pool = threads_for(fine_);
    std::vector<RowOfGroups> rows(pool->size());
    pool->run(static_cast<std::size_t>(coarse_.dims[2]),
              [&](std::size_t k, unsigned worker) { reduce_layer(k, rows[worker]); });
    if (reduction_ == Reduction::two_values) {
      for (const RowOfGroups& row : rows) coarse_.masked += row.masked;
      coarse_.range = fine_.range;
    } else {
      finish_volume(coarse_);
    }
    return std::move(coarse_);
  }

 private:
  void reduce_layer(std::size_t k, RowOfGroups& row) {
    const auto width = static_cast<std::size_t>(coarse_.dims[0]);
    const auto rows = static_cast<std::size_t>(coarse_.dims[1]);
    for (std::size_t j = 0; j < rows; ++j) {
      const std::size_t to = (k * rows + j) * width;
      find_means(j, k, row);
      if (reduction_ == Reduction::two_values) {
        divide(j, k, row);
        write(to, row);
      } else {
        write_means(to, row);
      }
    }
  }

  // Calls visit(first sample of a row, weight of the row) for every fine row of a coarse row.
  template <class Visit>
  void each_row(std::size_t j, std::size_t k, const Visit& visit) const {
    const Group y = group_at(j, halvings_[1], fine_.dims[1]);
    const Group z = group_at(k, halvings_[2], fine_.dims[2]);
    const auto row = static_cast<std::size_t>(fine_.dims[0]);
    const auto layer = row * static_cast<std::size_t>(fine_.dims[1]);
    for (std::size_t b = z.first; b < z.first + z.count; ++b) {
      for (std::size_t a = y.first; a < y.first + y.count; ++a) {
        visit(b * layer + a * row, weights_[1][a] * weights_[2][b]);
      }
    }
  }

  // The values of a row of samples, or their magnitudes.
  const float* values_at(std::size_t from, RowOfGroups& row) const {
    if (reduction_ != Reduction::mean_magnitude) return fine_.values.data() + from;
    const auto samples = static_cast<std::size_t>(fine_.dims[0]);
    const std::array<const float*, 3> components{
        fine_.component(0), fine_.component(1), fine_.component(std::min(2, fine_.components - 1))};
    row.magnitudes.resize(samples);
    for (std::size_t i = 0; i < samples; ++i) {
      row.magnitudes[i] = magnitude(components.data(), fine_.components, from + i);
    }
    return row.magnitudes.data();
  }

  void find_means(std::size_t j, std::size_t k, RowOfGroups& row) const {
    const auto samples = static_cast<std::size_t>(fine_.dims[0]);
    row.all.reset(samples);
    row.mean.resize(samples);
    each_row(j, k, [&](std::size_t from, float w) { add_row(values_at(from, row), w, row.all); });
    for (std::size_t i = 0; i < static_cast<std::size_t>(coarse_.dims[0]); ++i) {
      const Group x = group_at(i, halvings_[0], fine_.dims[0]);
      float sum = 0;
      float weight = 0;
      for (std::size_t n = x.first; n < x.first + x.count; ++n) {
        sum += weights_[0][n] * row.all.sum[n];
        weight += weights_[0][n] * row.all.weight[n];
      }
      const float mean = weight > 0 ? sum / weight : std::numeric_limits<float>::quiet_NaN();
      std::fill_n(row.mean.begin() + static_cast<std::ptrdiff_t>(x.first), x.count, mean);
    }
  }

  void divide(std::size_t j, std::size_t k, RowOfGroups& row) const {
    const auto samples = static_cast<std::size_t>(fine_.dims[0]);
    row.low.reset(samples);
    row.high.reset(samples);
    each_row(j, k, [&](std::size_t from, float w) {
      add_halves(fine_.values.data() + from, row.mean.data(), samples, w, row.low.sum.data(),
                 row.low.weight.data(), row.high.sum.data(), row.high.weight.data());
    });
  }

  void write_means(std::size_t to, const RowOfGroups& row) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(coarse_.dims[0]); ++i) {
      coarse_.values[to + i] = row.mean[group_at(i, halvings_[0], fine_.dims[0]).first];
    }
  }

  void write(std::size_t to, RowOfGroups& row) {
    const std::size_t samples = coarse_.samples();
    const auto set = [&](int component, std::size_t i, float v) {
      coarse_.values[static_cast<std::size_t>(component) * samples + to + i] = v;
    };
    for (std::size_t i = 0; i < static_cast<std::size_t>(coarse_.dims[0]); ++i) {
      const Group x = group_at(i, halvings_[0], fine_.dims[0]);
      const float mean = row.mean[x.first];
      if (mean != mean) {
        for (int c = 0; c < TwoValues::components; ++c) set(c, i, mean);
        ++row.masked;
        continue;
      }
      const auto put = [&](const Sums& half, int value, int its_share) {
        float sum = 0;
        float share = 0;
        for (std::size_t n = x.first; n < x.first + x.count; ++n) {
          sum += weights_[0][n] * half.sum[n];
          share += weights_[0][n] * half.weight[n];
        }
        set(value, i, share > 0 ? sum / share : mean);
        set(its_share, i, share);
      };
      put(row.low, TwoValues::low, TwoValues::low_share);
      put(row.high, TwoValues::high, TwoValues::high_share);
    }
  }

  const Volume& fine_;
  std::array<int, 3> halvings_;
  Reduction reduction_;
  std::array<std::vector<float>, 3> weights_;
  Volume coarse_;
};

// The sample that the highest bits of a hash draw from a group along an axis, if there is one;
// lines of the engine's kernels repeat it (drawn_samples in server/engine/kernels).
std::optional<std::size_t> drawn_sample(const Group& group, int halvings, int stride, int samples,
                                        std::uint32_t hash) {
  const auto places = static_cast<std::uint32_t>(drawn_places(halvings, stride));
  const auto place = static_cast<int>((hash >> 16U) * places >> 16U);
  const auto first = static_cast<int>(group.first);
  const int kernel = (first + stride / 2) / stride + place;  // of the first whole one in the group
  if (kernel * stride >= samples) return std::nullopt;
  const int sample = strided_sample(kernel, stride, samples);
  if (sample < first || sample >= first + static_cast<int>(group.count)) return std::nullopt;
  return static_cast<std::size_t>(sample);
}

// Copies drawn samples, group by group. Hashes are of the group's indices in the data alone.
// `apart`: the distance in the data of the samples that `fine` has: 1, or the stride.
class Drawer {
 public:
  Drawer(const Volume& fine, const Coarsening& how, const std::array<int, 3>& data_dims, int apart)
      : fine_(fine),
        halvings_(how.halvings),
        stride_(how.stride),
        apart_(apart),
        first_(how.first),
        data_dims_(data_dims) {
    for (std::size_t a = 0; a < 3; ++a) {
      WINDSPLAT_CHECK(first_[a] % apart == 0);
      const int samples = std::min(fine.dims[a] * apart, data_dims_[a] - first_[a]);
      WINDSPLAT_CHECK(samples > (fine.dims[a] - 1) * apart);
      WINDSPLAT_CHECK(first_[a] + samples == data_dims_[a] || samples % (1 << halvings_[a]) == 0);
      coarse_.dims[a] = halved(samples, halvings_[a]);
    }
    coarse_.components = fine.components;
    coarse_.values = Samples(coarse_.samples() * static_cast<std::size_t>(fine.components));
  }

  Volume run() {
    threads_for(fine_)->run(static_cast<std::size_t>(coarse_.dims[2]),
                            [&](std::size_t k, unsigned) { draw_layer(static_cast<int>(k)); });
    finish_volume(coarse_);
    return std::move(coarse_);
  }

 private:
  void draw_layer(int layer) {
    const std::size_t samples = coarse_.samples();
    std::size_t to =
        samples / static_cast<std::size_t>(coarse_.dims[2]) * static_cast<std::size_t>(layer);
    std::array<int, 3> group{0, 0, layer};
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

  // `group`: within the volume. Empty: no sample at the place that is drawn.
  [[nodiscard]] std::optional<std::size_t> drawn(std::array<int, 3> group) const {
    for (std::size_t a = 0; a < 3; ++a) group[a] += first_[a] >> halvings_[a];
    const auto hash =
        pcg3d({static_cast<std::uint32_t>(group[0]), static_cast<std::uint32_t>(group[1]),
               static_cast<std::uint32_t>(group[2])});
    std::size_t at = 0;
    for (std::size_t a = 3; a-- > 0;) {
      const Group along = group_at(static_cast<std::size_t>(group[a]), halvings_[a], data_dims_[a]);
      const auto sample = drawn_sample(along, halvings_[a], stride_, data_dims_[a], hash[a]);
      if (!sample) return std::nullopt;
      at = at * static_cast<std::size_t>(fine_.dims[a]) +
           (*sample - static_cast<std::size_t>(first_[a])) / static_cast<unsigned>(apart_);
    }
    return at;
  }

  const Volume& fine_;
  std::array<int, 3> halvings_;
  int stride_;
  int apart_;
  std::array<int, 3> first_, data_dims_;
  Volume coarse_;
};

}  // namespace

int halved(int samples, int halvings) {
  const int size = 1 << halvings;
  return (samples - 1) / size + 1;
}

Volume coarsen(const Volume& fine, const Coarsening& how) {
  if (how.reduction == Reduction::drawn) {
    return Drawer(fine, how, data_dims_of(fine, how), 1).run();
  }
  return WeightedReducer(fine, how).run();
}

Volume draw(const Volume& strided, const Coarsening& how, const std::array<int, 3>& data_dims) {
  return Drawer(strided, how, data_dims, how.stride).run();
}

int reduced_components(int components, Reduction reduction) {
  if (reduction == Reduction::drawn) return components;
  return reduction == Reduction::two_values ? TwoValues::components : 1;
}

std::string key_of(const Coarsening& how) {
  std::string key = how.reduction == Reduction::two_values ? "two values"
                    : how.reduction == Reduction::mean     ? "mean"
                    : how.reduction == Reduction::drawn
                        ? "drawn " + std::to_string(how.stride) + ' '
                        : "mean magnitude";
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
