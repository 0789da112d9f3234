// Polygons are geometries of GeoJSON (RFC 7946, sections 3.1.6 and 3.1.7), without foreign members.
#include "protocol/view/codec_region.hpp"

#include <array>

#include "protocol/limits.hpp"

namespace windsplat::protocol {

namespace {

constexpr NumberRange any_coordinate{-limits::coordinate_max, limits::coordinate_max};
constexpr NumberRange filter_value{-limits::value_max, limits::value_max};
constexpr NumberRange degrees_east{-720, 720};
constexpr NumberRange degrees_north{-90, 90};
constexpr std::array<Name<FilterOf>, 3> filter_of_names{
    {{FilterOf::lines, "lines"}, {FilterOf::media, "media"}, {FilterOf::all, "all"}}};
enum class PolygonKind { one, several };
constexpr std::array<Name<PolygonKind>, 2> polygon_names{
    {{PolygonKind::one, "Polygon"}, {PolygonKind::several, "MultiPolygon"}}};

using Point = std::array<double, 2>;
using Ring = std::vector<Point>;
using Polygon = std::vector<Ring>;
constexpr std::size_t ring_points_min = 4;  // the last repeats the first

// Reads positions as long as no more than polygon_points_max were met.
class PolygonReader {
 public:
  explicit PolygonReader(Faults& faults) : faults_(faults) {}

  std::vector<Polygon> polygons(const Json& json, const std::string& pointer) {
    std::vector<Polygon> out;
    if (!is_list(json, pointer, "of polygons")) return out;
    for (std::size_t n = 0; n < json.size() && faults_.empty(); ++n) {
      out.push_back(polygon(json[n], join_pointer(pointer, n)));
    }
    return out;
  }

  Polygon polygon(const Json& json, const std::string& pointer) {
    Polygon out;
    if (!is_list(json, pointer, "of rings")) return out;
    for (std::size_t n = 0; n < json.size() && faults_.empty(); ++n) {
      out.push_back(ring(json[n], join_pointer(pointer, n)));
    }
    return out;
  }

 private:
  bool is_list(const Json& json, const std::string& pointer, const char* what) {
    if (json.is_array() && !json.empty()) return true;
    faults_.add(pointer, std::string("must be an array ") + what + " with at least one, not " +
                             (json.is_array() ? "empty" : described(json)));
    return false;
  }

  Ring ring(const Json& json, const std::string& pointer) {
    Ring out;
    if (!is_list(json, pointer, "of positions")) return out;
    points_ += json.size();
    if (points_ > limits::polygon_points_max) {
      faults_.add("/region/polygon", "must have at most " +
                                         std::to_string(limits::polygon_points_max) +
                                         " positions in all rings: simplify it");
      return out;
    }
    for (std::size_t n = 0; n < json.size(); ++n) {
      if (!position(json[n], join_pointer(pointer, n), out)) return out;
    }
    if (out.size() < ring_points_min || out.front() != out.back()) {
      faults_.add(pointer,
                  "must be a closed ring: at least 4 positions, of which the last is the first");
    }
    return out;
  }

  // A height, as a third number, is ignored.
  bool position(const Json& json, const std::string& pointer, Ring& to) {
    if (!json.is_array() || json.size() < 2 || json.size() > 3) {
      faults_.add(pointer, "must be a position: longitude and latitude, or x and y");
      return false;
    }
    Point point{};
    for (std::size_t n = 0; n < json.size(); ++n) {
      const auto read = read_number(json[n], join_pointer(pointer, n), any_coordinate, faults_);
      if (!read) return false;
      if (n < 2) point[n] = *read;
    }
    to.push_back(point);
    return true;
  }

