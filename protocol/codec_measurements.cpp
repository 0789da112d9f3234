// Measurements and jobs -> JSON; dataset request -> its path.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "protocol/codec_json.hpp"
#include "protocol/codec_shapes.hpp"
#include "protocol/limits.hpp"
#include "protocol/measurements.hpp"
#include "server/base/check.hpp"

namespace windsplat::protocol {

namespace {

Json range_json(const std::optional<Range>& range) {
  if (!range) return nullptr;
  return Json::array({canonical_number((*range)[0]), canonical_number((*range)[1])});
}

Json position_json(const PositionDescription& position) {
  Json out{{"units", Json::object()}, {"index", Json::object()}};
  constexpr std::array<const char*, 3> keys{"x", "y", "z"};
  for (std::size_t a = 0; a < 3; ++a) {
    out[keys[a]] = canonical_number(position.coordinates[a]);
    out["units"][keys[a]] = position.units[a];
    out["index"][keys[a]] = position.index[a];
  }
  return out;
}

Json value_json(const ProbedField& field, const ProbedValue& value) {
  if (!value) return nullptr;
  WINDSPLAT_CHECK(!value->empty());
  return field.is_vector ? numbers_json(*value) : canonical_number(value->front());
}

void add_units(const ProbedField& field, Json& out) {
  out["units"] = field.units;
  for (const std::string& units : field.component_units) {
    if (units != field.component_units.front()) out["componentUnits"] = field.component_units;
  }
}

Json animation_json(const AnimationDescription& animation) {
  return Json{{"id", animation.id},
              {"movie", animation.movie},
              {"format", animation.format},
              {"width", animation.width},
              {"height", animation.height},
              {"frames", animation.frames},
              {"fps", canonical_number(animation.fps)},
              {"bytes", animation.bytes},
              {"expires", animation.expires}};
}

Json result_json(const JobResult& result) {
  if (const auto* const id = std::get_if<std::string>(&result)) return *id;
  if (const auto* const animation = std::get_if<AnimationDescription>(&result)) {
    return animation_json(*animation);
  }
  const auto& reference = std::get<ReferenceDescription>(result);
  const bool differs = std::isfinite(reference.psnr);
  return Json{{"id", reference.id},
              {"picture", reference.picture},
              {"width", reference.width},
              {"height", reference.height},
              {"error",
               {{"value", canonical_number(reference.rmse)},
                {"max", canonical_number(reference.max)},
                {"psnr", differs ? canonical_number(reference.psnr) : Json(nullptr)}}}};
}

// Names of dimensions -> entries: a text, or a number as its shortest decimal text.
void read_selection(const Json& value, const std::string& pointer, Faults& faults,
                    std::vector<std::pair<std::string, std::string>>& out) {
  if (!value.is_object()) return faults.add(pointer, "must be an object");
  if (value.empty() || value.size() > limits::selection_entries_max) {
    return faults.add(
        pointer, "must name 1 to " + std::to_string(limits::selection_entries_max) + " dimensions");
  }
  for (const auto& [name, entry] : value.items()) {
    const std::string at = join_pointer(pointer, name);
    if (name.empty() || (!entry.is_number() && !entry.is_string())) {
      faults.add(at, "must be the value of an entry: a number or a text");
      continue;
    }
    const std::string text =
        entry.is_string() ? entry.get<std::string>() : canonical_number(entry.get<double>()).dump();
    if (text.empty() || text.size() > limits::name_chars_max) {
      faults.add(at, "must have 1 to " + std::to_string(limits::name_chars_max) + " characters");
    } else {
      out.emplace_back(name, text);
    }
  }
}

Json point_json(const ForecastPoint& point) {
  return Json{{"method", point.method},
              {"slabThickness", number_or_null(point.slab_thickness)},
              {"width", point.width},
              {"height", point.height},
              {"coarser", point.coarser},
              {"ms", canonical_number(point.ms)},
              {"timed", point.timed},
              {"error", canonical_number(point.error)},
              {"errorLow", canonical_number(point.error_low)},
              {"errorHigh", canonical_number(point.error_high)},
              {"kind", point.measured ? "measured" : "estimated"},
              {"pareto", point.pareto}};
}

Json job_json(const JobDescription& job) {
  return Json{{"id", job.id},
              {"kind", job.kind},
              {"state", job.state},
              {"progress", canonical_number(job.progress)},
              {"etaMs", job.eta_ms ? canonical_number(*job.eta_ms) : Json(nullptr)},
              {"result", job.result ? result_json(*job.result) : Json(nullptr)},
              {"problem", job.problem ? problem_json(*job.problem) : Json(nullptr)}};
}

}  // namespace

std::string encode_histogram(const HistogramDescription& histogram) {
  Json out{{"range", range_json(histogram.range)},
           {"counts", histogram.counts},
           {"below", histogram.below},
           {"above", histogram.above},
           {"masked", histogram.masked},
           {"log", histogram.log}};
  if (!histogram.edges.empty()) out["edges"] = numbers_json(histogram.edges);
  return dump(out);
}

std::string encode_probe(const ProbeDescription& probe) {
  WINDSPLAT_CHECK(probe.fields.size() == probe.values.size());
  Json values = Json::object();
  for (std::size_t i = 0; i < probe.fields.size(); ++i) {
    const ProbedField& field = probe.fields[i];
    Json entry{{"value", value_json(field, probe.values[i])}};
    add_units(field, entry);
    values[field.name] = std::move(entry);
  }
  return dump(Json{{"position", position_json(probe.position)},
                   {"step", probe.step},
                   {"values", std::move(values)}});
}

std::string encode_values(const ValuesDescription& values, ValuesDetail detail) {
  constexpr std::array<const char*, 3> keys{"x", "y", "z"};
  const bool all = detail == ValuesDetail::all;
  Json axes = Json::object();
  for (std::size_t a = 0; a < keys.size(); ++a) {
    const ValuesAxis& axis = values.axes.at(a);
    WINDSPLAT_CHECK(!axis.coordinates.empty());
    Json& out = axes[keys.at(a)];
    out = Json{{"name", axis.name},
               {"units", axis.units},
               {"index", axis.index},
               {"stride", axis.stride},
               {"count", axis.coordinates.size()},
               {"first", canonical_number(axis.coordinates.front())},
               {"last", canonical_number(axis.coordinates.back())}};
    if (all) out["coordinates"] = numbers_json(axis.coordinates);
  }
  if (values.turn > 0) axes["x"]["turn"] = values.turn;
  Json out{{"field", values.field.name},
           {"step", values.step},
           {"time", {{"value", canonical_number(values.time.value)}, {"text", values.time.text}}},
           {"dims", values.dims},
           {"shape", values.shape},
           {"axes", std::move(axes)}};
  add_units(values.field, out);
  if (all && !values.longitudes.empty()) {
    out["longitudes"] = numbers_json(values.longitudes);
    out["latitudes"] = numbers_json(values.latitudes);
  }
  return dump(out);
}

std::string encode_upload(const UploadDescription& upload) {
  return dump(Json{{"id", upload.id},
                   {"bytes", upload.bytes},
                   {"digest", upload.digest},
                   {"expires", upload.expires}});
}

std::string encode_series(const SeriesDescription& series) {
  Json times = Json::array();
  for (const StepDescription& time : series.times) {
    times.push_back(Json{{"value", canonical_number(time.value)}, {"text", time.text}});
  }
  Json values = Json::array();
  for (const ProbedValue& value : series.values) {
    values.push_back(value_json(series.field, value));
  }
  Json out{{"position", position_json(series.position)},
           {"times", std::move(times)},
           {"values", std::move(values)}};
  add_units(series.field, out);
  return dump(out);
}

std::string encode_range(const RangeDescription& range) {
  Json out{
      {"range", range_json(range.range)}, {"masked", range.masked}, {"rangeOf", range.range_of}};
  if (range.places) {
    out["places"] = {{"min", position_json((*range.places)[0])},
                     {"max", position_json((*range.places)[1])}};
  }
  return dump(out);
}

std::string encode_pick(const std::optional<PickedFeature>& feature) {
  Json out{{"feature", nullptr}};
  if (feature) {
    constexpr std::array<const char*, 3> layers{"lines", "medium", "surface"};
    out["feature"] = {{"layer", layers.at(static_cast<std::size_t>(feature->layer))},
                      {"field", feature->field},
                      {"value", number_or_null(feature->value)},
                      {"units", feature->units},
                      {"position", position_json(feature->position)},
                      {"share", canonical_number(feature->share)},
                      {"depth", canonical_number(feature->depth)},
                      {"at", numbers_json({feature->at[0], feature->at[1]})}};
    if (feature->surface) out["feature"]["surface"] = *feature->surface;
  }
  return dump(out);
}

std::string encode_forecast(const ForecastDescription& forecast) {
  Json points = Json::array();
  for (const ForecastPoint& point : forecast.points) points.push_back(point_json(point));
  return dump(Json{{"view", {{"width", forecast.width}, {"height", forecast.height}}},
                   {"points", std::move(points)},
                   {"chosen", forecast.chosen ? Json(*forecast.chosen) : Json(nullptr)}});
}

std::string encode_job(const JobDescription& job) { return dump(job_json(job)); }

std::string encode_jobs(const std::vector<JobDescription>& jobs) {
  Json list = Json::array();
  for (const JobDescription& job : jobs) list.push_back(job_json(job));
  return dump(Json{{"jobs", std::move(list)}});
}

namespace {

constexpr std::size_t listed_files_max = 64;  // as of a list in a file

// A name or pattern of a list: relative to the data root, and below it.
void check_listed_name(const std::string& name, const std::string& pointer, Faults& faults) {
  if (name.starts_with('/')) return faults.add(pointer, "must be relative to the data root");
  for (std::string_view rest = name; !rest.empty();) {
    const std::size_t end = std::min(rest.find('/'), rest.size());
    if (rest.substr(0, end) == "..") return faults.add(pointer, "leads out of the data root");
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
}

void read_list(const Json& tree, Faults& faults, DatasetRequest& out) {
  ObjectReader reader(tree, "", faults);
  std::string text;
  reader.text("windsplat", text, 1);
  if (tree.contains("windsplat") && text != "files") {
    faults.add("/windsplat", "must be \"files\"");
  }
  reader.text("title", text, 0, Presence::optional, limits::path_chars_max);
  reader.text("group", text, 0, Presence::optional, limits::path_chars_max);
  if (const Json* selection = reader.child("selection")) {
    std::vector<std::pair<std::string, std::string>> entries;  // read again when it is opened
    read_selection(*selection, reader.at("selection"), faults, entries);
  }
  const Json& files = *reader.child("files");
  if (!files.is_array() || files.empty() || files.size() > listed_files_max) {
    faults.add("/files",
               "must list 1 to " + std::to_string(listed_files_max) + " names or patterns");
  } else {
    for (std::size_t i = 0; i < files.size(); ++i) {
      const std::string at = "/files/" + std::to_string(i);
      const auto name = reader.read_text(files[i], at, 1, limits::path_chars_max);
      if (name) check_listed_name(*name, at, faults);
    }
  }
  reader.finish();
  if (!faults.empty()) return;
  out.list = dump(tree);
  out.first = files.front().get<std::string>();
}

}  // namespace

Result<DatasetRequest> parse_dataset_request(std::string_view json) {
  const auto tree = parse_json(json);
  if (!tree) return tree.error();
  Faults faults;
  DatasetRequest out;
  if (tree->is_object() && tree->contains("path") && tree->contains("selection") &&
      !tree->contains("from")) {
    faults.add("/selection",
               "is not a key beside path: name the entry behind the path, as in "
               "\"winds.nc?number=3\"");
  } else if (tree->is_object() && tree->contains("upload")) {
    ObjectReader reader(*tree, "", faults);
    reader.text("upload", out.upload, 1, Presence::required);
    reader.finish();
  } else if (tree->is_object() && tree->contains("files")) {
    read_list(*tree, faults, out);
  } else if (tree->is_object() && (tree->contains("from") || tree->contains("selection"))) {
    ObjectReader reader(*tree, "", faults);
    reader.text("from", out.from, 1, Presence::required);
    if (const Json* value = reader.child("selection", Presence::required)) {
      read_selection(*value, reader.at("selection"), faults, out.selection);
    }
    reader.finish();
  } else {
    ObjectReader reader(*tree, "", faults);
    const bool is_named = !tree->is_object() || tree->contains("path");
    if (!is_named) {
      faults.add(
          "/path",
          "is required: a body is {\"path\": \"winds.nc\"}, with a file below --data-root or "
          "a URL of a --data-host, {\"upload\": \"winds.nc\"}, {\"files\": [\"ua_*.nc\", "
          "\"va_*.nc\"]}, or {\"from\": \"gcm\", \"selection\": {\"number\": 3}}");
    }
    reader.text("path", out.path, 1, is_named ? Presence::required : Presence::optional,
                limits::path_chars_max);
    reader.finish();
  }
  if (!faults.empty()) return faults.error();
  return out;
}

}  // namespace windsplat::protocol
