// view.schema.json, limits.hpp and the structs of view.hpp are consistent.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "protocol/codec.hpp"
#include "protocol/limits.hpp"
#include "support.hpp"

namespace windsplat::protocol::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

using Visit = std::function<void(const std::string& pointer, const Json& schema)>;

// Calls `visit` for every property of the schema that is not an object, with its JSON pointer in a
// view; for an object that may be null also for the object. Elements of /scalars have index 0.
void walk(const Json& schema, const std::string& pointer, const Visit& visit) {
  for (const auto& [key, property] : schema.at("properties").items()) {
    const std::string at = under(pointer, key);
    const bool is_object = property.contains("properties");
    if (!is_object || property.at("type") != "object") visit(at, property);
    if (is_object) walk(property, at, visit);
    if (key == "scalars") walk(property.at("items"), at + "/0", visit);
  }
}

bool in_slice(const std::string& pointer) { return pointer.starts_with("/geometry/slice/"); }

bool in_plane(const std::string& pointer) { return pointer.starts_with("/geometry/plane/"); }

bool in_sun_at(const std::string& pointer) { return pointer.starts_with("/light/sunAt/"); }

bool in_seed_line(const std::string& pointer) {
  return pointer.starts_with("/vector/trace/seeds/line/");
}

bool in_seed_block(const std::string& pointer) {
  return pointer.starts_with("/vector/trace/seeds/block/");
}

bool in_difference(const std::string& pointer) { return pointer.starts_with("/difference/"); }

Json with_scalar() { return Json{{"scalars", {{{"field", "q"}}}}}; }

// A view with one value set, and others that it requires.
Json view_with(const std::string& pointer, const Json& value) {
  Json view = pointer.starts_with("/scalars/") ? with_scalar() : Json::object();
  if (pointer == "/vector/r1") view["vector"]["r2"] = limits::radius_max;
  if (pointer == "/vector/r2") view["vector"]["r1"] = 0;
  if (pointer == "/depthCue/near") view["depthCue"]["far"] = limits::depth_cue_max;
  if (pointer == "/depthCue/far") view["depthCue"]["near"] = -limits::depth_cue_max;
  if (pointer == "/image/width") view["image"]["height"] = 1;
  if (pointer == "/image/height") view["image"]["width"] = 1;
  if (in_slice(pointer)) view["geometry"]["slice"] = {{"axis", "y"}, {"index", 0}};
  if (in_plane(pointer)) {
    view["geometry"]["plane"] = {{"point", {0, 0, 0}}, {"normal", {0, 0, 1}}};
  }
  if (in_sun_at(pointer)) {
    view["light"]["sunAt"] = {{"utc", "2024-06-21T12:00:00Z"}, {"longitude", 0}, {"latitude", 0}};
  }
  if (in_difference(pointer)) view["difference"] = {{"dataset", "other"}, {"step", 0}};
  if (in_seed_line(pointer)) {
    view["vector"]["trace"]["seeds"]["line"] = {{"from", {0, 0, 0}}, {"to", {0, 0, 1}}};
  }
  if (in_seed_block(pointer)) {
    view["vector"]["trace"]["seeds"]["block"] = {{"from", {0, 0, 0}}, {"to", {0, 0, 1}}};
  }
  view[Json::json_pointer(pointer)] = value;
  return view;
}

bool accepted(const Json& view) { return ViewDocument::parse(view.dump()).has_value(); }

std::string first_pointer(const Json& view) {
  const auto document = ViewDocument::parse(view.dump());
  return document || document.error().at.empty() ? "" : document.error().at.front().pointer;
}

bool may_be_null(const Json& schema) {
  return schema.value("type", Json()) == "null" ||
         (schema.contains("type") && schema["type"].is_array()) ||
         (schema.contains("enum") && schema["enum"].back().is_null());
}

