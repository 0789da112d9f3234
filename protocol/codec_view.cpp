// JSON tree <-> View with the ranges and constraints of the schema; one function per object.
#include <cmath>

#include "protocol/codec.hpp"
#include "protocol/codec_json.hpp"
#include "protocol/codec_names.hpp"
#include "protocol/limits.hpp"
#include "protocol/view/codec_annotations.hpp"
#include "protocol/view/codec_camera.hpp"
#include "protocol/view/codec_difference.hpp"
#include "protocol/view/codec_ground.hpp"
#include "protocol/view/codec_light.hpp"
#include "protocol/view/codec_mark.hpp"
#include "protocol/view/codec_planes.hpp"
#include "protocol/view/codec_region.hpp"
#include "protocol/view/codec_surfaces.hpp"
#include "protocol/view/codec_trace.hpp"

namespace windsplat::protocol {

namespace {

using limits::value_max;

constexpr NumberRange fraction{0, 1};
constexpr NumberRange field_value{-value_max, value_max};
constexpr IntegerRange stride_range{1, limits::stride_max};

// --- reading ------------------------------------------------------------------------------------

ImageView read_image(const Json& json, const std::string& pointer, Faults& faults) {
  ImageView image;
  ObjectReader reader(json, pointer, faults);
  reader.integer("width", image.width, {1, limits::image_edge_max});
  reader.integer("height", image.height, {1, limits::image_edge_max});
  reader.color("background", image.background);
  reader.finish();
  const std::int64_t pixels = static_cast<std::int64_t>(image.width) * image.height;
  if (pixels > limits::image_pixels_max) {
    faults.add(pointer,
               "must have at most " + std::to_string(limits::image_pixels_max) +
                   " pixels, width times height, not " + std::to_string(pixels),
               ErrorKind::too_large);
  }
  return image;
}

GeometryView read_geometry(const Json& json, const std::string& pointer, Faults& faults) {
  GeometryView geometry;
  ObjectReader reader(json, pointer, faults);
  reader.numbers("scale", geometry.scale, {limits::geometry_scale_min, limits::geometry_scale_max});
  reader.choice("vertical", geometry.vertical, vertical_names);
  reader.choice("mapping", geometry.mapping, mapping_names);
  reader.text("heightField", geometry.height_field, 1);
  if (const Json* slice = reader.child("slice", Presence::optional, Null::is_default)) {
    geometry.slice = read_slice(*slice, reader.at("slice"), faults);
  }
  if (const Json* plane = reader.child("plane", Presence::optional, Null::is_default)) {
    geometry.plane = read_plane(*plane, reader.at("plane"), faults);
  }
  if (reader.child("body") != nullptr) {
    faults.add(reader.at("body"), "has become /ground: its show and surfaceColor are keys of that");
  }
  reader.finish();
  return geometry;
}

VectorColorView read_vector_color(const Json& json, const std::string& pointer, Faults& faults) {
  VectorColorView color;
  ObjectReader reader(json, pointer, faults);
  reader.choice("by", color.by, color_by_names);
  reader.text("map", color.map, 1);
  reader.text("field", color.field, 1);
  reader.numbers("range", color.range, field_value);
  reader.number("riseWeight", color.rise_weight, fraction);
  reader.color("constant", color.constant);
  reader.boolean("trueColors", color.true_colors);
  reader.finish();
  check_color_range(color.range, reader);
  return color;
}

void read_motion(const Json& json, const std::string& pointer, Faults& faults, VectorView& vector) {
  ObjectReader reader(json, pointer, faults);
  reader.choice("mode", vector.motion, motion_names);
  reader.number("rate", vector.motion_rate, {-limits::motion_rate_max, limits::motion_rate_max});
  reader.number("time", vector.motion_time, {-limits::motion_time_max, limits::motion_time_max});
  reader.finish();
}

JitterView read_jitter(const Json& json, const std::string& pointer, Faults& faults) {
  JitterView jitter;
  ObjectReader reader(json, pointer, faults);
  reader.number("center", jitter.center, fraction);
  reader.number("stride", jitter.stride, fraction);
  reader.boolean("overlap", jitter.overlap);
  reader.integer("seed", jitter.seed, {0, limits::seed_max});
  reader.boolean("perStep", jitter.per_step);
  reader.finish();
  return jitter;
}

void read_field_choice(ObjectReader& reader, FieldChoice& field) {
  const Json* value = reader.child("field");
  if (value == nullptr) return;
  if (value->is_null()) {
    field.kind = FieldChoice::Kind::none;
    return;
  }
  const std::size_t before = reader.faults().count();
  reader.text("field", field.name, 1);
  if (reader.faults().count() == before) field.kind = FieldChoice::Kind::named;
}

// Radii are compared only if both are valid: in place of a refused one there is the default.
void read_radii(ObjectReader& reader, VectorView& vector) {
  const std::size_t before = reader.faults().count();
  reader.number("r1", vector.r1, {0, limits::radius_max});
  reader.number("r2", vector.r2, {0, limits::radius_max});
  if (reader.faults().count() == before && vector.r1 > vector.r2) {
    reader.faults().add(reader.at("r1"), "must be at most r2: " + number_text(vector.r1) +
                                             " is more than " + number_text(vector.r2));
  }
}

void check_magnitudes(const VectorView& vector, ObjectReader& reader) {
  if (!vector.magnitude_range) return;
  const auto& [low, high] = *vector.magnitude_range;
  if (!(high - low >= limits::range_width_min)) {
    reader.faults().add(reader.at("magnitudeRange"),
                        "must ascend by at least " + number_text(limits::range_width_min));
  }
}

VectorView read_vector(const Json& json, const std::string& pointer, Faults& faults) {
  constexpr double scale_max = limits::component_scale_max;
  VectorView vector;
  ObjectReader reader(json, pointer, faults);
  read_field_choice(reader, vector.field);
  reader.choice("space", vector.space, space_names);
  reader.numbers("scale", vector.scale, {-scale_max, scale_max});
  reader.number("length", vector.length, {0, limits::line_length_max});
  reader.number("span", vector.span, {limits::span_min, limits::span_max});
  reader.integer("stride", vector.stride, stride_range);
  read_radii(reader, vector);
  reader.number("opacity", vector.opacity, fraction);
  reader.choice("combine", vector.combine, combination_names);
  reader.number("headDesaturation", vector.head_desaturation, fraction);
  if (const Json* mark = reader.child("mark")) {
    vector.mark = read_mark(*mark, reader.at("mark"), faults);
  }
  if (const Json* color = reader.child("color")) {
    vector.color = read_vector_color(*color, reader.at("color"), faults);
  }
  reader.numbers("magnitudeRange", vector.magnitude_range, field_value);
  reader.number("minMagnitude", vector.min_magnitude, {0, value_max});
  reader.number("magnitudeIntensity", vector.magnitude_intensity, fraction);
  if (const Json* motion = reader.child("motion")) {
    read_motion(*motion, reader.at("motion"), faults, vector);
  }
  if (const Json* jitter = reader.child("jitter")) {
    vector.jitter = read_jitter(*jitter, reader.at("jitter"), faults);
  }
  if (const Json* trace = reader.child("trace", Presence::optional, Null::is_default)) {
    vector.trace = read_trace(*trace, reader.at("trace"), faults);
  }
  reader.finish();
  check_magnitudes(vector, reader);
  return vector;
}

ScalarColorView read_scalar_color(const Json& json, const std::string& pointer, Faults& faults) {
  ScalarColorView color;
  ObjectReader reader(json, pointer, faults);
  reader.text("map", color.map, 1);
  reader.numbers("range", color.range, field_value);
  reader.finish();
  check_color_range(color.range, reader);
  return color;
}

std::vector<std::array<double, 2>> read_extinction(const Json& json, const std::string& pointer,
                                                   Faults& faults) {
  std::vector<std::array<double, 2>> points;
  if (!json.is_array() || json.empty() ||
      json.size() > static_cast<std::size_t>(limits::extinction_points_max)) {
    faults.add(pointer, "must be an array of 1 to " +
                            std::to_string(limits::extinction_points_max) +
                            " points (value, extinction)");
    return points;
  }
  for (std::size_t i = 0; i < json.size(); ++i) {
    const Json& point = json[i];
    const std::string at = join_pointer(pointer, i);
    if (!point.is_array() || point.size() != 2) {
      faults.add(at, "must be a pair (value, extinction), not " + described(point));
      continue;
    }
    const auto value = read_number(point[0], join_pointer(at, 0), field_value, faults);
    const auto extinction =
        read_number(point[1], join_pointer(at, 1), {0, limits::extinction_max}, faults);
    if (!value || !extinction) continue;
    if (!points.empty() && *value < points.back()[0]) {
      faults.add(join_pointer(at, 0), "must not be less than the value of the previous point");
    }
    points.push_back({*value, *extinction});
  }
  return points;
}

ScalarView read_scalar(const Json& json, const std::string& pointer, Faults& faults) {
  ScalarView scalar;
  ObjectReader reader(json, pointer, faults);
  reader.text("field", scalar.field, 1, Presence::required);
  if (const Json* color = reader.child("color")) {
    scalar.color = read_scalar_color(*color, reader.at("color"), faults);
  }
  if (const Json* points = reader.child("extinction", Presence::optional, Null::is_default)) {
    scalar.extinction = read_extinction(*points, reader.at("extinction"), faults);
  }
  reader.number("minOpticalDepth", scalar.min_optical_depth, {0, limits::optical_depth_max});
  reader.integer("stride", scalar.stride, stride_range);
  reader.choice("shading", scalar.shading, shading_names);
  reader.finish();
  return scalar;
}

std::vector<ScalarView> read_scalars(const Json& json, const std::string& pointer, Faults& faults) {
  std::vector<ScalarView> scalars;
  if (!json.is_array() || json.size() > static_cast<std::size_t>(limits::scalars_max)) {
    faults.add(pointer,
               "must be an array of at most " + std::to_string(limits::scalars_max) +
                   " media, not " +
                   (json.is_array() ? "of " + std::to_string(json.size()) : described(json)));
    return scalars;
  }
  for (std::size_t i = 0; i < json.size(); ++i) {
    scalars.push_back(read_scalar(json[i], join_pointer(pointer, i), faults));
  }
  return scalars;
}

DepthCueView read_depth_cue(const Json& json, const std::string& pointer, Faults& faults) {
  constexpr NumberRange depth{-limits::depth_cue_max, limits::depth_cue_max};
  DepthCueView cue;
  ObjectReader reader(json, pointer, faults);
  reader.number("strength", cue.strength, fraction);
  const std::size_t before = faults.count();
  reader.number("near", cue.near, depth);
  reader.number("far", cue.far, depth);
  const bool both = faults.count() == before;
  reader.finish();
  if (both && !(cue.near < cue.far)) {
    faults.add(reader.at("near"), "must be less than far: " + number_text(cue.near) +
                                      " is not less than " + number_text(cue.far));
  }
  return cue;
}

MethodView read_method(const Json& json, const std::string& pointer, Faults& faults) {
  MethodView method;
  ObjectReader reader(json, pointer, faults);
  reader.choice("name", method.name, method_names);
  reader.choice("compositing", method.compositing, compositing_names);
  reader.number("slabThickness", method.slab_thickness,
                {limits::slab_thickness_min, limits::slab_thickness_max});
  reader.number("stopTransmittance", method.stop_transmittance, fraction);
  reader.choice("detail", method.detail, detail_names);
  reader.finish();
  return method;
}

QualityView read_quality(const Json& json, const std::string& pointer, Faults& faults) {
  QualityView quality;
  ObjectReader reader(json, pointer, faults);
  reader.number("budgetMs", quality.budget_ms, {limits::budget_ms_min, limits::budget_ms_max});
  reader.number("maxError", quality.max_error, {limits::max_error_min, limits::max_error_max});
  reader.boolean("lossless", quality.lossless);
  reader.finish();
  return quality;
}

// --- writing ------------------------------------------------------------------------------------

Json geometry_to_json(const GeometryView& geometry) {
  return Json{{"scale", numbers_to_json(geometry.scale)},
              {"vertical", name_of(geometry.vertical, vertical_names)},
              {"mapping", name_of(geometry.mapping, mapping_names)},
              {"heightField", text_or_null(geometry.height_field)},
              {"slice", slice_to_json(geometry.slice)},
              {"plane", plane_to_json(geometry.plane)}};
}

Json vector_to_json(const VectorView& vector) {
  Json color{{"by", nullptr},
             {"map", vector.color.map},
             {"field", text_or_null(vector.color.field)},
             {"range", numbers_or_null(vector.color.range)},
             {"riseWeight", canonical_number(vector.color.rise_weight)},
             {"constant", vector.color.constant},
             {"trueColors", vector.color.true_colors}};
  if (vector.color.by) color["by"] = name_of(*vector.color.by, color_by_names);
  Json out{{"space", name_of(vector.space, space_names)},
           {"scale", numbers_to_json(vector.scale)},
           {"length", number_or_null(vector.length)},
           {"span", canonical_number(vector.span)},
           {"stride", vector.stride ? Json(*vector.stride) : Json(nullptr)},
           {"r1", canonical_number(vector.r1)},
           {"r2", canonical_number(vector.r2)},
           {"opacity", canonical_number(vector.opacity)},
           {"combine", name_of(vector.combine, combination_names)},
           {"headDesaturation", number_or_null(vector.head_desaturation)},
           {"mark", mark_to_json(vector.mark)},
           {"color", std::move(color)},
           {"magnitudeRange", numbers_or_null(vector.magnitude_range)},
           {"minMagnitude", number_or_null(vector.min_magnitude)},
           {"magnitudeIntensity", canonical_number(vector.magnitude_intensity)},
           {"motion",
            {{"mode", name_of(vector.motion, motion_names)},
             {"rate", canonical_number(vector.motion_rate)},
             {"time", canonical_number(vector.motion_time)}}},
           {"trace", vector.trace ? trace_to_json(*vector.trace) : Json(nullptr)},
           {"jitter",
            {{"center", canonical_number(vector.jitter.center)},
             {"stride", canonical_number(vector.jitter.stride)},
             {"overlap", vector.jitter.overlap},
             {"seed", vector.jitter.seed},
             {"perStep", vector.jitter.per_step}}}};
  // Null means no lines, so the default of the dataset is expressed by omitting the key.
  if (vector.field.kind == FieldChoice::Kind::none) out["field"] = nullptr;
  if (vector.field.kind == FieldChoice::Kind::named) out["field"] = vector.field.name;
  return out;
}

Json scalar_to_json(const ScalarView& scalar) {
  Json extinction;
  if (scalar.extinction) {
    extinction = Json::array();
    for (const auto& point : *scalar.extinction) extinction.push_back(numbers_to_json(point));
  }
  return Json{
      {"field", scalar.field},
      {"color",
       {{"map", text_or_null(scalar.color.map)}, {"range", numbers_or_null(scalar.color.range)}}},
      {"extinction", std::move(extinction)},
      {"minOpticalDepth", canonical_number(scalar.min_optical_depth)},
      {"stride", scalar.stride},
      {"shading", name_of(scalar.shading, shading_names)}};
}

}  // namespace

View read_view(const Json& document, Faults& faults) {
  View view;
  ObjectReader reader(document, "", faults);
  reader.text("dataset", view.dataset, 0);
  reader.integer("step", view.step, {0, limits::step_max});
  const auto object = [&](const char* key, auto read, auto& out) {
    if (const Json* json = reader.child(key)) out = read(*json, reader.at(key), faults);
  };
  if (const Json* minus = reader.child("difference", Presence::optional, Null::is_default)) {
    view.difference = read_difference(*minus, reader.at("difference"), faults);
  }
  object("camera", read_camera, view.camera);
  object("image", read_image, view.image);
  object("geometry", read_geometry, view.geometry);
  object("ground", read_ground, view.ground);
  object("vector", read_vector, view.vector);
  if (const Json* scalars = reader.child("scalars", Presence::optional, Null::is_default)) {
    view.scalars = read_scalars(*scalars, reader.at("scalars"), faults);
  }
  object("depthCue", read_depth_cue, view.depth_cue);
  object("method", read_method, view.method);
  object("quality", read_quality, view.quality);
  object("annotations", read_annotations, view.annotations);
  object("region", read_region, view.region);
  if (const Json* light = reader.child("light", Presence::optional, Null::is_default)) {
    view.light = read_light(*light, reader.at("light"), faults);
  }
  if (const Json* surfaces = reader.child("surfaces", Presence::optional, Null::is_default)) {
    view.surfaces = read_surfaces(*surfaces, reader.at("surfaces"), faults);
  }
  reader.finish();
  return view;
}

Json view_to_json(const View& view) {
  Json scalars;
  if (view.scalars) {
    scalars = Json::array();
    for (const ScalarView& scalar : *view.scalars) scalars.push_back(scalar_to_json(scalar));
  }
  return Json{{"dataset", view.dataset},
              {"step", view.step},
              {"difference", difference_to_json(view.difference)},
              {"camera", camera_to_json(view.camera)},
              {"image",
               {{"width", view.image.width},
                {"height", view.image.height},
                {"background", view.image.background}}},
              {"geometry", geometry_to_json(view.geometry)},
              {"ground", ground_to_json(view.ground)},
              {"vector", vector_to_json(view.vector)},
              {"scalars", std::move(scalars)},
              {"depthCue",
               {{"strength", canonical_number(view.depth_cue.strength)},
                {"near", canonical_number(view.depth_cue.near)},
                {"far", canonical_number(view.depth_cue.far)}}},
              {"method",
               {{"name", name_of(view.method.name, method_names)},
                {"compositing", name_of(view.method.compositing, compositing_names)},
                {"slabThickness", canonical_number(view.method.slab_thickness)},
                {"stopTransmittance", canonical_number(view.method.stop_transmittance)},
                {"detail", name_of(view.method.detail, detail_names)}}},
              {"quality",
               {{"budgetMs", number_or_null(view.quality.budget_ms)},
                {"maxError", number_or_null(view.quality.max_error)},
                {"lossless", view.quality.lossless}}},
              {"annotations", annotations_to_json(view.annotations)},
              {"region", region_to_json(view.region)},
              {"light", light_to_json(view.light)},
              {"surfaces", surfaces_to_json(view.surfaces)}};
}

std::string encode_view(const View& view) { return dump(view_to_json(view)); }

}  // namespace windsplat::protocol
