#include "server/convert/pencil.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/base/check.hpp"
#include "server/data/model/coarsen.hpp"

namespace windsplat::convert {

data::Volume reduce(const Plan& plan, const Product& product, const data::Volume& pencil,
                    const data::Box& box) {
  const Level& level = plan.level_of(product);
  data::Coarsening how = level.how;
  how.first = box.first;
  how.data_dims = plan.dims;
  switch (product.as) {
    case Reduced::mean:
      how.reduction = data::Reduction::mean;
      break;
    case Reduced::mean_magnitude:
      how.reduction = data::Reduction::mean_magnitude;
      break;
    case Reduced::drawn:
      how.reduction = data::Reduction::drawn;
      break;
    case Reduced::strided:
    case Reduced::two_values:
    case Reduced::samples:
      break;
  }
  return coarsen(pencil, how);
}

BrickStatistics statistics_of(const data::Volume& brick) {
  BrickStatistics out;
  out.masked = static_cast<std::uint32_t>(brick.masked);
  if (static_cast<std::size_t>(brick.masked) == brick.samples()) {
    out.low = out.high = std::numeric_limits<float>::quiet_NaN();
    return out;
  }
  out.low = brick.range[0];
  out.high = brick.range[1];
  const double low = out.low;
  const double span = static_cast<double>(out.high) - low;
  const double bins_a_unit = span > 0 ? histogram_bins / span : 0;
  const auto count = [&](float value) {
    if (std::isnan(value)) return;
    const int bin = static_cast<int>((static_cast<double>(value) - low) * bins_a_unit);
    ++out.histogram.at(static_cast<std::size_t>(std::min(bin, histogram_bins - 1)));
  };
  if (brick.components == 1) {
    for (const float value : brick.values) count(value);
    return out;
  }
  std::array<const float*, 3> components{};
  WINDSPLAT_CHECK(brick.components <= 3);
  for (int c = 0; c < brick.components; ++c) {
    components.at(static_cast<std::size_t>(c)) = brick.component(c);
  }
  for (std::size_t i = 0; i < brick.samples(); ++i) {
    count(data::magnitude(components.data(), brick.components, i));
  }
  return out;
}

void Statistics::set(std::size_t brick, const BrickStatistics& of) {
  low[brick] = of.low;
  high[brick] = of.high;
  masked[brick] = of.masked;
  std::copy(of.histogram.begin(), of.histogram.end(),
            histogram.begin() + static_cast<std::ptrdiff_t>(brick * histogram_bins));
}

void copy_common(const float* from, const data::Box& from_box, const data::Box& to_box, float* to) {
  Three first{};
  Three end{};
  for (std::size_t a = 0; a < 3; ++a) {
    first[a] = std::max(from_box.first[a], to_box.first[a]);
    end[a] = std::min(from_box.first[a] + from_box.count[a], to_box.first[a] + to_box.count[a]);
    if (first[a] >= end[a]) return;
  }
  const auto row = [&](const data::Box& box, int y, int z) {
    return flat({first[0] - box.first[0], y - box.first[1], z - box.first[2]}, box.count);
  };
  for (int z = first[2]; z < end[2]; ++z) {
    for (int y = first[1]; y < end[1]; ++y) {
      std::copy_n(from + row(from_box, y, z), end[0] - first[0], to + row(to_box, y, z));
    }
  }
}

}  // namespace windsplat::convert