TEST(Schema, StaticDefaultsAreThoseOfTheStructs) {
  View view;
  view.scalars = std::vector<ScalarView>(1);
  view.scalars->front().field = "q";
  const Json without = Json::parse(encode_view(view));
  view.light = LightView{};
  view.difference = DifferenceView{};
  view.vector.trace = TraceView{};
  view.vector.trace->seeds = SeedsView{};
  view.vector.trace->seeds->line = SeedLineView{};
  view.vector.trace->seeds->block = SeedBlockView{};
  const Json with_all = Json::parse(encode_view(view));
  int compared = 0;
  walk(read_protocol_json("view.schema.json"), "", [&](const std::string& at, const Json& schema) {
    const Json::json_pointer pointer(at);
    const bool optional = at.starts_with("/light/") || at.starts_with("/vector/trace/") ||
                          at.starts_with("/difference/");
    const Json& encoded = optional ? with_all : without;
    if (in_sun_at(at)) return;
    // These are set here, and null by default.
    if (at == "/vector/trace/seeds" || at == "/vector/trace/seeds/line" ||
        at == "/vector/trace/seeds/block") {
      return;
    }
    if (schema.contains("default")) {
      ASSERT_TRUE(encoded.contains(pointer)) << at;
      EXPECT_EQ(encoded.at(pointer), schema["default"]) << at;
      ++compared;
    } else if (at == "/vector/field") {
      EXPECT_FALSE(encoded.contains(pointer)) << "null means no lines";
    } else if (at != "/scalars" && at != "/scalars/0/field" && !in_slice(at) && !in_plane(at) &&
               !in_seed_line(at) && !in_seed_block(at)) {
      ASSERT_TRUE(encoded.contains(pointer)) << at;
      EXPECT_TRUE(encoded.at(pointer).is_null()) << at << " has no static default";
    }
  });
  EXPECT_GE(compared, 35);
}

TEST(Schema, DefaultViewIsValidAndEqualsTheEmptyOne) {
  const auto said = ViewDocument::parse(encode_view(View{}));
  ASSERT_TRUE(said.has_value()) << said.error().message;
  EXPECT_EQ(encode_view(said->view()), encode_view(ViewDocument{}.view()));
}

TEST(Schema, EncodedViewsHoldExactlyTheSchemasKeys) {
  View view;
  view.vector.field = {FieldChoice::Kind::named, "wind"};
  view.geometry.slice = SliceView{GridAxis::x, 2};
  view.geometry.plane = PlaneView{};
  view.scalars = std::vector<ScalarView>(1);
  view.scalars->front().field = "q";
  view.vector.trace = TraceView{};
  view.difference = DifferenceView{};
  view.vector.trace->seeds = SeedsView{};
  view.vector.trace->seeds->line = SeedLineView{};
  view.vector.trace->seeds->block = SeedBlockView{};
  view.light = LightView{};
  view.light->sun_at = SunAtView{};
  const Json encoded = Json::parse(encode_view(view));
  EXPECT_THAT(schema_complaints("view.schema.json", "", encoded), IsEmpty());
  walk(read_protocol_json("view.schema.json"), "", [&](const std::string& at, const Json&) {
    EXPECT_TRUE(encoded.contains(Json::json_pointer(at))) << at;
  });
}

// The limit is accepted and the next number beyond it is not: codec and schema have the same range.
TEST(Schema, RangesOfNumbersMatchTheCodec) {
  int bounds = 0;
  walk(read_protocol_json("view.schema.json"), "", [&](const std::string& at, const Json& schema) {
    const bool integer = schema.value("type", Json()) == "integer";
    for (const auto& [keyword, outward] : {std::pair{"minimum", -1.0}, std::pair{"maximum", 1.0}}) {
      if (!schema.contains(keyword)) continue;
      ++bounds;
      const auto bound = schema[keyword].get<double>();
      const double beyond = integer ? bound + outward : std::nextafter(bound, outward * 1e300);
      // near < far leaves no valid far for the largest near, and no valid near for the smallest
      // far.
      const bool lonely =
          (at == "/depthCue/near" && outward > 0) || (at == "/depthCue/far" && outward < 0);
      EXPECT_EQ(first_pointer(view_with(at, schema[keyword])), lonely ? "/depthCue/near" : "")
          << at << " " << keyword;
      EXPECT_EQ(first_pointer(view_with(at, beyond)), at) << at << " " << keyword;
    }
  });
  EXPECT_GE(bounds, 50);
}

