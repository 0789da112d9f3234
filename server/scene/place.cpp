#include "server/scene/place.hpp"

#include <algorithm>
#include <any>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "server/data/cf/units.hpp"
#include "server/scene/bend.hpp"
#include "server/scene/lattice.hpp"
#include "server/scene/refusal.hpp"
#include "server/scene/region/crop.hpp"
#include "server/scene/region/select.hpp"
#include "server/terrain/lower_boundary.hpp"

namespace windsplat::scene {

namespace {

// The cache entry of a dataset: a placement with the parameters that determine it.
struct Kept {
  protocol::GeometryView geometry;  // without slice and plane, which do not change positions
  protocol::RegionView region;      // without filters
  std::shared_ptr<const Placed> placed;
};
using KeptPtr = std::shared_ptr<const Kept>;
constexpr const char* kept_key = "placement";

}  // namespace

Result<const data::FieldInfo*> find_field(const data::DatasetInfo& info, const std::string& name,
                                          data::FieldKind kind, const std::string& pointer) {
  const data::FieldInfo* field = info.find(name);
  if (field == nullptr) {
    return invalid_at(pointer, "dataset " + in_double_quotes(info.id) + " has no field " +
                                   in_double_quotes(name) + data::absence_text(info, name));
  }
  if (field->kind != kind) {
    const bool scalar = field->kind == data::FieldKind::scalar;
    return invalid_at(pointer, "field " + in_double_quotes(field->name) + " is a " +
                                   (scalar ? "scalar, not a vector" : "vector, not a scalar"));
  }
  return field;
}

bool is_bent(const protocol::GeometryView& geometry) {
  return geometry.mapping != protocol::GeometryMapping::flat || geometry.height_field.has_value();
}

namespace {

using protocol::GeometryMapping;

// Heights above sea level by their standard name, unlike those above the ground ("height").
bool is_above_sea(const std::string& standard_name) {
  return standard_name == "altitude" || standard_name == "geopotential_height" ||
         standard_name.starts_with("geometric_height") ||
         standard_name.starts_with("height_above_geopotential_datum") ||
         standard_name.starts_with("height_above_mean_sea_level") ||
         standard_name.starts_with("height_above_reference_ellipsoid");
}

// Metres upward per unit of the vertical axis; empty if it has none of length.
std::optional<double> upward_metres_of(const data::Axis& axis) {
  const auto metres = data::metres_in(axis.units);
  if (!metres) return std::nullopt;
  return axis.kind == data::AxisKind::depth ? -*metres : *metres;
}

// Whether levels that the axis places at one height each have others in the columns: those that
// follow the terrain stand at their mean heights there.
bool has_heights_of_samples(const data::DatasetInfo& info) {
  return std::any_of(info.fields.begin(), info.fields.end(), [](const data::FieldInfo& field) {
    const std::string& name = field.standard_name;
    return field.kind == data::FieldKind::scalar &&
           (is_above_sea(name) || name == "height" || field.name == "zCoordinates");
  });
}

// Whether the axis counts from sea level, to which the ground of the file refers.
bool counts_from_sea(const data::Axis& axis, data::GroundKind ground) {
  if (!upward_metres_of(axis)) return false;
  const bool sea_floor = ground == data::GroundKind::sea_floor;
  if (axis.kind == data::AxisKind::depth) return sea_floor;
  if (axis.kind != data::AxisKind::height) return false;
  if (is_above_sea(axis.standard_name)) return true;
  return sea_floor && std::all_of(axis.coordinates.begin(), axis.coordinates.end(),
                                  [](double z) { return z <= 0; });
}

// Whether the heights of samples count from sea level: by their name or, on levels that follow the
// terrain, because the ground lies below the lowest samples.
bool count_from_sea(const data::FieldInfo& field, const Heights& heights,
                    const std::vector<int>& lowest, const data::Grid& grid) {
  const auto metres = data::metres_in(heights.units);
  if (!metres) return false;
  if (is_above_sea(field.standard_name)) return true;
  if (grid.axes[2].kind == data::AxisKind::pressure) return false;
  constexpr double share = 0.01;  // of the columns, such as those at cliffs
  const std::vector<float>& ground = grid.ground->heights;
  std::size_t above = 0;
  for (std::size_t c = 0; c < ground.size(); ++c) {
    const int level = lowest.empty() ? 0 : lowest[c];
    if (level < 0 || std::isnan(ground[c])) continue;
    const float z =
        heights.values->component(0)[static_cast<std::size_t>(level) * ground.size() + c];
    above += static_cast<double>(ground[c]) > *metres * static_cast<double>(z) ? 1 : 0;
  }
  return static_cast<double>(above) <= share * static_cast<double>(ground.size());
}

GroundFrom ground_from(const data::DatasetInfo& info, const data::FieldInfo* field,
                       const Heights* heights, const Placed& placed) {
  const data::Grid& grid = info.grid;
  const bool given = grid.ground && placed.lattice.dims[2] > 1;
  if (heights == nullptr) {
    const bool placed_by_it =
        given && counts_from_sea(grid.axes[2], grid.ground->kind) && !has_heights_of_samples(info);
    return placed_by_it ? GroundFrom::file : GroundFrom::none;
  }
  if (given && count_from_sea(*field, *heights, placed.lowest, grid)) return GroundFrom::file;
  const bool by_pressure = grid.axes[2].kind == data::AxisKind::pressure;
  return by_pressure ? GroundFrom::none : GroundFrom::levels;
}

std::vector<int> lowest_levels(const data::Volume& heights) {
  std::vector<int> lowest;
  if (heights.masked == 0) return lowest;
  const auto [width, height, levels] = heights.dims;
  const std::size_t layer = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  lowest.assign(layer, -1);
  for (int k = levels - 1; k >= 0; --k) {
    const float* const from = heights.component(0) + static_cast<std::size_t>(k) * layer;
    for (std::size_t c = 0; c < layer; ++c) {
      if (std::isfinite(from[c])) lowest[c] = k;
    }
  }
  return lowest;
}

// World z of every column, on a globe the radius: linear between the levels, and beyond them as
// between the outermost.
std::vector<double> ground_levels(const Placed& placed, bool sphere) {
  const data::Axis& axis = placed.grid.axes[2];
  const double metres = upward_metres_of(axis).value();
  std::vector<double> heights = axis.coordinates;
  for (double& z : heights) z *= metres;
  const std::vector<double>& world = placed.lattice.positions[2];
  const double middle = sphere ? 0.5 * (1 + placed.lattice.inner_radius) : 0;
  std::vector<double> out;
  out.reserve(placed.grid.ground->heights.size());
  for (const float height : placed.grid.ground->heights) {
    const auto z = static_cast<double>(height);
    const auto above = std::upper_bound(heights.begin() + 1, heights.end() - 1, z);
    const auto k = static_cast<std::size_t>(above - heights.begin());
    const double share = (z - heights[k - 1]) / (heights[k] - heights[k - 1]);
    out.push_back(middle + world[k - 1] + share * (world[k] - world[k - 1]));
  }
  return out;
}

// Whether vertices are missing, or their heights (on a globe: their radii) differ by more than the
// rounding of positions in floats.
bool has_relief(const terrain::Terrain& terrain) {
  constexpr double rounding = 1e-5;
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  double most = 0;
  for (int y = 0; y < terrain.height(); ++y) {
    for (int x = 0; x < terrain.width(); ++x) {
      const glm::dvec3 at = terrain.vertex(x, y);
      if (std::isnan(at.z)) return true;
      const double height = terrain.base() == terrain::Base::globe ? glm::length(at) : at.z;
      low = std::min(low, height);
      high = std::max(high, height);
      most = std::max(most, glm::length(at));
    }
  }
  return high - low > rounding * most;
}

// The columns of a lattice without positions of its own, in one layer.
std::vector<std::array<float, 3>> columns_of_axes(const Lattice& lattice) {
  std::vector<std::array<float, 3>> places;
  for (const double y : lattice.positions[1]) {
    for (const double x : lattice.positions[0]) {
      places.push_back({static_cast<float>(x), static_cast<float>(y), 0});
    }
  }
  return places;
}

std::shared_ptr<const terrain::Terrain> make_terrain(const protocol::GeometryView& geometry,
                                                     const Placed& placed) {
  const Lattice& lattice = placed.lattice;
  const bool sphere = geometry.mapping == GeometryMapping::sphere;
  const auto mean = [&lattice](std::size_t a) { return cell_size(lattice, a); };
  std::vector<std::array<float, 3>> columns;
  if (!lattice.places) columns = columns_of_axes(lattice);
  terrain::Samples samples{lattice.places ? *lattice.places : columns,
                           lattice.dims,
                           {mean(0), mean(1), mean(2)},
                           lattice.around};
  if (!lattice.places) samples.dims[2] = 1;
  std::vector<double> ground;
  if (placed.ground == GroundFrom::file) {
    ground = ground_levels(placed, sphere);
    samples.ground = &ground;
  } else if (!placed.lowest.empty()) {
    samples.lowest = &placed.lowest;
  }
  return terrain::surface_of(samples, sphere ? terrain::Base::globe : terrain::Base::map);
}

// Whatever the placement depends on.
std::string terrain_key(const protocol::GeometryView& geometry, const std::string& region) {
  std::ostringstream key;
  key << "terrain " << static_cast<int>(geometry.mapping) << ' '
      << static_cast<int>(geometry.vertical) << std::hexfloat;
  for (const double scale : geometry.scale) key << ' ' << scale;
  key << ' ' << geometry.height_field.value_or("");
  return key.str() + region;
}

// Kept also where there is nothing to draw, so that this is found once.
struct KeptTerrain {
  std::shared_ptr<const terrain::Terrain> terrain;
};

}  // namespace

Result<std::shared_ptr<const terrain::Terrain>> terrain_of(const protocol::GeometryView& geometry,
                                                           const Placed& placed,
                                                           data::Dataset& dataset) {
  if (placed.ground == GroundFrom::none) return std::shared_ptr<const terrain::Terrain>();
  const std::array<int, 3>& dims = placed.lattice.dims;
  const std::uint64_t bytes = terrain::bytes_of(dims[0] + 2, dims[1] + 2);
  auto kept =
      dataset.auxiliary(terrain_key(geometry, placed.region), bytes, [&]() -> data::Resident {
        auto made = make_terrain(geometry, placed);
        if (placed.ground == GroundFrom::levels && !has_relief(*made)) made.reset();
        return std::make_shared<const KeptTerrain>(KeptTerrain{std::move(made)});
      });
  if (!kept) return kept.error();
  return std::static_pointer_cast<const KeptTerrain>(*kept)->terrain;
}

namespace {

// The layer nearest to the plane above the centre of the box.
Slice layer_near(const protocol::PlaneView& plane, const Lattice& lattice) {
  std::size_t axis = 0;
  for (std::size_t a = 1; a < 3; ++a) {
    if (std::abs(plane.normal[a]) >= std::abs(plane.normal[axis])) axis = a;
  }
  double at = 0;
  for (std::size_t a = 0; a < 3; ++a) at += plane.normal[a] * plane.point[a];
  at /= plane.normal[axis];
  const std::vector<double>& positions = lattice.positions[axis];
  std::size_t nearest = 0;
  for (std::size_t i = 1; i < positions.size(); ++i) {
    if (std::abs(positions[i] - at) < std::abs(positions[nearest] - at)) nearest = i;
  }
  return {static_cast<int>(axis), static_cast<int>(nearest)};
}

Result<void> check_plane(const protocol::GeometryView& geometry) {
  const std::string pointer = "/geometry/plane";
  if (geometry.slice)
    return invalid_at(pointer, "a view has a slice or a plane, not both: set one to null");
  if (geometry.height_field) {
    return invalid_at(pointer, "is not available with heightField: use geometry.slice");
  }
  if (geometry.mapping != protocol::GeometryMapping::flat) {
    return invalid_at(pointer, "requires the mapping flat: use geometry.slice");
  }
  return {};
}

}  // namespace

std::optional<Slice> slice_of(const protocol::GeometryView& geometry, const Lattice& lattice) {
  if (geometry.plane) return layer_near(*geometry.plane, lattice);
  if (!geometry.slice) return std::nullopt;
  const int axis = static_cast<int>(geometry.slice->axis);
  const auto nearest = static_cast<int>(std::lround(slice_index(*geometry.slice, lattice)));
  const int last = lattice.dims[static_cast<std::size_t>(axis)] - 1;
  return Slice{axis, std::clamp(nearest, 0, last)};
}

double slice_index(const protocol::SliceView& slice, const Lattice& lattice) {
  const auto axis = static_cast<std::size_t>(slice.axis);
  const double index = slice.index - lattice.first[axis];
  return axis == 0 && index < 0 && lattice.turn > 0 ? index + lattice.turn : index;
}

Result<void> check_geometry(const protocol::GeometryView& geometry, const data::DatasetInfo& info) {
  if (geometry.height_field) {
    auto field =
        find_field(info, *geometry.height_field, data::FieldKind::scalar, "/geometry/heightField");
    if (!field) return field.error();
  }
  if (auto ok = check_mapping(info.grid, geometry.mapping); !ok) return ok;
  if (geometry.plane) {
    if (auto ok = check_plane(geometry); !ok) return ok;
  }
  if (const auto& slice = geometry.slice) {
    const auto axis = static_cast<std::size_t>(slice->axis);
    const int last = info.grid.dims().at(axis) - 1;
    if (!(slice->index >= 0 && slice->index <= last)) {
      constexpr std::array<const char*, 3> names = {"x", "y", "z"};
      return invalid_at("/geometry/slice/index", "dataset " + in_double_quotes(info.id) +
                                                     " has layers 0 to " + std::to_string(last) +
                                                     " across " + names.at(axis));
    }
  }
  return {};
}

namespace {

Result<std::shared_ptr<const Placed>> place_whole(const protocol::GeometryView& geometry,
                                                  data::Dataset& dataset) {
  const data::DatasetInfo& info = dataset.info();
  auto placed = std::make_shared<Placed>();
  placed->grid = info.grid;
  std::optional<Heights> heights;
  const data::FieldInfo* of_heights = nullptr;
  if (geometry.height_field) {
    auto field =
        find_field(info, *geometry.height_field, data::FieldKind::scalar, "/geometry/heightField");
    if (!field) return field.error();
    auto values = dataset.minuend().volume(*geometry.height_field, 0);
    if (!values) return values.error();
    of_heights = *field;
    heights = Heights{(*field)->name, (*field)->units, std::move(*values)};
    placed->lowest = lowest_levels(*heights->values);
    auto raised = grid_with_heights(info.grid, *heights);
    if (!raised) return raised.error();
    placed->grid = std::move(*raised);
  }
  auto lattice = place_lattice(info.grid, geometry, heights ? &*heights : nullptr);
  if (!lattice) return lattice.error();
  placed->lattice = std::move(*lattice);
  placed->ground = ground_from(info, of_heights, heights ? &*heights : nullptr, *placed);
  return std::shared_ptr<const Placed>(std::move(placed));
}

}  // namespace

Result<std::shared_ptr<const Placed>> place_dataset(const protocol::GeometryView& geometry,
                                                    data::Dataset& dataset,
                                                    const protocol::RegionView& region) {
  protocol::GeometryView unsliced = geometry;
  unsliced.slice.reset();
  unsliced.plane.reset();
  protocol::RegionView unfiltered = region;
  unfiltered.where.clear();
  const bool cropped = is_cropped(region);
  const bool keeps = is_bent(geometry) || cropped;
  std::shared_ptr<const Placed> whole;
  if (keeps) {
    const std::any any = dataset.kept(kept_key);
    const auto* kept = std::any_cast<KeptPtr>(&any);
    if (kept != nullptr && (*kept)->geometry == unsliced) {
      const std::shared_ptr<const Placed>& placed = (*kept)->placed;
      if ((*kept)->region == unfiltered) return placed;
      whole = placed->whole ? placed->whole : placed;
    }
  }
  if (!whole) {
    auto placed = place_whole(geometry, dataset);
    if (!placed) return placed.error();
    whole = std::move(*placed);
  }
  std::shared_ptr<const Placed> out = whole;
  if (cropped) {
    auto crop = crop_of(region, dataset.info().grid, whole->lattice.around);
    if (!crop) return crop.error();
    out = std::make_shared<const Placed>(cropped_place(whole, region, std::move(*crop)));
  }
  if (keeps)
    dataset.keep(kept_key, KeptPtr(std::make_shared<Kept>(Kept{unsliced, unfiltered, out})));
  return out;
}

}  // namespace windsplat::scene
