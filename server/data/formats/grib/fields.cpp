// Keys of ecCodes -> Header, Grid and values, reordered by scanning mode.
#include "server/data/formats/grib/fields.hpp"

#include <eccodes.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <mutex>
#include <numeric>
#include <string_view>
#include <utility>

#include "server/data/cf/grid/cell_lists.hpp"
#include "server/data/cf/time.hpp"
#include "server/data/formats/grib/levels.hpp"
#include "server/data/formats/grib/message.hpp"
#include "server/data/formats/grib/open.hpp"
#include "server/data/formats/grib/projection.hpp"
#include "server/data/formats/grib/rows.hpp"

namespace windsplat::data::grib {

namespace {

constexpr long points_max = 1L << 28;
constexpr long rows_max = 40000;  // of a Gaussian grid

Error broken(const std::string& what) { return make_error(ErrorKind::bad_data, what); }

void say_nothing(const codes_context* /*context*/, int /*level*/, const char* /*text*/) {}

// The library caches tables between calls.
class LibraryLock {
 public:
  LibraryLock() : lock_(mutex()) {
    static const bool quiet = (codes_context_set_logging_proc(nullptr, say_nothing), true);
    static_cast<void>(quiet);
  }

 private:
  static std::mutex& mutex() {
    static std::mutex mutex;
    return mutex;
  }
  std::lock_guard<std::mutex> lock_;
};

// Longitudes ascend beyond 360 instead of wrapping to 0.
std::vector<double> longitudes(const Message& message, std::size_t count) {
  const double first = message.number("longitudeOfFirstGridPointInDegrees");
  const double last = message.number("longitudeOfLastGridPointInDegrees");
  const bool westward = message.whole("iScansNegatively", 0) != 0;
  double span = std::fmod(westward ? first - last : last - first, 360.0);
  if (span <= 0 && count > 1) span += 360;
  std::vector<double> out(count, first);
  for (std::size_t i = 1; i < count; ++i) {
    const double way = span * static_cast<double>(i) / static_cast<double>(count - 1);
    out[i] = westward ? first - way : first + way;
  }
  return out;
}

std::vector<double> longitudes_around(std::size_t count) {
  std::vector<double> out(count);
  for (std::size_t i = 0; i < count; ++i) {
    out[i] = 360 * static_cast<double>(i) / static_cast<double>(count);
  }
  return out;
}

std::vector<double> even_latitudes(const Message& message, std::size_t count) {
  const double first = message.number("latitudeOfFirstGridPointInDegrees");
  const double last = message.number("latitudeOfLastGridPointInDegrees");
  std::vector<double> out(count, first);
  for (std::size_t j = 1; j < count; ++j) {
    out[j] = first + (last - first) * static_cast<double>(j) / static_cast<double>(count - 1);
  }
  return out;
}

// Computing the latitudes takes time of second order: 1.5 s for 8000. IFS has up to 4000.
constexpr long gaussian_number_max = 8000;

// A contiguous range of Gaussian latitudes, whose ends are stored to a thousandth of a degree.
std::vector<double> gaussian_latitudes(const Message& message, std::size_t count) {
  const long number = message.whole("N", 0);
  if (number < 1 || number > gaussian_number_max || count > static_cast<std::size_t>(2 * number))
    return {};
  std::vector<double> all(static_cast<std::size_t>(2 * number));
  if (codes_get_gaussian_latitudes(number, all.data()) != CODES_SUCCESS) return {};
  const double first = message.number("latitudeOfFirstGridPointInDegrees");
  const double last = message.number("latitudeOfLastGridPointInDegrees");
  if (first < last) std::reverse(all.begin(), all.end());
  for (std::size_t from = 0; from + count <= all.size(); ++from) {
    if (std::abs(all[from] - first) < 2e-3 && std::abs(all[from + count - 1] - last) < 2e-3) {
      const auto begin = all.begin() + static_cast<std::ptrdiff_t>(from);
      return {begin, begin + static_cast<std::ptrdiff_t>(count)};
    }
  }
  return {};
}

bool has_axes(const Grid& grid) { return grid.type.ends_with("_ll") || grid.type.ends_with("_gg"); }

bool is_reduced(const Grid& grid) { return grid.type.starts_with("reduced_"); }

std::size_t points_of(const std::vector<std::size_t>& row_lengths) {
  return std::accumulate(row_lengths.begin(), row_lengths.end(), std::size_t{0});
}

void find_coordinates(const Message& message, Grid& grid) {
  if (has_axes(grid)) {
    grid.longitude =
        is_reduced(grid) ? longitudes_around(grid.columns) : longitudes(message, grid.columns);
    grid.latitude = grid.type.ends_with("_ll") ? even_latitudes(message, grid.rows)
                                               : gaussian_latitudes(message, grid.rows);
  } else {
    find_projection(message, grid);
    return;
  }
  const auto finite = [](const std::vector<double>& list) {
    return !list.empty() &&
           std::all_of(list.begin(), list.end(), [](double v) { return std::isfinite(v); });
  };
  const bool is_gaussian = grid.type.ends_with("_gg");
  if (is_gaussian && message.whole("N", 0) > gaussian_number_max) {
    grid.problem = "on a Gaussian grid of more than " + std::to_string(gaussian_number_max) +
                   " rows between pole and equator";
  } else if (!finite(grid.longitude) || !finite(grid.latitude)) {
    grid.problem = "on a grid for which ecCodes has no coordinates: " + in_quotes(grid.type);
  }
}

constexpr std::string_view list_type = "unstructured_grid";

// Template 3.101: the number of values is that of cells. ICON lists cells as 1, vertices as 2 and
// edges as 3 of a grid; NEMO's points beside T have other numbers than 1 too.
void find_list(const Message& message, Grid& grid) {
  const long points = message.whole("numberOfDataPoints", -1);
  const long list = message.whole("numberOfGridInReference", -1);
  if (points < 1 || points > points_max) {
    grid.problem = "on an unstructured grid without cells, or with too many";
    return;
  }
  grid.is_list = true;
  grid.columns = static_cast<std::size_t>(points);
  grid.rows = 1;
  grid.uuid = cf::known_grid_uuid(message.text("uuidOfHGrid"));
  if (list != 1) {
    grid.problem = "at the points of the list " + std::to_string(list) +
                   " of an unstructured grid, such as its vertices (2) and edges (3) in ICON: only "
                   "values at cells (1) are drawn";
  }
}

// Why grids of a type cannot be read; empty if they can.
std::string why_unsupported(const std::string& type) {
  constexpr auto supported = std::to_array<std::string_view>(
      {list_type, "regular_ll", "regular_gg", "rotated_ll", "rotated_gg", "reduced_gg",
       "reduced_rotated_gg", "albers", "lambert", "lambert_azimuthal_equal_area", "mercator",
       "polar_stereographic", "transverse_mercator"});
  if (std::find(supported.begin(), supported.end(), type) != supported.end()) return {};
  std::string_view what;
  std::string_view advice = "interpolate it to longitudes and latitudes first";
  if (type == "sh") {
    what = " (spherical harmonics)";
    advice = "transform it first, for example with cdo sp2gp";
  } else if (type == "space_view") {
    what = " (as seen from a satellite)";
  }
  return "on a grid of the type " + in_quotes(type) + std::string(what) +
         ", which is not supported: " + std::string(advice);
}

// Why the rows of a reduced Gaussian grid cannot be interpolated; empty if they can. The amount of
// memory is bounded: octahedral grids need twice as many samples as points.
std::string problem_of_rows(const Message& message, const Grid& grid) {
  if (message.whole("iScansNegatively", 0) != 0 || message.whole("jPointsAreConsecutive", 0) != 0 ||
      message.whole("alternativeRowScanning", 0) != 0) {
    return "on a reduced grid that is not scanned row by row to the east";
  }
  constexpr std::size_t samples_per_point_max = 8;
  if (grid.rows * grid.columns > samples_per_point_max * points_of(grid.row_lengths)) {
    return "on a reduced grid whose rows have too different numbers of points";
  }
  const double first = message.number("longitudeOfFirstGridPointInDegrees");
  const double last = message.number("longitudeOfLastGridPointInDegrees");
  const double spacing = 360.0 / static_cast<double>(grid.columns);
  if (grid.rows == static_cast<std::size_t>(2 * message.whole("N", 0)) && std::abs(first) < 1e-3 &&
      last > 360 - 1.5 * spacing) {
    return {};
  }
  return "on a part of a reduced Gaussian grid, which is not supported (the whole globe is)";
}

// ecCodes divides by the length of the time unit, which it defines for these units only.
bool has_known_time_unit(const Message& message) {
  constexpr auto units = std::to_array<long>({-1, 0, 1, 2, 3, 10, 11, 12, 13, 14, 254});
  const long unit = message.whole("indicatorOfUnitOfTimeRange", -1);
  return std::find(units.begin(), units.end(), unit) != units.end();
}

double hours_of_validity(const Message& message) {
  if (!has_known_time_unit(message)) return std::numeric_limits<double>::quiet_NaN();
  return hours_of(message.whole("validityDate", -1), message.whole("validityTime", -1));
}

// Flag table 3.3, bit 5 (edition 1: table 7): components along rows and columns. For some templates
// ecCodes has only the octet instead of a key.
bool is_along_grid(const Message& message) {
  const long along = message.whole("uvRelativeToGrid", -1);
  if (along >= 0) return along != 0;
  return (message.whole("resolutionAndComponentFlags", 0) & 8) != 0;
}

std::string known(const std::string& text) { return text == "unknown" || text == "~" ? "" : text; }

}  // namespace

double hours_of(long date, long time) {
  const cf::Date day{date / 10000, static_cast<int>(date / 100 % 100),
                     static_cast<int>(date % 100)};
  constexpr auto calendar = cf::Calendar::proleptic_gregorian;
  if (date < 0 || time < 0 || time > 2400 || !cf::is_valid(day, calendar)) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const auto days = cf::day_number(day, calendar) - cf::day_number({1970, 1, 1}, calendar);
  const auto minutes = time / 100 * 60 + time % 100;
  return static_cast<double>(days) * 24 + static_cast<double>(minutes) / 60;
}

std::string definitions_folder() {
  const LibraryLock lock;
  char* const path = codes_definition_path(nullptr);
  return path == nullptr ? "" : path;
}

Result<Header> read_header(const std::vector<unsigned char>& bytes) {
  const LibraryLock lock;
  const Message message(bytes);
  if (message.handle() == nullptr) return broken("is not understood by ecCodes");
  Header out;
  out.short_name = known(message.text("shortName"));
  if (out.short_name.empty()) out.short_name = "param" + message.text("paramId");
  if (out.short_name == "param" || out.short_name == "param0") {
    out.short_name = "param_" + message.text("discipline") + "_" +
                     message.text("parameterCategory") + "_" + message.text("parameterNumber");
  }
  const Level level = read_level(message);
  out.level_type = level.type;
  out.level = level.value;
  out.hours = hours_of_validity(message);
  out.reference = hours_of(message.whole("dataDate", -1), message.whole("dataTime", -1));
  out.member = static_cast<double>(message.whole("perturbationNumber", 0));
  out.relative_to_grid = is_along_grid(message);
  out.product = read_product(message);
  out.grid_key = message.text("md5GridSection");
  if (!std::isfinite(out.level)) return broken("has no level");
  if (!std::isfinite(out.hours) || !std::isfinite(out.reference))
    return broken("has no date of validity");
  return out;
}

Result<Names> read_names(const std::vector<unsigned char>& bytes) {
  const LibraryLock lock;
  const Message message(bytes);
  if (message.handle() == nullptr) return broken("is not understood by ecCodes");
  return Names{known(message.text("name")), known(message.text("cfName")),
               known(message.text("units"))};
}

Result<Grid> read_grid(const std::vector<unsigned char>& bytes) {
  const LibraryLock lock;
  const Message message(bytes);
  if (message.handle() == nullptr) return broken("is not understood by ecCodes");
  Grid grid;
  grid.type = message.text("gridType");
  grid.problem = why_unsupported(grid.type);
  if (!grid.problem.empty()) return grid;
  if (grid.type == list_type) {
    find_list(message, grid);
    return grid;
  }
  const long rows = message.whole(has_axes(grid) ? "Nj" : "Ny", -1);
  long columns = -1;
  long points = -1;
  if (!is_reduced(grid)) {
    columns = message.whole(has_axes(grid) ? "Ni" : "Nx", -1);
    points = rows < 1 || columns > points_max / rows ? -1 : columns * rows;
  } else if (rows >= 1 && rows <= rows_max) {
    const auto& lengths = grid.row_lengths = message.counts("pl", static_cast<std::size_t>(rows));
    for (const std::size_t length : lengths) columns = std::max(columns, static_cast<long>(length));
    points = static_cast<long>(points_of(lengths));
  }
  const std::string inconsistent =
      "on a grid with inconsistent numbers of rows, columns and points";
  if (columns < 1 || rows < 1 || columns > points_max / rows) {
    grid.problem = inconsistent;
    return grid;
  }
  grid.columns = static_cast<std::size_t>(columns);
  grid.rows = static_cast<std::size_t>(rows);
  if (is_reduced(grid)) grid.problem = problem_of_rows(message, grid);
  if (grid.problem.empty() && message.whole("numberOfDataPoints", -1) != points) {
    grid.problem = inconsistent;
  }
  grid.rotated = grid.type.find("rotated") != std::string::npos;
  if (grid.rotated) {
    grid.mapping.texts["grid_mapping_name"] = "rotated_latitude_longitude";
    grid.mapping.numbers["grid_north_pole_latitude"] = {
        -message.number("latitudeOfSouthernPoleInDegrees")};
    grid.mapping.numbers["grid_north_pole_longitude"] = {
        message.number("longitudeOfSouthernPoleInDegrees") + 180};
    if (message.number("angleOfRotationInDegrees") != 0) {
      grid.problem = "on a rotated grid that is also turned about its pole, which is not supported";
    }
  }
  if (grid.problem.empty()) find_coordinates(message, grid);
  return grid;
}

Result<std::vector<double>> read_coefficients(const std::vector<unsigned char>& bytes) {
  constexpr std::size_t coefficients_max = 4096;
  const LibraryLock lock;
  const Message message(bytes);
  if (message.handle() == nullptr) return broken("is not understood by ecCodes");
  std::size_t count = 0;
  if (message.whole("PVPresent", 0) == 0 ||
      codes_get_size(message.handle(), "pv", &count) != CODES_SUCCESS || count > coefficients_max) {
    return std::vector<double>();
  }
  return message.numbers("pv", count);
}

Result<std::vector<float>> read_values(const std::vector<unsigned char>& bytes, const Grid& grid) {
  const LibraryLock lock;
  const Message message(bytes);
  if (message.handle() == nullptr) return broken("is not understood by ecCodes");
  constexpr double missing = -1e300;
  const bool reduced = is_reduced(grid);
  const std::size_t points = reduced ? points_of(grid.row_lengths) : grid.rows * grid.columns;
  if (message.whole("numberOfDataPoints", -1) != static_cast<long>(points) ||
      codes_set_double(message.handle(), "missingValue", missing) != CODES_SUCCESS) {
    return broken("has a number of values different from its grid");
  }
  const std::vector<double> values = message.numbers("values", points);
  if (values.empty()) return broken("has no values that ecCodes can decode");
  const bool by_columns = !reduced && message.whole("jPointsAreConsecutive", 0) != 0;
  const bool alternating = !reduced && message.whole("alternativeRowScanning", 0) != 0;
  const std::size_t run = by_columns ? grid.rows : grid.columns;
  std::vector<float> out(values.size());
  for (std::size_t k = 0; k < values.size(); ++k) {
    const std::size_t slow = k / run;
    const std::size_t fast = alternating && slow % 2 == 1 ? run - 1 - k % run : k % run;
    const bool fits = std::abs(values[k]) <= static_cast<double>(std::numeric_limits<float>::max());
    out[by_columns ? fast * grid.columns + slow : slow * grid.columns + fast] =
        fits ? static_cast<float>(values[k]) : std::numeric_limits<float>::quiet_NaN();
  }
  return reduced ? equal_rows(out, grid.row_lengths, grid.columns) : out;
}

}  // namespace windsplat::data::grib