TEST(Schema, RangesInsideArraysMatchTheCodec) {
  int bounds = 0;
  walk(read_protocol_json("view.schema.json"), "", [&](const std::string& at, const Json& schema) {
    if (!schema.contains("items") || !schema["items"].contains("minimum")) return;
    const auto count = schema.at("minItems").get<std::size_t>();
    EXPECT_EQ(count, schema.at("maxItems").get<std::size_t>()) << at;
    for (std::size_t i = 0; i < count; ++i) {
      for (const auto& [keyword, outward] :
           {std::pair{"minimum", -1e300}, std::pair{"maximum", 1e300}}) {
        const auto bound = schema["items"].at(keyword).get<double>();
        Json value = Json::array();
        const bool whole = schema["items"]["type"] == "integer";
        const double step = whole ? 1 : 0.25;
        for (std::size_t k = 0; k < count; ++k) value.push_back(step * static_cast<double>(k + 1));
        // Keeps a range ascending.
        if (count == 2) {
          const char* const other = i == 0 ? "maximum" : "minimum";
          value[1 - i] = 0.9 * schema["items"].at(other).get<double>();
        }
        if (count == 2 && (i == 0) == (outward > 0)) continue;
        value[i] = bound;
        EXPECT_TRUE(accepted(view_with(at, value))) << at << " " << keyword;
        value[i] = whole ? bound + std::copysign(1, outward) : std::nextafter(bound, outward);
        EXPECT_EQ(first_pointer(view_with(at, value)), at + "/" + std::to_string(i)) << keyword;
        ++bounds;
      }
    }
    for (const std::size_t wrong : {std::size_t{0}, count - 1, count + 1}) {
      EXPECT_EQ(first_pointer(view_with(at, Json(std::vector<double>(wrong, 1.0)))), at);
    }
  });
  EXPECT_GE(bounds, 30);
}

TEST(Schema, LimitsOfTheViewMatchTheLimitsFile) {
  const Json schema = read_protocol_json("view.schema.json");
  const auto at = [&](const char* pointer) {
    return schema.at(Json::json_pointer(pointer)).get<double>();
  };
  const std::string camera = "/properties/camera/properties";
  EXPECT_EQ(at("/properties/step/maximum"), static_cast<double>(limits::step_max));
  EXPECT_EQ(at((camera + "/fovY/minimum").c_str()), limits::fov_min);
  EXPECT_EQ(at((camera + "/fovY/maximum").c_str()), limits::fov_max);
  EXPECT_EQ(at((camera + "/eye/items/maximum").c_str()), limits::world_max);
  EXPECT_EQ(at((camera + "/height/minimum").c_str()), limits::view_height_min);
  EXPECT_EQ(at("/properties/image/properties/width/maximum"), limits::image_edge_max);
  EXPECT_EQ(at("/properties/image/properties/height/maximum"), limits::image_edge_max);
  EXPECT_EQ(at("/properties/geometry/properties/scale/items/maximum"), limits::geometry_scale_max);
  EXPECT_EQ(at("/properties/vector/properties/r1/maximum"), limits::radius_max);
  EXPECT_EQ(at("/properties/vector/properties/r2/maximum"), limits::radius_max);
  const std::string mark = "/properties/vector/properties/mark/properties";
  for (const char* head : {"/headWidth", "/headLength"}) {
    EXPECT_EQ(at((mark + head + "/minimum").c_str()), limits::mark_head_min);
    EXPECT_EQ(at((mark + head + "/maximum").c_str()), limits::mark_head_max);
  }
  EXPECT_EQ(at((mark + "/halo/maximum").c_str()), limits::halo_max);
  EXPECT_EQ(at("/properties/vector/properties/span/minimum"), limits::span_min);
  EXPECT_EQ(at("/properties/vector/properties/span/maximum"), limits::span_max);
  EXPECT_EQ(at("/properties/vector/properties/stride/maximum"), limits::stride_max);
  EXPECT_EQ(at("/properties/vector/properties/length/maximum"), limits::line_length_max);
  EXPECT_EQ(at("/properties/geometry/properties/slice/properties/index/maximum"),
            static_cast<double>(limits::slice_index_max));
  const std::string motion = "/properties/vector/properties/motion/properties";
  EXPECT_EQ(at((motion + "/time/maximum").c_str()), limits::motion_time_max);
  EXPECT_EQ(at((motion + "/rate/maximum").c_str()), limits::motion_rate_max);
  EXPECT_EQ(at("/properties/method/properties/slabThickness/minimum"), limits::slab_thickness_min);
  EXPECT_EQ(at("/properties/method/properties/slabThickness/maximum"), limits::slab_thickness_max);
  EXPECT_EQ(at("/properties/scalars/maxItems"), limits::scalars_max);
  const std::string scalar = "/properties/scalars/items/properties";
  EXPECT_EQ(at((scalar + "/extinction/maxItems").c_str()), limits::extinction_points_max);
  EXPECT_EQ(at((scalar + "/extinction/items/prefixItems/1/maximum").c_str()),
            limits::extinction_max);
  EXPECT_EQ(at("/properties/quality/properties/budgetMs/minimum"), limits::budget_ms_min);
  EXPECT_EQ(at("/properties/quality/properties/budgetMs/maximum"), limits::budget_ms_max);
  EXPECT_EQ(at("/properties/quality/properties/maxError/minimum"), limits::max_error_min);
  EXPECT_EQ(at("/properties/quality/properties/maxError/maximum"), limits::max_error_max);
  EXPECT_THAT(schema["description"].get<std::string>(),
              HasSubstr(std::to_string(limits::image_pixels_max)));
}

