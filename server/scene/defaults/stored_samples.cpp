#include "server/scene/defaults/stored_samples.hpp"

#include <cmath>
#include <cstddef>
#include <utility>

#include "server/data/model/stored.hpp"
#include "server/scene/defaults/some_samples.hpp"
#include "server/scene/detail.hpp"

namespace windsplat::scene {

namespace {

// How the source reduced its samples to a stored level.
data::Coarsening stored_coarsening(const data::DatasetInfo& info, const data::FieldInfo& field,
                                   std::size_t level) {
  data::Coarsening how;
  how.halvings = info.stored->levels.at(level);
  if (field.kind == data::FieldKind::vector) how.reduction = data::Reduction::drawn;
  for (std::size_t a = 0; a < 3; ++a) {
    how.widths.at(a) = info.stored->widths.at(a);
    if (how.widths.at(a).empty()) {
      how.widths.at(a).assign(info.grid.axes.at(a).coordinates.size(), 1.0);
    }
  }
  return how;
}

// The last level from 1 on with that many samples, or the first.
std::size_t level_with_samples(const data::DatasetInfo& info) {
  std::size_t found = 1;
  for (std::size_t n = 1; n < info.stored->levels.size(); ++n) {
    std::size_t samples = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      samples *= static_cast<std::size_t>(
          data::halved(info.grid.dims().at(a), info.stored->levels[n].at(a)));
    }
    if (samples >= some_samples_max) found = n;
  }
  return found;
}

data::Volume one_of_two(const data::Volume& two) {
  data::Volume out;
  out.dims = two.dims;
  out.values = data::Samples(two.samples());
  const float* const low = two.component(data::TwoValues::low);
  const float* const high = two.component(data::TwoValues::high);
  const float* const share = two.component(data::TwoValues::low_share);
  const float* const other = two.component(data::TwoValues::high_share);
  for (std::size_t n = 0; n < two.samples(); ++n) {
    const double turn = static_cast<double>(n) * 0.7548776662466927;  // evenly spread
    const auto place = static_cast<float>(turn - std::floor(turn));
    out.values[n] = place * (share[n] + other[n]) < share[n] ? low[n] : high[n];
  }
  out.range = two.range;
  out.masked = two.masked;
  return out;
}

}  // namespace

Lattice DefaultSamples::lattice(const Lattice& whole) const {
  return halvings == std::array{0, 0, 0} ? whole : coarsen_lattice(whole, halvings);
}

std::optional<Slice> DefaultSamples::slice(const std::optional<Slice>& whole) const {
  auto out = whole;
  if (out) out->sample >>= halvings.at(static_cast<std::size_t>(out->axis));
  return out;
}

Result<std::optional<DefaultSamples>> stored_samples(data::Dataset& dataset,
                                                     const std::string& field, std::size_t step) {
  const data::DatasetInfo& info = dataset.info();
  const data::FieldInfo* const about = info.find(field);
  const bool may_be = about != nullptr && info.stored != nullptr && info.stored->levels.size() > 1;
  if (!may_be || dataset.fits_in_full({field})) return std::optional<DefaultSamples>();
  const auto how = stored_coarsening(info, *about, level_with_samples(info));
  const auto stored = dataset.stored_reduction(field, how);
  if (!stored) return std::optional<DefaultSamples>();
  auto volume = dataset.derived(field, step, *stored);
  if (!volume) return volume.error();
  DefaultSamples out{std::move(*volume), how.halvings};
  if (about->kind == data::FieldKind::scalar) {
    out.volume = std::make_shared<const data::Volume>(one_of_two(*out.volume));
  } else if (const auto seen = dataset.seen(field, step)) {
    data::Volume all = *out.volume;
    all.range = seen->range;
    out.volume = std::make_shared<const data::Volume>(std::move(all));
  }
  return std::optional(std::move(out));
}

int stored_stride(int stride, const std::string& field, const data::Dataset& dataset) {
  const data::DatasetInfo& info = dataset.info();
  const data::FieldInfo* const about = info.find(field);
  if (about == nullptr || info.stored == nullptr || dataset.fits_in_full({field})) return stride;
  const auto index = static_cast<std::size_t>(about - info.fields.data());
  if (!data::stored_dims(info, index, 1, data::StoredAs::drawn)) return stride;
  int out = 1;
  while (out < stride && data::stored_middles(info, index, 2 * out)) out *= 2;
  return out;
}

}  // namespace windsplat::scene
