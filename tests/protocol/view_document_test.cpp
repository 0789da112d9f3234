// ViewDocument: typed values, merge patches, edits by pointer, and limits on the text itself.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocol/codec.hpp"
#include "protocol/limits.hpp"
#include "support.hpp"

namespace windsplat::protocol::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

ViewDocument document_of(const std::string& json) {
  const auto document = ViewDocument::parse(json);
  EXPECT_TRUE(document.has_value()) << json << ": " << document.error().message;
  return document ? *document : ViewDocument{};
}

std::string patched(const std::string& json, const std::string& patch) {
  const auto result = document_of(json).patched(patch);
  return result ? result->canonical() : "refused " + result.error().message;
}

std::string set(const std::string& json, const std::string& pointer, const std::string& value) {
  const auto result = set_at(document_of(json), pointer, value);
  return result ? result->canonical() : "refused " + result.error().message;
}

TEST(ViewDocument, KeepsGivenValuesAndFillsDefaults) {
  const View view = document_of(R"({"dataset": "gcm", "step": 12,
      "camera": {"projection": "orthographic", "eye": [0, -3, 2.5], "height": 2.2},
      "image": {"width": 640, "background": "#a0B1c2"},
      "geometry": {"scale": [1, 2, 3], "vertical": "logp"},
      "vector": {"field": "wind", "space": "world", "length": 0.05, "stride": 3, "r1": 0, "r2": 3,
                 "color": {"by": "screenZ", "map": "magma", "range": [9, -9]},
                 "magnitudeRange": [1, 60], "minMagnitude": 0.5, "motion": {"rate": 2},
                 "jitter": {"overlap": false, "seed": 4294967295, "perStep": true}},
      "scalars": [{"field": "cloud", "color": {"map": "grays", "range": [0, 1]},
                   "extinction": [[0, 0], [0.5, 0], [0.5, 4]], "stride": 2}],
      "depthCue": {"strength": 0, "near": -1, "far": 2},
      "method": {"stopTransmittance": 0.002}, 
      "quality": {"budgetMs": 33, "maxError": 0.004, "lossless": true}})")
                        .view();
  EXPECT_EQ(view.dataset, "gcm");
  EXPECT_EQ(view.step, 12);
  EXPECT_EQ(view.camera.projection, Projection::orthographic);
  EXPECT_EQ(view.camera.eye, (Vec3{0, -3, 2.5}));
  EXPECT_FALSE(view.camera.target.has_value());
  EXPECT_EQ(view.camera.up, (Vec3{0, 0, 1}));
  EXPECT_EQ(view.camera.height, 2.2);
  EXPECT_EQ(view.image.width, 640);
  EXPECT_EQ(view.image.height, 720);
  EXPECT_EQ(view.image.background, "#a0B1c2");
  EXPECT_EQ(view.geometry.scale, (Vec3{1, 2, 3}));
  EXPECT_EQ(view.geometry.vertical, VerticalPlacement::logp);
  EXPECT_EQ(view.vector.field, (FieldChoice{FieldChoice::Kind::named, "wind"}));
  EXPECT_EQ(view.vector.space, VectorSpace::world);
  EXPECT_EQ(view.vector.length, 0.05);
  EXPECT_EQ(view.vector.span, 7);
  EXPECT_EQ(view.vector.stride, 3);
  EXPECT_EQ(view.vector.r1, 0);
  EXPECT_EQ(view.vector.r2, 3);
  EXPECT_EQ(view.vector.color.by, ColorBy::screen_z);
  EXPECT_EQ(view.vector.color.map, "magma");
  EXPECT_EQ(view.vector.color.range, (Range{9, -9}));
  EXPECT_EQ(view.vector.magnitude_range, (Range{1, 60}));
  EXPECT_EQ(view.vector.min_magnitude, 0.5);
  EXPECT_EQ(view.vector.motion_rate, 2);
  EXPECT_FALSE(view.vector.jitter.overlap);
  EXPECT_EQ(view.vector.jitter.seed, 4294967295);
  EXPECT_TRUE(view.vector.jitter.per_step);
  ASSERT_TRUE(view.scalars.has_value());
  ASSERT_EQ(view.scalars->size(), 1U);
  const ScalarView& scalar = view.scalars->front();
  EXPECT_EQ(scalar.field, "cloud");
  EXPECT_EQ(scalar.color.map, "grays");
  EXPECT_EQ(scalar.color.range, (Range{0, 1}));
  EXPECT_THAT(*scalar.extinction,
              ElementsAre(std::array{0.0, 0.0}, std::array{0.5, 0.0}, std::array{0.5, 4.0}));
  EXPECT_EQ(scalar.min_optical_depth, 1e-4);
  EXPECT_EQ(scalar.stride, 2);
  EXPECT_EQ(view.depth_cue.near, -1);
  EXPECT_EQ(view.depth_cue.far, 2);
  EXPECT_EQ(view.method.stop_transmittance, 0.002);
  EXPECT_EQ(view.quality.budget_ms, 33);
  EXPECT_EQ(view.quality.max_error, 0.004);
  EXPECT_TRUE(view.quality.lossless);
}