TEST(Schema, ListLengthsMatchTheLimits) {
  const auto media = [](int count) {
    Json view{{"scalars", Json::array()}};
    for (int i = 0; i < count; ++i)
      view["scalars"].push_back({{"field", std::string(1, static_cast<char>('a' + i))}});
    return view;
  };
  EXPECT_TRUE(accepted(media(limits::scalars_max)));
  EXPECT_EQ(first_pointer(media(limits::scalars_max + 1)), "/scalars");
  const auto points = [](int count) {
    Json view = with_scalar();
    for (int i = 0; i < count; ++i) view["scalars"][0]["extinction"].push_back({i, 1});
    return view;
  };
  EXPECT_TRUE(accepted(points(limits::extinction_points_max)));
  EXPECT_EQ(first_pointer(points(limits::extinction_points_max + 1)), "/scalars/0/extinction");
}

TEST(Schema, PolygonsHaveAtMostTheLimitOfPositionsInAllRings) {
  const auto ring = [](std::size_t positions) {
    Json out = Json::array();
    for (std::size_t n = 0; n + 1 < positions; ++n) out.push_back({n % 7, n});
    out.push_back(out.front());
    return out;
  };
  const auto view = [&](std::size_t positions) {
    const Json rings{ring(positions - 500), ring(500)};
    return Json{{"region", {{"polygon", {{"type", "Polygon"}, {"coordinates", rings}}}}}};
  };
  EXPECT_TRUE(accepted(view(limits::polygon_points_max)));
  EXPECT_EQ(first_pointer(view(limits::polygon_points_max + 1)), "/region/polygon");
  Json filters = Json::array();
  for (std::size_t n = 0; n <= limits::filters_max; ++n) {
    filters.push_back({{"field", "q"}, {"range", {0, 1}}});
  }
  EXPECT_EQ(first_pointer({{"region", {{"where", filters}}}}), "/region/where");
}

TEST(Schema, NamesAreMeasuredInCharacters) {
  std::string longest;
  for (std::size_t i = 0; i < limits::name_chars_max; ++i) longest += "\xc3\xbc";
  for (const char* at : {"/dataset", "/vector/field", "/vector/color/map", "/vector/color/field",
                         "/geometry/heightField", "/scalars/0/field"}) {
    EXPECT_TRUE(accepted(view_with(at, longest))) << at;
    EXPECT_THAT(schema_complaints("view.schema.json", "", view_with(at, longest)), IsEmpty());
    EXPECT_EQ(first_pointer(view_with(at, longest + "x")), at);
    EXPECT_FALSE(schema_complaints("view.schema.json", "", view_with(at, longest + "x")).empty());
  }
}

