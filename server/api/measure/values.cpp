// Values of a field in a box, thinned: query -> samples of the grid -> an array in NPY, or what it
// has as JSON.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "protocol/limits.hpp"
#include "server/api/ascii_json.hpp"
#include "server/api/measure/positions.hpp"
#include "server/api/measure/selection.hpp"
#include "server/api/measure/subject.hpp"
#include "server/api/operations/parameters.hpp"
#include "server/api/resources.hpp"
#include "server/base/npy_head.hpp"
#include "server/http/gzip.hpp"
#include "server/http/negotiate.hpp"
#include "server/http/problem.hpp"
#include "server/scene/region/select.hpp"

namespace windsplat::api {
namespace {

namespace limits = protocol::limits;

constexpr int stride_max = 1'000'000;
constexpr double level_rounding = 1e-6;  // of single precision, relative
constexpr double turn_degrees = 360;

Error refuse_values(std::string_view parameter, const std::string& why) {
  return make_error(ErrorKind::invalid, "query parameter '" + std::string(parameter) + '\'' + why);
}

std::optional<std::vector<double>> numbers_in(std::string_view text) {
  std::vector<double> out;
  for (const std::string_view part : http::split_list(text, ',')) {
    double value = 0;
    const char* const end = part.data() + part.size();
    const auto [stop, fault] = std::from_chars(part.data(), end, value);
    if (fault != std::errc() || stop != end || !(std::abs(value) <= limits::coordinate_max)) {
      return std::nullopt;
    }
    out.push_back(value);
  }
  return out;
}

// The parameters of a query; their meaning follows from the grid.
struct ValuesQuery {
  std::optional<std::array<double, 4>> box;  // west, south, east, north
  std::vector<double> levels;                // none, one, or the ends of a range
  std::array<int, 3> stride{1, 1, 1};        // x, y, z
  std::size_t step = 0;
};

Result<std::vector<double>> read_numbers(const std::optional<std::string>& text,
                                         std::string_view parameter, std::size_t least,
                                         std::size_t most, const char* form) {
  if (!text) return std::vector<double>{};
  auto out = numbers_in(*text);
  if (out && out->size() >= least && out->size() <= most) return std::move(*out);
  return make_error(ErrorKind::malformed, "query parameter '" + std::string(parameter) +
                                              "' must be " + form + ", not " +
                                              printable(*text, 80));
}

Result<std::array<int, 3>> strides_of(const std::vector<double>& given) {
  std::array<int, 3> out{1, 1, 1};
  for (std::size_t n = 0; n < given.size(); ++n) {
    if (!(given[n] >= 1 && given[n] <= stride_max) || given[n] != std::floor(given[n])) {
      return refuse_values("stride", " must be integers from 1 to " + std::to_string(stride_max));
    }
    out.at(n) = static_cast<int>(given[n]);
  }
  if (given.size() == 1) out[1] = out[0];
  return out;
}

Result<ValuesQuery> read_asked(http::QueryReader& query, const data::Dataset& dataset) {
  ValuesQuery out;
  const auto box_text = read_text(query, parameters::box);
  const auto level_text = read_text(query, parameters::levels);
  const auto stride_text = read_text(query, parameters::stride);
  const auto step = read_step(query, dataset);
  if (const auto ok = query.finish(); !ok) return ok.error();
  const auto box = read_numbers(box_text, "bbox", 4, 4, "four numbers west,south,east,north");
  if (!box) return box.error();
  auto levels = read_numbers(level_text, "level", 1, 2, "a number, or two as a range");
  if (!levels) return levels.error();
  const auto stride = read_numbers(stride_text, "stride", 1, 3, "one to three integers x,y,z");
  if (!stride) return stride.error();
  if (!box->empty()) out.box = {(*box)[0], (*box)[1], (*box)[2], (*box)[3]};
  out.levels = std::move(*levels);
  const auto strides = strides_of(*stride);
  if (!strides) return strides.error();
  out.stride = *strides;
  if (!step) return step.error();
  out.step = *step;
  return out;
}

std::string coordinate_text(double value) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.9g", value);
  return text.data();
}

// The samples along the vertical axis. Errors: invalid, with the levels around a missing one.
Result<std::array<int, 2>> levels_of(const ValuesQuery& asked, const data::Axis& axis) {
  const std::vector<double>& at = axis.coordinates;
  if (asked.levels.empty()) return std::array{0, static_cast<int>(at.size())};
  const auto [low, high] = std::minmax(asked.levels.front(), asked.levels.back());
  const double margin = level_rounding * std::max(std::abs(low), std::abs(high));
  int first = -1;
  int count = 0;
  const double* below = nullptr;
  const double* above = nullptr;
  for (std::size_t n = 0; n < at.size(); ++n) {
    const double value = at[n];
    if (value >= low - margin && value <= high + margin) {
      if (count++ == 0) first = static_cast<int>(n);
    } else if (value < low) {
      if (below == nullptr || value > *below) below = &at[n];
    } else if (above == nullptr || value < *above) {
      above = &at[n];
    }
  }
  if (count > 0) return std::array{first, count};
  std::string text = " holds no level of axis '" + printable(axis.name, 60) + "'; next to it ";
  if (below != nullptr) text += coordinate_text(*below);
  if (below != nullptr && above != nullptr) text += " and ";
  if (above != nullptr) text += coordinate_text(*above);
  return refuse_values("level", text + ' ' + printable(axis.units, 40));
}

// The columns of the box. Errors: invalid.
Result<scene::Crop> columns_of(const ValuesQuery& asked, const data::Grid& grid) {
  protocol::RegionView region;
  if (asked.box) {
    const auto [west, south, east, north] = *asked.box;
    if (south > north) return refuse_values("bbox", " has a south beyond its north");
    const bool round = grid.columns || grid.axes[0].kind == data::AxisKind::longitude;
    if (west > east && !round) {
      return refuse_values("bbox", " has a west beyond its east, which only longitudes may have");
    }
    (grid.columns ? region.longitudes : region.x) = protocol::Range{west, east};
    (grid.columns ? region.latitudes : region.y) = protocol::Range{south, north};
  }
  auto crop = scene::crop_of(region, grid, 0);
  if (crop) return crop;
  const Error& error = crop.error();
  return refuse_values("bbox", ": " + (error.at.empty() ? error.message : error.at.front().detail));
}

Result<void> check_size(const Selection& selection) {
  const std::uint64_t bytes = std::uint64_t{sizeof(float)} * selection.values();
  if (bytes <= protocol::limits::values_bytes_max) return {};
  const auto& n = selection.count;
  const std::string parts =
      selection.components > 1 ? std::to_string(selection.components) + " x " : "";
  return make_error(ErrorKind::invalid, "the array of " + parts + std::to_string(n[2]) + " x " +
                                            std::to_string(n[1]) + " x " + std::to_string(n[0]) +
                                            " values has " + std::to_string(bytes) +
                                            " bytes, above the limit of " +
                                            std::to_string(protocol::limits::values_bytes_max) +
                                            "; reduce it by bbox, level or stride");
}

Result<Selection> select_samples(const ValuesQuery& asked, const Subject& subject) {
  const data::DatasetInfo& info = subject.dataset->info();
  Selection out;
  auto crop = columns_of(asked, info.grid);
  if (!crop) return crop.error();
  out.crop = std::move(*crop);
  const auto levels = levels_of(asked, info.grid.axes[2]);
  if (!levels) return levels.error();
  out.crop.first[2] = (*levels)[0];
  out.crop.count[2] = (*levels)[1];
  out.stride = asked.stride;
  for (std::size_t a = 0; a < 3; ++a) {
    const int taken = (out.crop.count.at(a) - 1) / out.stride.at(a) + 1;
    out.count.at(a) = static_cast<std::size_t>(taken);
  }
  out.one_level = asked.levels.size() == 1 || info.grid.axes[2].coordinates.size() == 1;
  out.components = subject.field.components.size();
  out.step = asked.step;
  if (const auto ok = check_size(out); !ok) return ok.error();
  return out;
}

// Longitudes count on by 360 degrees across the seam.
std::vector<double> coordinates_of(const data::Axis& axis, std::size_t which,
                                   const Selection& selection) {
  std::vector<double> out;
  out.reserve(selection.count.at(which));
  const int turn = which == 0 ? selection.crop.turn : 0;
  for (std::size_t n = 0; n < selection.count.at(which); ++n) {
    const int at =
        selection.crop.first.at(which) + static_cast<int>(n) * selection.stride.at(which);
    const int inside = turn > 0 ? at % turn : at;
    const int turns = turn > 0 ? at / turn : 0;
    out.push_back(axis.coordinates[static_cast<std::size_t>(inside)] + turn_degrees * turns);
  }
  return out;
}

// The same longitudes, of which the first is the next one east of `west`.
void count_from(double west, std::vector<double>& longitudes) {
  constexpr double rounding = 1e-6;  // of a turn: a first sample at `west` stays there
  const double turns = std::ceil((west - longitudes.front()) / turn_degrees - rounding);
  for (double& longitude : longitudes) longitude += turn_degrees * turns;
}

protocol::ValuesDescription describe_values(const ValuesQuery& asked, const Subject& subject,
                                            const Selection& selection) {
  const data::DatasetInfo& info = subject.dataset->info();
  protocol::ValuesDescription out;
  out.field = probed_field(subject.field);
  out.step = static_cast<int>(selection.step);
  out.time = {info.steps[selection.step].value, info.steps[selection.step].text};
  if (selection.components > 1) {
    out.dims.emplace_back("component");
    out.shape.push_back(selection.components);
  }
  if (!selection.one_level) {
    out.dims.emplace_back("z");
    out.shape.push_back(selection.count[2]);
  }
  out.dims.insert(out.dims.end(), {"y", "x"});
  out.shape.insert(out.shape.end(), {selection.count[1], selection.count[0]});
  for (std::size_t a = 0; a < 3; ++a) {
    const data::Axis& axis = info.grid.axes.at(a);
    out.axes.at(a) = {axis.name, axis.units, selection.crop.first.at(a), selection.stride.at(a),
                      coordinates_of(axis, a, selection)};
  }
  if (asked.box && !info.grid.columns && is_geographic(info.grid)) {
    count_from((*asked.box)[0], out.axes[0].coordinates);
  }
  out.turn = selection.crop.turn;
  return out;
}

void add_columns(const data::Columns& columns, int width, const Selection& selection,
                 protocol::ValuesDescription& out) {
  for (std::size_t j = 0; j < selection.count[1]; ++j) {
    for (std::size_t i = 0; i < selection.count[0]; ++i) {
      const auto y = static_cast<std::size_t>(selection.crop.first[1]) +
                     j * static_cast<std::size_t>(selection.stride[1]);
      const int x = selection.crop.x_of(static_cast<int>(i) * selection.stride[0]);
      const std::size_t at = y * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
      out.longitudes.push_back(columns.longitude[at]);
      out.latitudes.push_back(columns.latitude[at]);
    }
  }
}

// Bytes of a response, which count in the memory limit while it is sent.
struct Held {
  std::vector<std::uint8_t> bytes;
  std::shared_ptr<const void> room;
};

Result<http::Body> array_of(const Subject& subject, const Selection& selection,
                            const std::vector<std::size_t>& shape) {
  const auto whole = whole_for(subject, selection);
  if (!whole) return whole.error();
  const std::string head = npy_head(shape);
  const std::size_t bytes = head.size() + selection.values() * sizeof(float);
  auto room = subject.catalogue->load(
      *subject.dataset, [&](data::Dataset& loading) { return loading.reserve(bytes); },
      subject.cancel);
  if (!room) return room.error();
  const auto held = std::make_shared<Held>();
  held->room = std::move(*room);
  held->bytes.resize(bytes);
  std::memcpy(held->bytes.data(), head.data(), head.size());
  auto done = copy_selected(*whole, subject, selection, held->bytes.data() + head.size());
  if (!done) return done.error();
  return http::Body{held, held->bytes};
}

// All that determines the values, for a tag.
std::string signature_of(const Subject& subject, const Selection& selection,
                         std::string_view description) {
  std::string text = subject.dataset->digest() + '\n' + WINDSPLAT_VERSION + '\n';
  text += description;
  if (const auto& columns = selection.crop.columns) text.append(columns->begin(), columns->end());
  return text;
}

// The tag of a 304, of one that would be sent.
using KnownEtag = std::function<std::optional<std::string>(const std::string&)>;

http::Response values_response(const Subject& subject, const ValuesQuery& asked,
                               const Selection& selection, ValuesFormat format,
                               const KnownEtag& known_etag) {
  const data::Grid& grid = subject.dataset->info().grid;
  auto description = describe_values(asked, subject, selection);
  const bool is_json = format == ValuesFormat::json;
  const std::string ends = protocol::encode_values(description, protocol::ValuesDetail::ends);
  const std::string etag =
      etag_of(signature_of(subject, selection, ends + (is_json ? "json" : "npy")));
  http::Response response;
  const auto known = known_etag(etag);
  response.headers = {{"Cache-Control", "no-cache"}, {"ETag", known.value_or(etag)}};
  if (is_json) response.headers.emplace_back("Vary", "Accept-Encoding");
  if (known) {
    response.status = 304;
    return response;
  }
  if (is_json) {
    if (grid.columns) {
      if (selection.count[0] * selection.count[1] > protocol::limits::values_columns_max) {
        return http::problem_response(make_error(
            ErrorKind::invalid, "the positions of " +
                                    std::to_string(selection.count[0] * selection.count[1]) +
                                    " columns are above the limit of " +
                                    std::to_string(protocol::limits::values_columns_max) +
                                    "; reduce them by bbox or stride"));
      }
      add_columns(*grid.columns, grid.dims()[0], selection, description);
    }
    response.content_type = "application/json";
    response.body =
        http::Body::of(protocol::encode_values(description, protocol::ValuesDetail::all));
    return response;
  }
  auto body = array_of(subject, selection, description.shape);
  if (!body) return http::problem_response(body.error());
  response.content_type = "application/x-npy";
  response.headers.emplace_back("Windsplat-Values", ascii_json(ends));
  response.body = std::move(*body);
  return response;
}

}  // namespace

void get_values(tasks::Catalogue& catalogue, tasks::TaskExecutor& loads, ValuesFormat format,
                const std::string& id, const std::string& field, const http::Request& request,
                http::Reply reply) {
  const auto fail = [&](const Error& error) { reply(http::problem_response(error)); };
  http::QueryReader query(request.query);
  auto subject = find_subject(catalogue, id, field, request, query);
  if (!subject) return fail(subject.error());
  auto asked = read_asked(query, *subject->dataset);
  if (!asked) return fail(asked.error());
  const data::Dataset* const of = subject->dataset.get();
  run_later(
      loads, request, std::move(reply), "values of a field", of,
      [subject = std::move(*subject), asked = std::move(*asked), format,
       known_etag = [if_none_match = request.header("If-None-Match"),
                     accept_encoding = request.header("Accept-Encoding")](const std::string& etag) {
         return http::known_etag(if_none_match, accept_encoding, etag);
       }] {
        const auto selection = select_samples(asked, subject);
        if (!selection) return http::problem_response(selection.error());
        return values_response(subject, asked, *selection, format, known_etag);
      });
}

}  // namespace windsplat::api
