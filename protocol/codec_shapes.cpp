// Descriptions -> the JSON documents of messages.schema.json.
#include "protocol/codec_shapes.hpp"

#include <cmath>
#include <cstdio>
#include <utility>

#include "protocol/animation/limits.hpp"
#include "protocol/codec.hpp"
#include "protocol/limits.hpp"
#include "protocol/problems/problem_types.hpp"

namespace windsplat::protocol {

namespace {

Json vec3_json(const Vec3& value) {
  return Json::array(
      {canonical_number(value[0]), canonical_number(value[1]), canonical_number(value[2])});
}

Json field_json(const FieldDescription& field) {
  Json range;
  if (field.range) {
    range = Json::array({canonical_number((*field.range)[0]), canonical_number((*field.range)[1])});
  }
  Json out{{"name", field.name},
           {"kind", field.kind},
           {"components", field.components},
           {"units", field.units},
           {"standardName", field.standard_name},
           {"longName", field.long_name},
           {"range", std::move(range)},
           {"masked", field.masked ? Json(*field.masked) : Json(nullptr)},
           {"rangeOf", field.range_of.empty() ? Json(nullptr) : Json(field.range_of)},
           {"dtype", field.dtype}};
  if (field.storage_error > 0) out["storageError"] = canonical_number(field.storage_error);
  return out;
}

Json fields_json(const std::vector<FieldDescription>& fields) {
  Json out = Json::array();
  for (const FieldDescription& field : fields) out.push_back(field_json(field));
  return out;
}

Json axis_json(const AxisDescription& axis) {
  return Json{{"name", axis.name},
              {"standardName", axis.standard_name},
              {"units", axis.units},
              {"kind", axis.kind},
              {"coordinates", numbers_json(axis.coordinates)},
              {"world", numbers_json(axis.world)}};
}

std::string color_text(const std::array<unsigned char, 3>& rgb) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), "#%02x%02x%02x", rgb[0], rgb[1], rgb[2]);
  return text.data();
}

// Those of the values of a view, and of messages about one.
Json limits_of_views() {
  return Json{{"imageEdgeMax", limits::image_edge_max},
              {"extinctionPointsMax", limits::extinction_points_max},
              {"scalarsMax", limits::scalars_max},
              {"surfacesMax", limits::surfaces_max},
              {"contourLevelsMax", limits::contour_levels_max},
              {"segmentsMax", limits::segments_max},
              {"seedsMax", limits::seeds_max},
              {"piecesMax", limits::pieces_max},
              {"pathStepsMax", limits::path_steps_max},
              {"seedLengthMax", limits::seed_length_max},
              {"dashMin", limits::dash_min},
              {"dashMax", limits::dash_max},
              {"stepErrorMin", canonical_number(limits::step_error_min)},
              {"stepErrorMax", canonical_number(limits::step_error_max)},
              {"filtersMax", limits::filters_max},
              {"polygonPointsMax", limits::polygon_points_max},
              {"extinctionMax", canonical_number(limits::extinction_max)},
              {"radiusMax", canonical_number(limits::radius_max)},
              {"markHeadMin", canonical_number(limits::mark_head_min)},
              {"markHeadMax", canonical_number(limits::mark_head_max)},
              {"haloMax", canonical_number(limits::halo_max)},
              {"fovMin", canonical_number(limits::fov_min)},
              {"fovMax", canonical_number(limits::fov_max)},
              {"strideMax", limits::stride_max},
              {"spanMin", canonical_number(limits::span_min)},
              {"spanMax", canonical_number(limits::span_max)},
              {"worldMax", canonical_number(limits::world_max)},
              {"viewHeightMin", canonical_number(limits::view_height_min)},
              {"upLengthMin", canonical_number(limits::up_length_min)},
              {"geometryScaleMin", canonical_number(limits::geometry_scale_min)},
              {"geometryScaleMax", canonical_number(limits::geometry_scale_max)},
              {"componentScaleMax", canonical_number(limits::component_scale_max)},
              {"lineLengthMax", canonical_number(limits::line_length_max)},
              {"valueMax", canonical_number(limits::value_max)},
              {"rangeWidthMin", canonical_number(limits::range_width_min)},
              {"motionRateMax", canonical_number(limits::motion_rate_max)},
              {"motionTimeMax", canonical_number(limits::motion_time_max)},
              {"slabThicknessMin", canonical_number(limits::slab_thickness_min)},
              {"slabThicknessMax", canonical_number(limits::slab_thickness_max)},
              {"sliceIndexMax", limits::slice_index_max},
              {"opticalDepthMax", canonical_number(limits::optical_depth_max)},
              {"annotationSizeMin", canonical_number(limits::annotation_size_min)},
              {"annotationSizeMax", canonical_number(limits::annotation_size_max)},
              {"depthCueMax", canonical_number(limits::depth_cue_max)},
              {"budgetMsMin", canonical_number(limits::budget_ms_min)},
              {"budgetMsMax", canonical_number(limits::budget_ms_max)},
              {"maxErrorMin", canonical_number(limits::max_error_min)},
              {"maxErrorMax", canonical_number(limits::max_error_max)},
              {"stepMax", limits::step_max},
              {"seedMax", limits::seed_max},
              {"nameCharsMax", limits::name_chars_max},
              {"serialMax", limits::serial_max},
              {"fpsMin", canonical_number(limits::fps_min)},
              {"fpsMax", canonical_number(limits::fps_max)},
              {"stillScaleMax", canonical_number(limits::still_scale_max)},
              {"decodeMsMax", canonical_number(limits::decode_ms_max)}};
}

}  // namespace