TEST(Schema, ATitleOfOnesOwnIsOneLineOfText) {
  const auto title = [](const std::string& text) {
    return Json{{"annotations", {{"titleText", text}}}};
  };
  EXPECT_TRUE(
      accepted(title("Kyrill, 2007-01-18 \u2014 \u0394\u03b8 in \u00b0C \u00b7 5 < 6 & 7")));
  std::string longest;
  for (std::size_t i = 0; i < limits::name_chars_max; ++i) longest += "\u00fc";
  EXPECT_TRUE(accepted(title(longest)));
  for (const std::string& bad :
       {std::string(), longest + "x", std::string("a\nb"), std::string("a\tb"),
        std::string("a\x7f"), std::string("\u0085"), std::string("\u009f"), std::string("a\u2028b"),
        std::string("\u2029"), std::string("\ufffe"), std::string("a\uffff")}) {
    EXPECT_EQ(first_pointer(title(bad)), "/annotations/titleText") << bad;
  }
  // Of the same bytes as parts of these, and no control characters.
  EXPECT_TRUE(accepted(title("\u00a0 \u2027 \u202f \ufffd")));
}

// Codec and schema agree on every key and every type of value.
TEST(Schema, EveryKeyAcceptsTheTypesOfTheSchema) {
  const std::vector<Json> samples{
      nullptr,       true,       3,         2.5,    "#123456", "auto",       "q\n",
      Json::array(), {{"x", 1}}, {0, 0, 1}, {0, 1}, {{0, 1}},  "perspective"};
  int compared = 0;
  walk(read_protocol_json("view.schema.json"), "", [&](const std::string& at, const Json&) {
    for (const Json& sample : samples) {
      const Json view = view_with(at, sample);
      EXPECT_EQ(accepted(view), schema_complaints("view.schema.json", "", view).empty())
          << at << " = " << sample;
      ++compared;
    }
  });
  EXPECT_GE(compared, 500);
}

TEST(Schema, NullMeansTheDefaultExactlyWhereTheSchemaAllowsIt) {
  walk(read_protocol_json("view.schema.json"), "", [&](const std::string& at, const Json& schema) {
    const Json view = view_with(at, nullptr);
    EXPECT_EQ(accepted(view), may_be_null(schema)) << at;
    if (!may_be_null(schema) || at == "/vector/field") return;
    Json silent = at.starts_with("/scalars/") ? with_scalar() : Json::object();
    if (at.starts_with("/light/")) silent["light"] = Json::object();
    if (at.starts_with("/vector/trace/")) silent["vector"]["trace"] = Json::object();
    if (at.starts_with("/vector/trace/seeds/")) {
      silent["vector"]["trace"]["seeds"] = Json::object();
    }
    if (at == "/difference/dataset") silent["difference"] = {{"step", 0}};
    if (at == "/difference/step") silent["difference"] = {{"dataset", "other"}};
    EXPECT_EQ(ViewDocument::parse(view.dump())->canonical(), silent.dump()) << at;
  });
}

TEST(Schema, UnknownKeysAreRefusedInEveryObject) {
  std::vector<std::string> objects{"", "/scalars/0"};
  walk(read_protocol_json("view.schema.json"), "",
       [&](const std::string& at, const Json&) { objects.push_back(at.substr(0, at.rfind('/'))); });
  for (const std::string& object : objects) {
    for (const char* key : {"/unknown", "/Step", "/$schema", "/__proto__"}) {
      EXPECT_EQ(first_pointer(view_with(object + key, 1)), object + key);
    }
  }
}

TEST(Schema, EveryKeyIsDescribedAndClosed) {
  walk(read_protocol_json("view.schema.json"), "", [&](const std::string& at, const Json& schema) {
    EXPECT_FALSE(schema.value("description", "").empty()) << at;
  });
  for (const char* name : {"view.schema.json", "messages.schema.json"}) {
    const std::function<void(const Json&, const std::string&)> closed = [&](const Json& node,
                                                                            const std::string& at) {
      if (node.is_object() && node.contains("properties") && node.contains("type")) {
        EXPECT_EQ(node.value("additionalProperties", Json()), false) << name << " " << at;
      }
      if (!node.is_structured()) return;
      for (const auto& [key, inner] : node.items()) closed(inner, under(at, key));
    };
    closed(read_protocol_json(name), "");
  }
}

}  // namespace
}  // namespace windsplat::protocol::testing
