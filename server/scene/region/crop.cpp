#include "server/scene/region/crop.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <iterator>
#include <utility>

#include "server/scene/angles.hpp"
#include "server/scene/bend.hpp"

namespace windsplat::scene {

namespace {

using protocol::FilterOf;
using protocol::FilterView;

// Calls visit(index in the data) for every column of the part, x fastest.
template <class Visit>
void each_column(const Crop& crop, std::size_t width, const Visit& visit) {
  for (int j = 0; j < crop.count[1]; ++j) {
    const auto row = static_cast<std::size_t>(crop.first[1] + j) * width;
    for (int i = 0; i < crop.count[0]; ++i) visit(row + static_cast<std::size_t>(crop.x_of(i)));
  }
}

template <class T>
std::vector<T> columns_of(const std::vector<T>& whole, const Crop& crop, std::size_t width) {
  std::vector<T> out;
  out.reserve(static_cast<std::size_t>(crop.count[0]) * static_cast<std::size_t>(crop.count[1]));
  each_column(crop, width, [&](std::size_t n) { out.push_back(whole[n]); });
  return out;
}

// Values by index along an axis; those beyond the end of the data are greater by `turn`.
std::vector<double> along(const std::vector<double>& whole, const Crop& crop, std::size_t axis,
                          double turn) {
  std::vector<double> out;
  out.reserve(static_cast<std::size_t>(crop.count[axis]));
  for (int i = 0; i < crop.count[axis]; ++i) {
    const int n = axis == 0 ? crop.x_of(i) : crop.first[axis] + i;
    const bool beyond = n < crop.first[axis];
    out.push_back(whole[static_cast<std::size_t>(n)] + (beyond ? turn : 0));
  }
  return out;
}

// World length of a turn along x: of the axis where it is straight, otherwise of all cells.
double turn_length(const Placed& whole, const Crop& crop) {
  const std::vector<double>& world = whole.lattice.positions[0];
  const std::vector<double>& at = whole.grid.axes[0].coordinates;
  if (whole.lattice.inner_radius > 0) {
    double length = 0;
    for (int i = 0; i < crop.turn; ++i) {
      length += whole.lattice.spacing[0][static_cast<std::size_t>(i)];
    }
    return length;
  }
  return turn_degrees * (world.back() - world.front()) / (at.back() - at.front());
}

data::Grid cropped_grid(const data::Grid& whole, const Crop& crop) {
  data::Grid out = whole;
  const auto width = static_cast<std::size_t>(whole.dims()[0]);
  for (std::size_t a = 0; a < 3; ++a) {
    out.axes[a].coordinates = along(whole.axes[a].coordinates, crop, a, turn_degrees);
  }
  if (whole.columns) {
    data::Columns columns;
    columns.longitude = columns_of(whole.columns->longitude, crop, width);
    columns.latitude = columns_of(whole.columns->latitude, crop, width);
    out.columns = std::make_shared<const data::Columns>(std::move(columns));
  }
  if (whole.ground) {
    data::Ground ground = *whole.ground;
    ground.heights = columns_of(whole.ground->heights, crop, width);
    out.ground = std::make_shared<const data::Ground>(std::move(ground));
  }
  return out;
}

using Places = std::vector<std::array<float, 3>>;

std::shared_ptr<const Places> cropped_places(const Lattice& whole, const Crop& crop, double turn) {
  auto out = std::make_shared<Places>();
  out->reserve(crop.samples());
  const auto width = static_cast<std::size_t>(whole.dims[0]);
  const auto layer = width * static_cast<std::size_t>(whole.dims[1]);
  for (int k = 0; k < crop.count[2]; ++k) {
    const std::size_t from = static_cast<std::size_t>(crop.first[2] + k) * layer;
    each_column(crop, width, [&](std::size_t n) {
      out->push_back((*whole.places)[from + n]);
      const bool beyond = n % width < static_cast<std::size_t>(crop.first[0]);
      if (beyond && !(whole.inner_radius > 0)) out->back()[0] += static_cast<float>(turn);
    });
  }
  return out;
}

// Of a rectilinear lattice, from cell edge to cell edge; cells need not have their sample in the
// middle.
void set_straight_box(const Lattice& whole, Lattice& part) {
  for (std::size_t a = 0; a < 3; ++a) {
    const int index = static_cast<int>(a);
    double edge = whole.box_min[index];
    for (int i = 0; i < part.first[a]; ++i) {
      edge += whole.spacing[a][static_cast<std::size_t>(i)];
    }
    part.box_min[index] = edge;
    for (const double width : part.spacing[a]) edge += width;
    part.box_max[index] = edge;
  }
}

Lattice cropped_lattice(const Placed& whole, const Crop& crop) {
  const Lattice& from = whole.lattice;
  const double turn = crop.turn > 0 ? turn_length(whole, crop) : 0;
  Lattice out = from;
  out.dims = crop.count;
  out.first = crop.first;
  out.turn = crop.turn;
  if (crop.count[0] < from.around) out.around = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    out.positions[a] = along(from.positions[a], crop, a, turn);
    out.spacing[a] = along(from.spacing[a], crop, a, 0);
  }
  if (!from.places) {
    set_straight_box(from, out);
    return out;
  }
  out.places = cropped_places(from, crop, turn);
  set_box(out);
  if (from.inner_radius > 0) {
    out.box_min = glm::max(out.box_min, glm::dvec3(-1));
    out.box_max = glm::min(out.box_max, glm::dvec3(1));
  }
  return out;
}

template <class T>
void append(const T& value, std::string& key) {
  key.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void append(const std::optional<protocol::Range>& range, std::string& key) {
  key += range ? 'r' : '-';
  if (range) append(*range, key);
}

// All numbers that clients choose: two regions with the same digest could be found.
std::string key_of(const protocol::RegionView& region, const Crop& crop) {
  std::string key = "region";
  append(crop.first, key);
  append(crop.count, key);
  append(crop.turn, key);
  if (!crop.columns) return key;
  append(region.longitudes, key);
  append(region.latitudes, key);
  for (const auto& polygon : region.polygon) {
    append(polygon.size(), key);
    for (const auto& ring : polygon) {
      append(ring.size(), key);
      for (const auto& point : ring) append(point, key);
    }
  }
  return key;
}

}  // namespace

Placed cropped_place(const std::shared_ptr<const Placed>& whole, const protocol::RegionView& region,
                     Crop crop) {
  Placed out;
  out.grid = cropped_grid(whole->grid, crop);
  out.lattice = cropped_lattice(*whole, crop);
  out.ground = whole->ground;
  if (!whole->lowest.empty()) {
    out.lowest = columns_of(whole->lowest, crop, static_cast<std::size_t>(whole->grid.dims()[0]));
    for (int& level : out.lowest) {
      if (level < 0) continue;
      level = level < crop.first[2] + crop.count[2] ? std::max(level - crop.first[2], 0) : -1;
    }
  }
  out.whole = whole;
  out.region = key_of(region, crop);
  out.crop = std::move(crop);
  return out;
}

Rates cropped_rates(const Rates& rates, const Crop& crop) {
  Rates out = rates;
  out.x = along(rates.x, crop, 1, 0);
  out.z = along(rates.z, crop, 2, 0);
  return out;
}

data::Derivation kept_part(const Placed& placed, std::size_t components,
                           const std::vector<FilterView>& filters) {
  const std::uint64_t bytes = placed.grid.samples() * components * sizeof(float);
  data::Derivation part;
  if (placed.crop) {
    part = {placed.region, bytes,
            [crop = *placed.crop](const data::Volume& volume) { return cropped(volume, crop); }};
  }
  if (filters.empty()) return part;
  data::Derivation filtered;
  filtered.variant = "where";
  filtered.bytes = bytes;
  std::vector<protocol::Range> ranges;
  for (const FilterView& filter : filters) {
    filtered.variant += filter.field;
    filtered.variant += '\0';
    append(filter.range, filtered.variant);
    ranges.push_back(filter.range);
    filtered.others.push_back(
        {filter.field, std::make_shared<const data::Derivation>(kept_part(placed, 1, {}))});
  }
  filtered.make_with = [ranges](const data::Volume& volume, const auto& others) {
    data::Volume out = masked_by(volume, *others[0], ranges[0]);
    for (std::size_t n = 1; n < ranges.size(); ++n) out = masked_by(out, *others[n], ranges[n]);
    return out;
  };
  return computed_from(part, std::move(filtered));
}

data::Derivation computed_from(const data::Derivation& first, data::Derivation second) {
  if (first.variant.empty()) return second;
  if (second.variant.empty()) return first;
  second.variant = first.variant + '\n' + second.variant;
  second.from = std::make_shared<const data::Derivation>(first);
  return second;
}

std::vector<FilterView> filters_of(const protocol::RegionView& region, FilterOf of) {
  std::vector<FilterView> out;
  std::copy_if(region.where.begin(), region.where.end(), std::back_inserter(out),
               [of](const FilterView& one) { return one.of == of || one.of == FilterOf::all; });
  return out;
}

}  // namespace windsplat::scene