Problem problem_from(const Error& error) {
  Problem problem;
  const ProblemType& type = problem_type_of(error.kind);
  problem.type = problem_reference(type);
  problem.status = type.status;
  problem.title = type.title;
  problem.detail = error.message;
  problem.errors = error.at;
  return problem;
}

Json limits_json(const ServerLimits& server) {
  Json out = limits_of_views();
  out.update(Json{{"messageBytesMax", limits::message_bytes_max},
                  {"jsonDepthMax", limits::json_depth_max},
                  {"httpHeaderBytesMax", limits::http_header_bytes_max},
                  {"httpBodyBytesMax", limits::http_body_bytes_max},
                  {"httpHeaderTimeoutS", limits::http_header_timeout_s},
                  {"httpBodyTimeoutS", limits::http_body_timeout_s},
                  {"writeTimeoutS", limits::write_timeout_s},
                  {"imagePixelsMax", server.image_pixels_max},
                  {"problemErrorsMax", limits::problem_errors_max},
                  {"pathCharsMax", limits::path_chars_max},
                  {"selectionEntriesMax", limits::selection_entries_max},
                  {"histogramBinsMax", limits::histogram_bins_max},
                  {"histogramClipMax", canonical_number(limits::histogram_clip_max)},
                  {"coordinateMax", canonical_number(limits::coordinate_max)},
                  {"seriesStepsMax", limits::series_steps_max},
                  {"jobsMax", limits::jobs_max},
                  {"jobsRunningMax", limits::jobs_running_max},
                  {"valuesBytesMax", limits::values_bytes_max},
                  {"valuesColumnsMax", limits::values_columns_max},
                  {"animationFramesMax", limits::animation_frames_max},
                  {"animationPixelsMax", limits::animation_pixels_max},
                  {"animationBytesMax", limits::animation_bytes_max},
                  {"videoPixelsMax", limits::video_pixels_max},
                  {"uploadBytesMax", server.upload_bytes_max},
                  {"uploadsBytesMax", server.uploads_bytes_max},
                  {"viewsMax", limits::views_max},
                  {"viewsBytesMax", limits::views_bytes_max},
                  {"videoCodecsMax", limits::video_codecs_max},
                  {"framesInFlightMax", limits::frames_in_flight_max},
                  {"sessionsMaxDefault", limits::sessions_max_default}});
  return out;
}

Json problem_json(const Problem& problem) {
  Json out{{"type", problem.type},
           {"title", problem.title},
           {"status", problem.status},
           {"detail", problem.detail}};
  for (const FieldError& error : problem.errors) {
    out["errors"].push_back(Json{{"pointer", error.pointer}, {"detail", error.detail}});
  }
  return out;
}

Json dataset_summary_json(const DatasetDescription& dataset) {
  return Json{{"id", dataset.id},
              {"title", dataset.title},
              {"state", dataset.state},
              {"fields", fields_json(dataset.fields)},
              {"steps", std::max(dataset.step_count, dataset.steps.size())},
              {"residentBytes", dataset.resident_bytes},
              {"notes", dataset.notes}};
}

Json levels_json(const std::vector<LevelDescription>& levels) {
  Json out = Json::array();
  for (const LevelDescription& level : levels) {
    Json one{{"dims", {{"x", level.dims[0]}, {"y", level.dims[1]}, {"z", level.dims[2]}}},
             {"halvings", level.halvings},
             {"bricks", level.bricks},
             {"bytes", level.bytes},
             {"residentBytes", level.resident_bytes}};
    if (level.stored_bytes) one["storedBytes"] = *level.stored_bytes;
    out.push_back(std::move(one));
  }
  return out;
}

