// A position -> the nearest sample, with the heights of a view.
#include "server/api/measure/positions.hpp"

#include <charconv>
#include <string_view>
#include <utility>

#include "server/api/operations/parameters.hpp"
#include "server/scene/bend.hpp"
#include "server/scene/place.hpp"

namespace windsplat::api {

Result<std::shared_ptr<const data::Volume>> load_field(tasks::Catalogue& catalogue,
                                                       const data::Dataset& dataset,
                                                       const std::string& field, std::size_t step,
                                                       const CancelToken& cancel) {
  auto volume = catalogue.load(
      dataset, [&](data::Dataset& loading) { return loading.volume(field, step); }, cancel);
  if (!volume)
    return tasks::with_dataset_name(dataset.with_need(volume.error(), {field}), dataset.info().id,
                                    field);
  return volume;
}

Result<std::shared_ptr<const data::Volume>> load_part(tasks::Catalogue& catalogue,
                                                      const data::Dataset& dataset,
                                                      const std::string& field, std::size_t step,
                                                      const data::Box& box,
                                                      const CancelToken& cancel) {
  auto part = catalogue.load(
      dataset, [&](data::Dataset& loading) { return loading.part(field, step, box); }, cancel);
  if (!part) return tasks::with_dataset_name(part.error(), dataset.info().id, field);
  return part;
}

Result<Nearby> load_nearby(tasks::Catalogue& catalogue, const data::Dataset& dataset,
                           const std::string& field, std::size_t step,
                           const std::array<int, 3>& index, const CancelToken& cancel) {
  const data::FieldInfo* const found = dataset.info().find(field);
  if (found != nullptr && found->is_read_by_boxes()) {
    const data::Box box = data::box_around(index, *found, dataset.info().grid.dims());
    if (dataset.reads_apart(field, step, {box})) {
      auto part = load_part(catalogue, dataset, field, step, box, cancel);
      if (!part) return part.error();
      return Nearby{std::move(*part), box.first};
    }
  }
  auto whole = load_field(catalogue, dataset, field, step, cancel);
  if (!whole) return whole.error();
  return Nearby{std::move(*whole), {}};
}

std::optional<std::vector<double>> Nearby::value_at(const std::array<int, 3>& index) const {
  return data::value_at(*volume, {index[0] - first[0], index[1] - first[1], index[2] - first[2]});
}

namespace {

struct PlaceQuery {
  std::array<std::optional<double>, 3> axes;        // x, y, z
  std::array<std::optional<double>, 3> geographic;  // lon, lat, level
};
constexpr std::array<std::string_view, 3> axis_names{"x", "y", "z"};
constexpr std::array<std::string_view, 3> geographic_names{"lon", "lat", "level"};

PlaceQuery read_place(http::QueryReader& query) {
  return {{read_number(query, parameters::x), read_number(query, parameters::y),
           read_number(query, parameters::z)},
          {read_number(query, parameters::longitude), read_number(query, parameters::latitude),
           read_number(query, parameters::level)}};
}

bool is_given(const std::array<std::optional<double>, 3>& place) {
  return place[0] || place[1] || place[2];
}

std::string described(const data::Axis& axis) {
  std::string text = "'" + printable(axis.name, 60) + "'";
  if (!axis.units.empty()) text += " in " + printable(axis.units, 40);
  return text;
}

// lon, lat and level are x, y and z of data whose columns have longitude and latitude. Errors:
// invalid, also if both are given.
Result<std::array<std::optional<double>, 3>> place_along_axes(const PlaceQuery& place,
                                                              const data::Grid& grid,
                                                              bool has_heights) {
  const auto refuse = [](const std::string& why) { return make_error(ErrorKind::invalid, why); };
  auto out = place.axes;
  for (std::size_t a = 0; a < 3; ++a) {
    if (!place.geographic.at(a)) continue;
    if (out.at(a)) {
      return refuse("query parameters '" + std::string(axis_names.at(a)) + "' and '" +
                    std::string(geographic_names.at(a)) + "' are mutually exclusive");
    }
    out.at(a) = place.geographic.at(a);
  }
  if ((place.geographic[0] || place.geographic[1]) && !is_geographic(grid)) {
    return refuse(
        "query parameters 'lon' and 'lat': the data have no longitudes and latitudes; "
        "their axes are " +
        described(grid.axes[0]) + " and " + described(grid.axes[1]) +
        ", of which 'x' and 'y' are coordinates");
  }
  for (std::size_t a = 0; a < 2; ++a) {
    const bool is_needed = grid.columns || grid.axes.at(a).coordinates.size() > 1;
    if (!place.geographic.at(1 - a) || out.at(a) || !is_needed) continue;
    return refuse("query parameter '" + std::string(geographic_names.at(a)) +
                  "' is required beside '" + std::string(geographic_names.at(1 - a)) + "'");
  }
  if (place.geographic[2] && has_heights) {
    return refuse(
        "query parameter 'level' is a coordinate of the vertical axis; with "
        "'heightField' the height is 'z'");
  }
  return out;
}

// "i,j,k"
std::optional<std::array<int, 3>> indices_in(std::string_view text) {
  std::array<int, 3> out{};
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t a = 0; a < out.size(); ++a) {
    if (a > 0 && (at == end || *at++ != ',')) return std::nullopt;
    const auto [rest, fault] = std::from_chars(at, end, out.at(a));
    if (fault != std::errc()) return std::nullopt;
    at = rest;
  }
  return at == end ? std::optional(out) : std::nullopt;
}

}  // namespace