  Faults& faults_;
  std::size_t points_ = 0;
};

std::vector<Polygon> read_polygon(const Json& json, const std::string& pointer, Faults& faults) {
  const std::size_t before = faults.count();
  PolygonKind kind = PolygonKind::one;
  ObjectReader reader(json, pointer, faults);
  reader.choice("type", kind, polygon_names, Presence::required);
  const Json* const coordinates = reader.child("coordinates", Presence::required);
  reader.finish();
  if (faults.count() > before) return {};
  Faults own;
  PolygonReader rings(own);
  const std::string at = reader.at("coordinates");
  std::vector<Polygon> out;
  if (kind == PolygonKind::several) {
    out = rings.polygons(*coordinates, at);
  } else {
    out.push_back(rings.polygon(*coordinates, at));
  }
  if (own.empty()) return out;
  for (const FieldError& one : own.error().at) faults.add(one.pointer, one.detail);
  return {};
}

FilterView read_filter(const Json& json, const std::string& pointer, Faults& faults) {
  FilterView filter;
  ObjectReader reader(json, pointer, faults);
  reader.text("field", filter.field, 1, Presence::required);
  if (reader.child("range", Presence::required) != nullptr) {
    const std::size_t before = faults.count();
    reader.numbers("range", filter.range, filter_value);
    if (faults.count() == before && filter.range[0] > filter.range[1]) {
      faults.add(reader.at("range"), "must not descend: low, high");
    }
  }
  reader.choice("of", filter.of, filter_of_names);
  reader.finish();
  return filter;
}

std::vector<FilterView> read_filters(const Json& json, const std::string& pointer, Faults& faults) {
  std::vector<FilterView> filters;
  if (!json.is_array() || json.size() > limits::filters_max) {
    faults.add(pointer,
               "must be an array of at most " + std::to_string(limits::filters_max) +
                   " filters, not " +
                   (json.is_array() ? "of " + std::to_string(json.size()) : described(json)));
    return filters;
  }
  for (std::size_t i = 0; i < json.size(); ++i) {
    filters.push_back(read_filter(json[i], join_pointer(pointer, i), faults));
  }
  return filters;
}

Json range_or_null(const std::optional<Range>& range) {
  if (!range) return nullptr;
  return Json::array({canonical_number((*range)[0]), canonical_number((*range)[1])});
}

Json polygon_json(const Polygon& polygon) {
  Json rings = Json::array();
  for (const Ring& ring : polygon) {
    Json& positions = rings.emplace_back(Json::array());
    for (const Point& p : ring) {
      positions.push_back(Json::array({canonical_number(p[0]), canonical_number(p[1])}));
    }
  }
  return rings;
}

Json polygons_json(const std::vector<Polygon>& polygons) {
  if (polygons.empty()) return nullptr;
  if (polygons.size() == 1) {
    return Json{{"type", "Polygon"}, {"coordinates", polygon_json(polygons.front())}};
  }
  Json all = Json::array();
  for (const Polygon& polygon : polygons) all.push_back(polygon_json(polygon));
  return Json{{"type", "MultiPolygon"}, {"coordinates", std::move(all)}};
}

}  // namespace

RegionView read_region(const Json& json, const std::string& pointer, Faults& faults) {
  RegionView region;
  ObjectReader reader(json, pointer, faults);
  reader.numbers("x", region.x, any_coordinate);
  reader.numbers("y", region.y, any_coordinate);
  reader.numbers("z", region.z, any_coordinate);
  reader.numbers("longitudes", region.longitudes, degrees_east);
  reader.numbers("latitudes", region.latitudes, degrees_north);
  if (const Json* where = reader.child("where")) {
    region.where = read_filters(*where, reader.at("where"), faults);
  }
  if (const Json* polygon = reader.child("polygon", Presence::optional, Null::is_default)) {
    region.polygon = read_polygon(*polygon, reader.at("polygon"), faults);
  }
  reader.finish();
  return region;
}

Json region_to_json(const RegionView& region) {
  Json where = Json::array();
  for (const FilterView& filter : region.where) {
    where.push_back({{"field", filter.field},
                     {"range", range_or_null(filter.range)},
                     {"of", name_of(filter.of, filter_of_names)}});
  }
  return Json{{"x", range_or_null(region.x)},
              {"y", range_or_null(region.y)},
              {"z", range_or_null(region.z)},
              {"longitudes", range_or_null(region.longitudes)},
              {"latitudes", range_or_null(region.latitudes)},
              {"where", std::move(where)},
              {"polygon", polygons_json(region.polygon)}};
}

}  // namespace windsplat::protocol