Json dataset_json(const DatasetDescription& dataset) {
  Json left_out = Json::array();
  for (const auto& [name, reason] : dataset.left_out) {
    left_out.push_back(Json{{"name", name}, {"reason", reason}});
  }
  Json choices = Json::array();
  for (const ChoiceDescription& choice : dataset.choices) {
    choices.push_back(Json{{"name", choice.name},
                           {"length", choice.length},
                           {"values", choice.values},
                           {"chosen", choice.chosen}});
  }
  Json times = Json::array();
  for (const StepDescription& step : dataset.steps) {
    times.push_back(Json{{"value", canonical_number(step.value)}, {"text", step.text}});
  }
  Json out = dataset_summary_json(dataset);
  out["source"] = dataset.source;
  out["format"] = dataset.format;
  out["dims"] = {{"x", dataset.dims[0]}, {"y", dataset.dims[1]}, {"z", dataset.dims[2]}};
  out["axes"] = {{"x", axis_json(dataset.axes[0])},
                 {"y", axis_json(dataset.axes[1])},
                 {"z", axis_json(dataset.axes[2])}};
  out["world"] = {{"min", vec3_json(dataset.world_min)}, {"max", vec3_json(dataset.world_max)}};
  if (dataset.vertical_exaggeration) {
    out["verticalExaggeration"] = canonical_number(*dataset.vertical_exaggeration);
  }
  if (const auto& ground = dataset.ground) {
    out["ground"] = {{"name", ground->name},
                     {"kind", ground->kind},
                     {"range", Json::array({canonical_number(ground->range[0]),
                                            canonical_number(ground->range[1])})}};
  }
  out["mappings"] = dataset.mappings;
  out["leftOut"] = std::move(left_out);
  out["choices"] = std::move(choices);
  out["steps"] = {{"count", dataset.steps.size()}, {"times", std::move(times)}};
  out["timeUnits"] = dataset.time_units;
  out["timeCalendar"] = dataset.time_calendar;
  if (!dataset.levels.empty()) out["levels"] = levels_json(dataset.levels);
  out["bytesWhenResident"] = dataset.bytes_when_resident;
  if (!dataset.default_view.dataset.empty()) {
    out["defaultView"] = view_to_json(dataset.default_view);
  }
  return out;
}

std::string encode_problem(const Problem& problem) { return dump(problem_json(problem)); }

std::string with_request_id(std::string_view problem_json, std::string_view request_id) {
  std::string json = "{\"requestId\":\"";
  json += request_id;
  json += "\",";
  return json.append(problem_json.substr(1));  // a problem has other members
}

std::string encode_health(std::string_view state) { return dump(Json{{"status", state}}); }

std::string encode_dataset(const DatasetDescription& dataset) {
  return dump(dataset_json(dataset));
}

std::string encode_dataset_list(const std::vector<DatasetDescription>& datasets) {
  Json list = Json::array();
  for (const DatasetDescription& dataset : datasets) {
    list.push_back(dataset_summary_json(dataset));
  }
  return dump(Json{{"datasets", std::move(list)}});
}

std::string encode_frame_info(const FrameInfo& info) { return dump(frame_info_json(info)); }

std::string encode_frame_report(const FrameInfo& info, double render_ms, double encode_ms) {
  Json report = frame_info_json(info);
  report["renderMs"] = canonical_number(render_ms);
  report["encodeMs"] = canonical_number(encode_ms);
  return dump(report);
}

std::string encode_service(const ServiceDescription& service) {
  Json links = Json::object();
  for (const auto& [relation, target] : service.links) links[relation] = target;
  return dump(Json{{"name", service.name},
                   {"version", service.version},
                   {"links", std::move(links)},
                   {"limits", limits_json(service.limits)}});
}

std::string encode_color_maps(const std::vector<ColorMapDescription>& maps) {
  Json list = Json::array();
  for (const ColorMapDescription& map : maps) {
    Json colors = Json::array();
    for (const auto& rgb : map.colors) colors.push_back(color_text(rgb));
    list.push_back(Json{{"name", map.name}, {"kind", map.kind}, {"colors", std::move(colors)}});
  }
  return dump(Json{{"colormaps", std::move(list)}});
}

std::string encode_presets(const std::vector<std::string>& names) {
  return dump(Json{{"presets", names}});
}

}  // namespace windsplat::protocol
