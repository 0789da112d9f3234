#include "server/scene/place.hpp"

#include <algorithm>
#include <any>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/scene/bend.hpp"
#include "server/scene/lattice.hpp"
#include "server/scene/refusal.hpp"
#include "server/terrain/lower_boundary.hpp"

namespace windsplat::scene {

namespace {

// The cache entry of a dataset: a placement with the parameters that determine it.
struct Kept {
  protocol::GeometryView geometry;  // without slice, plane and body, which do not change
                                    // positions
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

bool has_terrain(const protocol::GeometryView& geometry, const data::DatasetInfo& info) {
  return geometry.height_field && info.grid.axes[2].kind != data::AxisKind::pressure;
}

namespace {

// Whether the heights of the vertices (on a globe: their radii) differ by more than the rounding of
// positions in floats.
bool has_relief(const terrain::Terrain& terrain) {
  constexpr double rounding = 1e-5;
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  double most = 0;
  for (int y = 0; y < terrain.height(); ++y) {
    for (int x = 0; x < terrain.width(); ++x) {
      const glm::dvec3 at = terrain.vertex(x, y);
      const double height = terrain.base() == terrain::Base::globe ? glm::length(at) : at.z;
      low = std::min(low, height);
      high = std::max(high, height);
      most = std::max(most, glm::length(at));
    }
  }
  return high - low > rounding * most;
}

}  // namespace

std::shared_ptr<const terrain::Terrain> terrain_of(const protocol::GeometryView& geometry,
                                                   const Placed& placed) {
  LazyTerrain& lazy = *placed.terrain;
  std::call_once(lazy.once, [&] {
    const Lattice& lattice = placed.lattice;
    const auto mean = [&lattice](std::size_t a) { return cell_size(lattice, a); };
    const bool sphere = geometry.mapping == protocol::GeometryMapping::sphere;
    lazy.made = terrain::lower_boundary(
        {*lattice.places, lattice.dims, {mean(0), mean(1), mean(2)}, lattice.around},
        sphere ? terrain::Base::globe : terrain::Base::map);
    if (!has_relief(*lazy.made)) lazy.made.reset();
  });
  return lazy.made;
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
  return Slice{static_cast<int>(geometry.slice->axis),
               static_cast<int>(std::lround(geometry.slice->index))};
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

Result<std::shared_ptr<const Placed>> place_dataset(const protocol::GeometryView& geometry,
                                                    data::Dataset& dataset) {
  const data::DatasetInfo& info = dataset.info();
  const bool bent = is_bent(geometry);
  protocol::GeometryView unsliced = geometry;
  unsliced.slice.reset();
  unsliced.plane.reset();
  unsliced.body = {};
  if (bent) {
    const std::any any = dataset.kept(kept_key);
    const auto* kept = std::any_cast<KeptPtr>(&any);
    if (kept != nullptr && (*kept)->geometry == unsliced) return (*kept)->placed;
  }
  auto placed = std::make_shared<Placed>();
  placed->grid = info.grid;
  std::optional<Heights> heights;
  if (geometry.height_field) {
    auto field =
        find_field(info, *geometry.height_field, data::FieldKind::scalar, "/geometry/heightField");
    if (!field) return field.error();
    auto values = dataset.volume(*geometry.height_field, 0);
    if (!values) return values.error();
    heights = Heights{(*field)->name, (*field)->units, std::move(*values)};
    auto raised = grid_with_heights(info.grid, *heights);
    if (!raised) return raised.error();
    placed->grid = std::move(*raised);
  }
  auto lattice = place_lattice(info.grid, geometry, heights ? &*heights : nullptr);
  if (!lattice) return lattice.error();
  placed->lattice = std::move(*lattice);
  std::shared_ptr<const Placed> out = std::move(placed);
  if (bent) dataset.keep(kept_key, KeptPtr(std::make_shared<Kept>(Kept{unsliced, out})));
  return out;
}

}  // namespace windsplat::scene