TEST(ViewDocument, DistinguishesNoLinesFromDefaultLines) {
  EXPECT_EQ(document_of("{}").view().vector.field.kind, FieldChoice::Kind::dataset_default);
  EXPECT_EQ(document_of(R"({"vector": {"field": null}})").view().vector.field.kind,
            FieldChoice::Kind::none);
  EXPECT_FALSE(document_of(R"({"scalars": null})").view().scalars.has_value());
  EXPECT_TRUE(document_of(R"({"scalars": []})").view().scalars->empty());
}

TEST(ViewDocument, EncodedViewIsReadBackUnchanged) {
  for (const Vector& vector : read_vectors("valid")) {
    if (vector.kind() != "view") continue;
    const std::string whole = encode_view(document_of(vector.text()).view());
    EXPECT_EQ(encode_view(document_of(whole).view()), whole) << vector.name();
    const std::string said = document_of(vector.text()).canonical();
    EXPECT_EQ(document_of(said).canonical(), said) << vector.name();
  }
}

TEST(ViewDocument, ReportsEveryErrorUpToTheLimit) {
  const auto two = ViewDocument::parse(R"({"step": -1, "camera": {"fovY": 0}, "zoom": 1})");
  ASSERT_FALSE(two.has_value());
  ASSERT_EQ(two.error().at.size(), 3U);
  EXPECT_THAT(two.error().message, HasSubstr("and 2 more"));
  Json many = Json::object();
  for (int i = 0; i < 1000; ++i) many["unknown" + std::to_string(i)] = i;
  const auto refused = ViewDocument::parse(many.dump());
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().at.size(), limits::problem_errors_max);
  EXPECT_THAT(refused.error().message, HasSubstr("and 999 more"));
}

TEST(ViewDocument, ReportsTheLimitAndTheValue) {
  const auto step = ViewDocument::parse(R"({"step": 3000000000})");
  EXPECT_EQ(step.error().at[0].detail,
            "must be a whole number from 0 to 2147483647, not 3000000000");
  const auto angle = ViewDocument::parse(R"({"camera": {"fovY": 180}})");
  EXPECT_EQ(angle.error().message, "/camera/fovY: must be a number from 0.001 to 179, not 180");
  const auto method = ViewDocument::parse(R"({"method": {"name": "splat"}})");
  EXPECT_EQ(method.error().at[0].detail,
            R"(must be one of "kernel", "slab", "reference", not "splat"; did you mean 'slab'?)");
}