bool is_geographic(const data::Grid& grid) {
  const auto& [x, y, z] = grid.axes;
  return grid.columns || (x.kind == data::AxisKind::longitude && !x.units.starts_with("rad") &&
                          y.kind == data::AxisKind::latitude && !y.units.starts_with("rad"));
}

Result<Position> read_position(http::QueryReader& query, const data::Grid& grid) {
  const PlaceQuery place = read_place(query);
  Position out{{}, {}, read_text(query, parameters::height_field)};
  const auto index = read_text(query, parameters::index);
  if (!index) {
    const auto at = place_along_axes(place, grid, out.height_field.has_value());
    if (!at) return at.error();
    out.at = *at;
    return out;
  }
  if (is_given(place.axes) || is_given(place.geographic)) {
    return make_error(ErrorKind::invalid,
                      "query parameters 'index' and those of coordinates are mutually exclusive");
  }
  out.index = indices_in(*index);
  if (!out.index) {
    return make_error(ErrorKind::malformed, "query parameter 'index' must be three integers i,j,k");
  }
  for (std::size_t a = 0; a < 3; ++a) {
    if (out.index->at(a) >= 0 && out.index->at(a) < grid.dims().at(a)) continue;
    return make_error(ErrorKind::invalid, "query parameter 'index' must be below " +
                                              std::to_string(grid.dims().at(a)) + " along " +
                                              "xyz"[a] + " and not negative");
  }
  return out;
}

namespace {

// The place of a sample.
data::Place place_of(const data::Grid& grid, const std::array<int, 3>& index) {
  data::Place out{index, {}};
  for (std::size_t a = 0; a < 3; ++a) {
    out.coordinates.at(a) = grid.axes.at(a).coordinates.at(static_cast<std::size_t>(index.at(a)));
  }
  if (grid.columns) {
    const auto column =
        static_cast<std::size_t>(index[1]) * static_cast<std::size_t>(grid.dims()[0]) +
        static_cast<std::size_t>(index[0]);
    out.coordinates[0] = grid.columns->longitude.at(column);
    out.coordinates[1] = grid.columns->latitude.at(column);
  }
  return out;
}

// Errors: invalid if it has no height.
Result<data::Place> place_of(const data::Grid& grid, const std::array<int, 3>& index,
                             const std::optional<data::SampleHeights>& heights) {
  data::Place out = place_of(grid, index);
  if (!heights) return out;
  const auto height = data::value_at(*heights->values, index);
  if (!height) return make_error(ErrorKind::invalid, "the sample has no height");
  out.coordinates[2] = height->front();
  return out;
}

// The heights of the first step, at which views place samples. Errors: those of the view for what
// are no heights.
Result<std::optional<data::SampleHeights>> heights_for(tasks::Catalogue& catalogue,
                                                       const data::Dataset& dataset,
                                                       const Position& position,
                                                       const CancelToken& cancel) {
  if (!position.height_field) return std::optional<data::SampleHeights>();
  const auto field =
      scene::find_field(dataset.info(), *position.height_field, data::FieldKind::scalar, "");
  const auto refused = [](const Error& error) {
    return make_error(error.kind, "query parameter 'heightField': " + error.message);
  };
  if (!field) return refused(field.error());
  auto values = load_field(catalogue, dataset, (*field)->name, 0, cancel);
  if (!values) return values.error();
  const scene::Heights heights{(*field)->name, (*field)->units, *values};
  const auto raised = scene::grid_with_heights(dataset.info().grid, heights);
  if (!raised) return refused(raised.error());
  return std::optional(data::SampleHeights{std::move(*values), (*field)->units});
}

protocol::PositionDescription describe(const data::Place& place, const data::Grid& grid) {
  protocol::PositionDescription out;
  out.index = place.index;
  out.coordinates = place.coordinates;
  for (std::size_t a = 0; a < 3; ++a) out.units[a] = grid.axes[a].units;
  if (grid.columns) {
    out.units[0] = "degrees_east";
    out.units[1] = "degrees_north";
  }
  return out;
}

}  // namespace

protocol::PositionDescription position_of(const data::Grid& grid, const std::array<int, 3>& index) {
  return describe(place_of(grid, index), grid);
}

Result<Located> locate(tasks::Catalogue& catalogue, const data::Dataset& dataset,
                       const Position& position, const CancelToken& cancel) {
  const data::Grid& grid = dataset.info().grid;
  const auto heights = heights_for(catalogue, dataset, position, cancel);
  if (!heights) return heights.error();
  const auto place = position.index
                         ? place_of(grid, *position.index, *heights)
                         : data::nearest_sample(grid, position.at, *heights ? &**heights : nullptr);
  if (!place) return place.error();
  Located out{*place, describe(*place, grid)};
  if (*heights) out.position.units[2] = (*heights)->units;
  return out;
}

}  // namespace windsplat::api
