#include "tests/numerics/stored/stored_fields.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "server/data/model/coarsen.hpp"
#include "server/data/model/stored.hpp"

namespace windsplat::test {
namespace {

using data::Reduction;
using data::StoredAs;
using data::Volume;

std::vector<double> widths_of(const data::Axis& axis) {
  const auto& at = axis.coordinates;
  if (at.size() == 1) return {1};
  std::vector<double> out;
  for (std::size_t n = 0; n < at.size(); ++n) {
    const double low = n == 0 ? at[0] - (at[1] - at[0]) / 2 : (at[n - 1] + at[n]) / 2;
    const double high =
        n + 1 == at.size() ? at[n] + (at[n] - at[n - 1]) / 2 : (at[n] + at[n + 1]) / 2;
    out.push_back(high - low);
  }
  return out;
}

bool is_even(const std::vector<double>& widths) {
  const auto [least, most] = std::minmax_element(widths.begin(), widths.end());
  return *most - *least <= 1e-9 * *most;
}

// cut() of the four components of two values, which are no vector.
Volume cut_two_values(const Volume& level, const data::Box& box,
                      const std::array<float, 2>& range) {
  Volume out;
  out.dims = box.count;
  out.components = level.components;
  std::vector<float> values;
  for (int c = 0; c < level.components; ++c) {
    Volume one;
    one.dims = level.dims;
    one.values = std::vector<float>(level.component(c), level.component(c) + level.samples());
    const Volume part = cut(one, box);
    values.insert(values.end(), part.values.data(), part.values.data() + part.samples());
    out.masked = part.masked;
  }
  out.values = std::move(values);
  out.range = range;
  return out;
}

Volume middles_of(const Volume& fine, std::size_t level) {
  const int stride = 1 << level;
  Volume out;
  out.components = fine.components;
  for (std::size_t a = 0; a < 3; ++a) out.dims[a] = (fine.dims[a] + stride - 1) / stride;
  std::vector<float> values;
  for (int c = 0; c < fine.components; ++c) {
    for (int k = 0; k < out.dims[2]; ++k) {
      for (int j = 0; j < out.dims[1]; ++j) {
        for (int i = 0; i < out.dims[0]; ++i) {
          const int x = data::strided_sample(i, stride, fine.dims[0]);
          const int y = data::strided_sample(j, stride, fine.dims[1]);
          const int z = data::strided_sample(k, stride, fine.dims[2]);
          values.push_back(fine.component(c)[(z * fine.dims[1] + y) * fine.dims[0] + x]);
        }
      }
    }
  }
  out.values = std::move(values);
  finish_volume(out);
  return out;
}

class StoredFields final : public data::Source {
 public:
  StoredFields(data::DatasetInfo info, std::vector<std::shared_ptr<const Volume>> volumes,
               int levels, std::shared_ptr<StoredLevelCache> cache)
      : info_(std::move(info)), volumes_(std::move(volumes)), made_(std::move(cache)) {
    data::StoredLevels stored;
    for (int h = 0; h < levels; ++h) stored.levels.push_back({h, h, h});
    for (std::size_t a = 0; a < 3; ++a) {
      widths_.at(a) = widths_of(info_.grid.axes.at(a));
      if (!is_even(widths_.at(a))) stored.widths.at(a) = widths_.at(a);
    }
    for (std::size_t f = 0; f < volumes_.size(); ++f) {
      info_.fields[f].box_chunk = {16, 16, 16};
      data::StoredField field;
      field.has_levels = true;
      field.strided = volumes_[f]->components == 3 ? std::min(levels - 1, 4) : 0;
      field.ranges.assign(info_.steps.size(), {volumes_[f]->range, volumes_[f]->masked});
      stored.fields.push_back(std::move(field));
    }
    info_.stored = std::make_shared<const data::StoredLevels>(std::move(stored));
  }

  [[nodiscard]] const data::DatasetInfo& info() const override { return info_; }
  Result<Volume> read(std::size_t field, std::size_t /*step*/) override {
    return cut(*volumes_.at(field), data::whole_box(volumes_.at(field)->dims));
  }
  Result<Volume> read_part(std::size_t field, std::size_t /*step*/,
                           const data::StoredPart& part) override {
    if (auto fine = check_part(field, part); !fine) return fine.error();
    const Volume& volume = *volumes_.at(field);
    if (part.as == StoredAs::samples) return cut(volume, part.box);
    auto& level = (*made_)[{field, part.level, part.as}];
    if (level == nullptr) level = std::make_shared<const Volume>(level_of(volume, part));
    if (part.as == StoredAs::two_values) return cut_two_values(*level, part.box, volume.range);
    return cut(*level, part.box);
  }

 private:
  [[nodiscard]] Volume level_of(const Volume& volume, const data::StoredPart& part) const {
    if (part.as == StoredAs::strided) return middles_of(volume, part.level);
    data::Coarsening how;
    how.halvings.fill(static_cast<int>(part.level));
    how.widths = widths_;
    how.reduction = part.as == StoredAs::drawn ? Reduction::drawn : Reduction::two_values;
    return coarsen(volume, how);
  }

  data::DatasetInfo info_;
  std::vector<std::shared_ptr<const Volume>> volumes_;
  std::array<std::vector<double>, 3> widths_;
  std::shared_ptr<StoredLevelCache> made_;
};

}  // namespace

std::unique_ptr<data::Source> stored_fields(data::DatasetInfo info,
                                            std::vector<std::shared_ptr<const Volume>> volumes,
                                            int levels, std::shared_ptr<StoredLevelCache> cache) {
  return std::make_unique<StoredFields>(std::move(info), std::move(volumes), levels,
                                        std::move(cache));
}

}  // namespace windsplat::test