TEST(ViewDocument, RefusedValuesAreNotComparedWithOthers) {
  const auto pointers = [](const char* text) {
    std::vector<std::string> out;
    const auto refused = ViewDocument::parse(text);
    if (!refused) {
      for (const FieldError& fault : refused.error().at) out.push_back(fault.pointer);
    }
    return out;
  };
  EXPECT_THAT(pointers(R"({"vector": {"r1": 20, "r2": 90}})"), ElementsAre("/vector/r2"));
  EXPECT_THAT(pointers(R"({"vector": {"r1": -1, "r2": 0}})"), ElementsAre("/vector/r1"));
  EXPECT_THAT(pointers(R"({"vector": {"r1": 20, "r2": 2, "length": -1}})"),
              UnorderedElementsAre("/vector/r1", "/vector/length"));
  EXPECT_THAT(pointers(R"({"depthCue": {"near": 3, "far": "x"}})"), ElementsAre("/depthCue/far"));
  EXPECT_THAT(pointers(R"({"depthCue": {"near": 2, "far": 1}})"), ElementsAre("/depthCue/near"));
}

TEST(ViewDocument, ErrorsDoNotRepeatOversizeOrHostileKeys) {
  const std::string key = std::string(60000, 'k');
  const auto giant = ViewDocument::parse("{\"" + key + "\": 1}");
  ASSERT_FALSE(giant.has_value());
  EXPECT_LT(giant.error().message.size(), 300U);
  const auto hostile = ViewDocument::parse(R"({"\u001b[2J\r\nSet-Cookie": 1})");
  ASSERT_FALSE(hostile.has_value());
  EXPECT_EQ(hostile.error().message.find_first_of("\x1b\r\n"), std::string::npos);
  const auto value = ViewDocument::parse("{\"step\": \"" + key + "\"}");
  EXPECT_LT(value.error().message.size(), 300U);
}

// The cases of RFC 7396's appendix whose shape fits a view, with keys of views in place of letters.
TEST(MergePatch, FollowsTheAppendixOfTheRfc) {
  EXPECT_EQ(patched(R"({"dataset":"b"})", R"({"dataset":"c"})"), R"({"dataset":"c"})");
  EXPECT_EQ(patched(R"({"dataset":"b"})", R"({"step":3})"), R"({"dataset":"b","step":3})");
  EXPECT_EQ(patched(R"({"dataset":"b"})", R"({"dataset":null})"), "{}");
  EXPECT_EQ(patched(R"({"dataset":"b","step":3})", R"({"dataset":null})"), R"({"step":3})");
  EXPECT_EQ(patched(R"({"scalars":[{"field":"b"}]})", R"({"scalars":null})"), "{}");
  EXPECT_EQ(patched("{}", R"({"scalars":[]})"), R"({"scalars":[]})");
  EXPECT_EQ(patched(R"({"camera":{"fovY":20}})", R"({"camera":{"fovY":30,"height":null}})"),
            R"({"camera":{"fovY":30}})");
  EXPECT_EQ(patched(R"({"scalars":[{"field":"b"}]})", R"({"scalars":[{"field":"c"}]})"),
            R"({"scalars":[{"field":"c"}]})");
  EXPECT_EQ(patched("{}", R"({"vector":{"color":{"by":"rise","map":null}}})"),
            R"({"vector":{"color":{"by":"rise"}}})");
  EXPECT_EQ(patched("{}", R"({"vector":{"color":{"by":null}}})"), "{}");
}

TEST(MergePatch, KeepsOnlyTheNullThatMeansNoLines) {
  const std::string named = R"({"vector":{"field":"wind","stride":2}})";
  EXPECT_EQ(patched(named, R"({"vector":{"field":null}})"),
            R"({"vector":{"field":null,"stride":2}})");
  EXPECT_EQ(patched("{}", R"({"vector":{"field":null}})"), R"({"vector":{"field":null}})");
  EXPECT_EQ(patched(R"({"vector":{"field":null}})", R"({"vector":{"field":"wind"}})"),
            R"({"vector":{"field":"wind"}})");
  EXPECT_EQ(patched(R"({"vector":{"field":null}})", R"({"vector":null})"), "{}");
  EXPECT_EQ(patched(named, R"({"vector":{"stride":null}})"), R"({"vector":{"field":"wind"}})");
}

// A region changes part by part, as a drag of one of its faces does, and as a whole.
TEST(MergePatch, RegionsChangeKeyByKey) {
  const std::string ranges = R"({"region":{"x":[0,9],"y":[1,2]}})";
  EXPECT_EQ(patched(ranges, R"({"region":{"x":[3,9]}})"), R"({"region":{"x":[3,9],"y":[1,2]}})");
  EXPECT_EQ(patched(ranges, R"({"region":{"y":null}})"), R"({"region":{"x":[0,9]}})");
  EXPECT_EQ(patched(ranges, R"({"region":null})"), "{}");
  const std::string one =
      R"({"region":{"polygon":{"coordinates":[[[0,0],[1,0],[1,1],[0,0]]],"type":"Polygon"}}})";
  const std::string two = R"({"region":{"polygon":{"coordinates":[[[[0,0],[1,0],[1,1],[0,0]]]],)"
                          R"("type":"MultiPolygon"}}})";
  EXPECT_EQ(patched(one, two), two);
  EXPECT_EQ(patched(two, one), one);
  EXPECT_EQ(patched(one, R"({"region":{"polygon":null}})"), "{}");
  EXPECT_THAT(patched(one, R"({"region":{"polygon":{"type":"MultiPolygon"}}})"),
              HasSubstr("refused"));
  EXPECT_EQ(patched(R"({"region":{"where":[{"field":"a","range":[0,1]}]}})",
                    R"({"region":{"where":[]}})"),
            R"({"region":{"where":[]}})");
}

TEST(MergePatch, ReplacesArraysWhole) {
  EXPECT_EQ(patched(R"({"camera":{"eye":[1,2,3]}})", R"({"camera":{"eye":[4,5,6]}})"),
            R"({"camera":{"eye":[4,5,6]}})");
  EXPECT_EQ(patched(R"({"scalars":[{"field":"a","stride":2},{"field":"b"}]})",
                    R"({"scalars":[{"field":"a","extinction":null}]})"),
            R"({"scalars":[{"field":"a"}]})");
}

TEST(MergePatch, InvalidPatchLeavesTheViewUnchanged) {
  const std::string_view text = R"({"dataset":"gcm","vector":{"r2":2}})";
  const ViewDocument before = document_of(std::string(text));
  for (const char* patch :
       {R"({"step":1,"camera":{"fovY":200}})", R"({"vector":{"r1":2.5}})", R"({"zoom":null,"x":1})",
        "[]", "null", "5", "{", "", R"({"step":1,"step":2})", R"({"camera":5})"}) {
    EXPECT_FALSE(before.patched(patch).has_value()) << patch;
    EXPECT_EQ(before.canonical(), text) << patch;
  }
  // r1 is valid with the r2 set before, although not with the default.
  EXPECT_TRUE(before.patched(R"({"vector":{"r1":1.9}})").has_value());
  // Removing r2 restores its default, with which r1 is no longer valid.
  const auto wide = before.patched(R"({"vector":{"r1":1.9}})");
  EXPECT_FALSE(wide->patched(R"({"vector":{"r2":null}})").has_value());
}

TEST(MergePatch, RemovingAMissingKeyIsNoError) {
  EXPECT_EQ(patched(R"({"step":1})", R"({"camera":null,"zoom":null})"), R"({"step":1})");
}

// What names fields, coordinates or places of the last dataset does not fit another one.
TEST(MergePatch, AnotherDatasetKeepsPictureQualityAndAnnotationsAlone) {
  const std::string kept =
      R"("image":{"background":"#102030","height":100,"width":200},"quality":{"budgetMs":40}})";
  const std::string before =
      R"({"dataset":"a","step":3,"difference":{"step":0},"camera":{"eye":[1,2,3]},)"
      R"("geometry":{"mapping":"sphere"},"ground":{"borders":true},"vector":{"field":"w"},)"
      R"("scalars":[{"field":"q"}],"depthCue":{"strength":0},"method":{"name":"kernel"},)"
      R"("surfaces":[{"field":"q","isovalue":1}],"region":{"x":[0,10]},"light":{},)"
      R"("annotations":{"legend":true,"titleText":"of a","titleStyle":{"size":2}},)" +
      kept;
  EXPECT_EQ(patched(before, dataset_patch("b")),
            R"({"annotations":{"legend":true,"titleStyle":{"size":2}},"dataset":"b",)" + kept);
  const Json schema = read_protocol_json("view.schema.json");
  for (const auto& [key, property] : schema.at("properties").items()) {
    EXPECT_TRUE(Json::parse(before).contains(key)) << key;
  }
}

TEST(SetAt, AcceptsJsonOrPlainText) {
  EXPECT_EQ(set("{}", "/step", "3"), R"({"step":3})");
  EXPECT_EQ(set("{}", "/dataset", "tornado"), R"({"dataset":"tornado"})");
  EXPECT_EQ(set("{}", "/dataset", "\"2020\""), R"({"dataset":"2020"})");
  EXPECT_EQ(set("{}", "/camera/eye", "[1, 2, 3]"), R"({"camera":{"eye":[1,2,3]}})");
  EXPECT_EQ(set("{}", "/image/background", "#102030"), R"({"image":{"background":"#102030"}})");
  EXPECT_EQ(set("{}", "/vector/jitter/overlap", "false"),
            R"({"vector":{"jitter":{"overlap":false}}})");
  EXPECT_EQ(set("{}", "/vector/field", "null"), R"({"vector":{"field":null}})");
  EXPECT_EQ(set(R"({"camera":{"fovY":20}})", "/camera/fovY", "50"), R"({"camera":{"fovY":50}})");
  EXPECT_EQ(set(R"({"camera":{"eye":[0,0,5]}})", "/camera/eye", "null"), "{}");
  EXPECT_EQ(set(R"({"step":9})", "", R"({"dataset":"x"})"), R"({"dataset":"x"})");
}

TEST(SetAt, ReachesIntoArrays) {
  EXPECT_EQ(set(R"({"camera":{"eye":[1,2,3]}})", "/camera/eye/1", "7"),
            R"({"camera":{"eye":[1,7,3]}})");
  EXPECT_EQ(set("{}", "/scalars/0/field", "cloud"), R"({"scalars":[{"field":"cloud"}]})");
  EXPECT_EQ(set(R"({"scalars":[{"field":"a"}]})", "/scalars/-/field", "b"),
            R"({"scalars":[{"field":"a"},{"field":"b"}]})");
  EXPECT_EQ(set(R"({"scalars":[{"field":"a"}]})", "/scalars/1", R"({"field":"b"})"),
            R"({"scalars":[{"field":"a"},{"field":"b"}]})");
}

TEST(SetAt, RefusesInvalidPointers) {
  const ViewDocument document = document_of(R"({"step":1,"scalars":[{"field":"a"}]})");
  const auto fault = [&](const char* pointer, const char* value) {
    const auto result = set_at(document, pointer, value);
    EXPECT_FALSE(result.has_value()) << pointer;
    return result ? ErrorKind::internal : result.error().kind;
  };
  EXPECT_EQ(fault("step", "1"), ErrorKind::invalid);
  EXPECT_EQ(fault("/step/x", "1"), ErrorKind::invalid);
  EXPECT_EQ(fault("/scalars/2/field", "b"), ErrorKind::invalid);
  EXPECT_EQ(fault("/scalars/01/field", "b"), ErrorKind::invalid);
  EXPECT_EQ(fault("/scalars/x/field", "b"), ErrorKind::invalid);
  EXPECT_EQ(fault("/scalars/99999999999999999999/field", "b"), ErrorKind::invalid);
  EXPECT_EQ(fault("/a~2b", "1"), ErrorKind::invalid);
  EXPECT_EQ(fault("/a~", "1"), ErrorKind::invalid);
  EXPECT_EQ(fault("/camera/fovY", "wide"), ErrorKind::invalid);
  EXPECT_EQ(fault("/camera/fovY", "1e999"), ErrorKind::invalid);
  EXPECT_EQ(fault("/zoom", "1"), ErrorKind::invalid);
  EXPECT_EQ(fault("/dataset", "\xff\xfe"), ErrorKind::malformed);
  std::string deep;
  for (int i = 0; i < 100000; ++i) deep += "/a";
  EXPECT_EQ(fault(deep.c_str(), "1"), ErrorKind::invalid);
  const auto escaped = set_at(document, "/a~1b~0c", "1");
  ASSERT_FALSE(escaped.has_value());
  EXPECT_EQ(escaped.error().at.front().pointer, "/a~1b~0c");
}

TEST(TextLimits, BytesAreLimitedExactly) {
  const std::string view = R"({"step":1})";
  const std::string fits = view + std::string(limits::message_bytes_max - view.size(), ' ');
  EXPECT_TRUE(ViewDocument::parse(fits).has_value());
  const auto refused = ViewDocument::parse(fits + " ");
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().kind, ErrorKind::too_large);
  EXPECT_THAT(refused.error().message, HasSubstr("65536"));
  EXPECT_EQ(parse_client_message(fits + " ").error().kind, ErrorKind::too_large);
}

TEST(TextLimits, DepthIsLimitedExactly) {
  const auto nested = [](std::size_t depth) {
    std::string text;
    for (std::size_t i = 0; i < depth; ++i) text += i % 2 == 0 ? "{\"a\":" : "[";
    text += "1";
    for (std::size_t i = depth; i > 0; --i) text += i % 2 == 1 ? "}" : "]";
    return text;
  };
  const auto fits = ViewDocument::parse(nested(limits::json_depth_max));
  ASSERT_FALSE(fits.has_value());
  EXPECT_EQ(fits.error().kind, ErrorKind::invalid) << "syntactically valid, with an unknown key";
  const auto deep = ViewDocument::parse(nested(limits::json_depth_max + 1));
  ASSERT_FALSE(deep.has_value());
  EXPECT_EQ(deep.error().kind, ErrorKind::malformed);
  EXPECT_THAT(deep.error().message, HasSubstr("32 levels"));
  for (const char bracket : {'[', '{'}) {
    const auto endless = ViewDocument::parse(std::string(60000, bracket));
    ASSERT_FALSE(endless.has_value());
    EXPECT_EQ(endless.error().kind, ErrorKind::malformed);
  }
  EXPECT_FALSE(ViewDocument{}.patched(nested(5000)).has_value());
}

TEST(TextLimits, NumbersAtTheLimitsOfDoublesAreNeverWrapped) {
  const auto kind = [](const std::string& number) {
    const auto result = ViewDocument::parse(R"({"vector":{"jitter":{"seed":)" + number + "}}}");
    return result ? "taken" : problem_from(result.error()).errors.at(0).pointer;
  };
  const std::string at = "/vector/jitter/seed";
  EXPECT_EQ(kind("4294967295"), "taken");
  EXPECT_EQ(kind("4.294967295e9"), "taken");
  for (const char* beyond :
       {"4294967296", "-4294967295", "9223372036854775807", "9223372036854775808",
        "18446744073709551615", "18446744073709551616", "-9223372036854775808",
        "-9223372036854775809", "1e18", "1e19", "1e308", "1e309", "-1e999", "0.5",
        "340282366920938463463374607431768211456"}) {
    EXPECT_EQ(kind(beyond), at) << beyond;
  }
}

}  // namespace
}  // namespace windsplat::protocol::testing
