// Client messages as typed values; server messages and REST shapes validated against
// messages.schema.json.
#include "protocol/messages.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cctype>
#include <limits>
#include <sstream>

#include "protocol/codec.hpp"
#include "protocol/limits.hpp"
#include "protocol/problems/problem_types.hpp"
#include "support.hpp"

namespace windsplat::protocol::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

template <class Message>
Message read(const std::string& json) {
  const auto message = parse_client_message(json);
  EXPECT_TRUE(message.has_value()) << message.error().message;
  EXPECT_TRUE(std::holds_alternative<Message>(*message)) << json;
  return std::get<Message>(*message);
}

FieldDescription wind_field() {
  FieldDescription field;
  field.name = "wind";
  field.kind = "vector";
  field.components = {"u", "v", "w"};
  field.units = "m/s";
  field.long_name = "Wind";
  field.range = Range{0, 61.5};
  field.masked = 7;
  field.range_of = "step";
  field.dtype = "float32";
  return field;
}

DatasetDescription climate() {
  DatasetDescription dataset;
  dataset.id = "climate";
  dataset.title = "Climate";
  dataset.source = "built-in sample";
  dataset.format = "sample";
  dataset.state = "ready";
  dataset.dims = {2, 1, 3};
  for (AxisDescription& axis : dataset.axes) axis.kind = "cartesian";
  dataset.axes[0] = {"lon", "longitude", "degrees_east", "longitude", {0, 180}, {-0.5, 0.5}};
  dataset.world_min = {-1, -0.5, -0.15};
  dataset.world_max = {1, 0.5, 0.15};
  dataset.mappings = {"flat", "sphere"};
  dataset.fields = {wind_field()};
  dataset.left_out = {{"ps", "two-dimensional"}};
  dataset.notes = {"winds were turned from the grid's axes to east and north"};
  dataset.choices = {{"number", 3, {"0", "1", "2"}, "1"}};
  dataset.levels = {{{2, 1, 3}, {0, 0, 0}, 1, 72, 6'000'000'000, 5'000'000'001},
                    {{1, 1, 2}, {1, 0, 1}, 1, 24, std::nullopt}};
  dataset.steps = {{0, "2001-01-01T00:00:00Z"}, {1.5, "2001-01-01T01:30:00Z"}};
  dataset.time_units = "hours since 2001-01-01";
  dataset.time_calendar = "noleap";
  dataset.resident_bytes = 48;
  dataset.bytes_when_resident = 5'000'000'000;
  dataset.default_view.dataset = "climate";
  return dataset;
}

FrameInfo frame_info() {
  FrameInfo info;
  info.width = 640;
  info.height = 480;
  info.samples = 972800;
  info.tiles = 300;
  info.fields = {"wind"};
  info.bytes = 3'891'200;
  info.variant = "vector perspective";
  return info;
}

TEST(ClientMessages, CarryTheirValues) {
  const auto open = read<OpenMessage>(R"({"type":"open","id":4294967295,"dataset":"gcm"})");
  EXPECT_EQ(open.id, 4294967295U);
  EXPECT_EQ(open.dataset, "gcm");
  const auto patch =
      read<PatchMessage>(R"({"type":"patch","rev":7,"t":12.5,"patch":{"camera":{"eye":null}}})");
  EXPECT_EQ(patch.rev, 7U);
  EXPECT_EQ(patch.t, 12.5);
  EXPECT_EQ(Json::parse(patch.patch_json), (Json{{"camera", {{"eye", nullptr}}}}));
  const auto still = read<StillMessage>(
      R"({"type":"still","id":2,"width":100,"height":50,"format":"jpeg","scale":2.5})");
  EXPECT_EQ(still.id, 2U);
  EXPECT_EQ(still.width, 100);
  EXPECT_EQ(still.height, 50);
  EXPECT_EQ(still.format, "jpeg");
  EXPECT_EQ(still.scale, 2.5);
  const auto play =
      read<PlayMessage>(R"({"type":"play","from":3,"to":9,"fps":24,"loop":false,"drop":false})");
  EXPECT_EQ(play.from, 3);
  EXPECT_EQ(play.to, 9);
  EXPECT_EQ(play.fps, 24);
  EXPECT_FALSE(play.loop);
  EXPECT_FALSE(play.drop);
  read<PauseMessage>(R"({"type":"pause"})");
  const auto ack = read<AckMessage>(R"({"type":"ack","seq":5,"decodeMs":2.25})");
  EXPECT_EQ(ack.seq, 5U);
  EXPECT_EQ(ack.decode_ms, 2.25);
  EXPECT_TRUE(read<VisibilityMessage>(R"({"type":"visibility","hidden":true})").hidden);
}

TEST(ClientMessages, DefaultsAreThoseOfTheSchema) {
  const Json schema = read_protocol_json("messages.schema.json")["$defs"];
  const auto fallback = [&](const char* message, const char* key) {
    return schema.at(message).at("properties").at(key).at("default");
  };
  const auto patch = read<PatchMessage>(R"({"type":"patch","rev":1,"patch":{}})");
  EXPECT_EQ(fallback("patch", "t"), patch.t);
  const auto still = read<StillMessage>(R"({"type":"still","id":2})");
  EXPECT_FALSE(still.width.has_value());
  EXPECT_FALSE(still.height.has_value());
  EXPECT_EQ(fallback("still", "format"), still.format);
  EXPECT_EQ(fallback("still", "scale"), still.scale);
  const auto play = read<PlayMessage>(R"({"type":"play","from":0,"to":0})");
  EXPECT_EQ(fallback("play", "fps"), play.fps);
  EXPECT_EQ(fallback("play", "loop"), play.loop);
  EXPECT_EQ(fallback("play", "drop"), play.drop);
  EXPECT_EQ(fallback("ack", "decodeMs"), read<AckMessage>(R"({"type":"ack","seq":1})").decode_ms);
}

TEST(ClientMessages, PatchIsParsedReadyToApply) {
  const auto patch = read<PatchMessage>(
      R"({"type":"patch","rev":1,"patch":{"vector":{"field":null},"camera":{"eye":[0,-3,2]}}})");
  const auto view = ViewDocument{}.patched(patch.patch_json);
  ASSERT_TRUE(view.has_value());
  EXPECT_EQ(view->canonical(), R"({"camera":{"eye":[0,-3,2]},"vector":{"field":null}})");
}

TEST(ClientMessages, StillSizeIsCheckedAfterScaling) {
  EXPECT_TRUE(
      parse_client_message(R"({"type":"still","id":1,"width":2048,"height":1080,"scale":4})")
          .has_value());
  const auto wide =
      parse_client_message(R"({"type":"still","id":1,"width":2049,"height":1,"scale":4})");
  ASSERT_FALSE(wide.has_value());
  EXPECT_EQ(wide.error().kind, ErrorKind::too_large);
  const auto area =
      parse_client_message(R"({"type":"still","id":1,"width":2048,"height":1081,"scale":4})");
  ASSERT_FALSE(area.has_value());
  EXPECT_EQ(area.error().kind, ErrorKind::too_large);
}

TEST(ClientMessages, RefusedMessageKeepsItsIdentification) {
  const auto tag = message_tag(R"({"type":"still","id":9,"scale":99})");
  EXPECT_EQ(tag.id, 9U);
  EXPECT_FALSE(tag.rev.has_value());
  EXPECT_EQ(message_tag(R"({"type":"patch","rev":3,"patch":7})").rev, 3U);
  for (const char* text : {R"({"type":"open","id":-1})", R"({"id":4294967296})", R"({"id":"7"})",
                           "[7]", "{", "", R"({"id":1,"id":2})"}) {
    EXPECT_FALSE(message_tag(text).id.has_value()) << text;
  }
}

TEST(ServerMessages, FitTheSchemaAndNameTheirType) {
  const std::vector<std::pair<std::string, ServerMessage>> messages{
      {"hello", HelloMessage{"0.1.0", "s-1", {climate()}, {}}},
      {"opened", OpenedMessage{3, climate()}},
      {"progress", ProgressMessage{std::nullopt, "load", 0.5, std::nullopt}},
      {"progress", ProgressMessage{7, "load", 1, 0.5}},
      {"chosen", ChosenMessage{1, frame_info(), encode_view(View{})}},
      {"unchanged", UnchangedMessage{5, 9}},
      {"stats", StatsMessage{1, 2, 3, 4'000'000'000'000, std::nullopt, 0, 0}},
      {"stats", StatsMessage{1, 2, 3, 4, 23.5, 6, 7}},
      {"error", ErrorMessage{1, 2, problem_from(make_error(ErrorKind::busy, "try later"))}}};
  for (const auto& [type, message] : messages) {
    const std::string json = encode(message);
    expect_shape("serverMessage", json);
    EXPECT_EQ(Json::parse(json).at("type"), type);
  }
}

TEST(ServerMessages, CarryTheirValues) {
  const Json opened = Json::parse(encode(OpenedMessage{3, climate()}));
  EXPECT_EQ(opened["id"], 3);
  EXPECT_EQ(opened["dataset"], Json::parse(encode_dataset(climate())));
  const Json hello = Json::parse(encode(HelloMessage{"0.1.0", "s-1", {climate()}, {}}));
  EXPECT_EQ(hello["protocol"], "windsplat.v1");
  EXPECT_EQ(hello["version"], "0.1.0");
  EXPECT_EQ(hello["session"], "s-1");
  EXPECT_EQ(hello["datasets"][0]["steps"], 2);
  EXPECT_EQ(hello["limits"], Json::parse(encode_service({}))["limits"]);
  const Json small = Json::parse(encode(HelloMessage{"0.1.0", "s-1", {}, {640 * 480, 1000, 2000}}));
  EXPECT_EQ(small["limits"]["imagePixelsMax"], 307'200);
  EXPECT_EQ(small["limits"]["uploadBytesMax"], 1000);
  EXPECT_EQ(small["limits"]["uploadsBytesMax"], 2000);
  const Json progress = Json::parse(encode(ProgressMessage{7, "load", 0.25, 120.5}));
  EXPECT_EQ(progress, Json::parse(R"({"type":"progress","id":7,"phase":"load","done":0.25,
                                      "etaMs":120.5})"));
  EXPECT_EQ(Json::parse(encode(UnchangedMessage{5, 9})),
            Json::parse(R"({"type":"unchanged","rev":5,"seq":9})"));
  const Json stats = Json::parse(encode(StatsMessage{1, 2, 3, 4'000'000'000'000, 23.5, 6, 7}));
  EXPECT_EQ(stats, Json::parse(R"({"type":"stats","frames":1,"dropped":2,"cancelled":3,
                                   "bytes":4000000000000,"playFps":23.5,"stepsDropped":6,
                                   "stepsNotReady":7})"));
}

TEST(ServerMessages, ChosenIsTheFrameInfoWithSeqAndView) {
  const std::string view = R"({"dataset":"climate","vector":{"field":null}})";
  const Json chosen = Json::parse(encode(ChosenMessage{8, frame_info(), view}));
  Json expected = Json::parse(encode_frame_info(frame_info()));
  expected["type"] = "chosen";
  expected["seq"] = 8;
  expected["view"] = Json::parse(view);
  EXPECT_EQ(chosen, expected);
}

TEST(ServerMessages, ErrorHasOnlyKnownMembers) {
  const Problem problem = problem_from(make_error_at(ErrorKind::invalid, "/step", "too large"));
  const Json neither = Json::parse(encode(ErrorMessage{std::nullopt, std::nullopt, problem}));
  EXPECT_FALSE(neither.contains("id"));
  EXPECT_FALSE(neither.contains("rev"));
  EXPECT_EQ(neither["problem"], Json::parse(R"({"type":"problems/invalid-value","status":422,
      "title":"Unprocessable Content","detail":"/step: too large",
      "errors":[{"pointer":"/step","detail":"too large"}]})"));
  EXPECT_EQ(Json::parse(encode(ErrorMessage{std::nullopt, 5, problem}))["rev"], 5);
}

TEST(Shapes, DatasetInFull) {
  const std::string json = encode_dataset(climate());
  expect_shape("dataset", json);
  const Json dataset = Json::parse(json);
  EXPECT_EQ(dataset["dims"], (Json{{"x", 2}, {"y", 1}, {"z", 3}}));
  EXPECT_EQ(dataset["axes"]["x"], Json::parse(R"({"name":"lon","standardName":"longitude",
      "units":"degrees_east","kind":"longitude","coordinates":[0,180],"world":[-0.5,0.5]})"));
  EXPECT_EQ(dataset["world"], Json::parse(R"({"min":[-1,-0.5,-0.15],"max":[1,0.5,0.15]})"));
  EXPECT_EQ(dataset["mappings"], Json::parse(R"(["flat","sphere"])"));
  EXPECT_EQ(dataset["fields"][0], Json::parse(R"({"name":"wind","kind":"vector",
      "components":["u","v","w"],"units":"m/s","standardName":"","longName":"Wind",
      "range":[0,61.5],"masked":7,"rangeOf":"step","dtype":"float32"})"));
  EXPECT_EQ(dataset["steps"], Json::parse(R"({"count":2,"times":[
      {"value":0,"text":"2001-01-01T00:00:00Z"},{"value":1.5,"text":"2001-01-01T01:30:00Z"}]})"));
  EXPECT_EQ(dataset["leftOut"], Json::parse(R"([{"name":"ps","reason":"two-dimensional"}])"));
  EXPECT_EQ(dataset["choices"],
            Json::parse(R"([{"name":"number","length":3,"values":["0","1","2"],"chosen":"1"}])"));
  EXPECT_EQ(dataset["levels"], Json::parse(R"([
      {"dims":{"x":2,"y":1,"z":3},"halvings":[0,0,0],"bricks":1,"bytes":72,
       "storedBytes":6000000000,"residentBytes":5000000001},
      {"dims":{"x":1,"y":1,"z":2},"halvings":[1,0,1],"bricks":1,"bytes":24,"residentBytes":0}])"));
  EXPECT_EQ(dataset["timeUnits"], "hours since 2001-01-01");
  EXPECT_EQ(dataset["timeCalendar"], "noleap");
  EXPECT_EQ(dataset["residentBytes"], 48);
  EXPECT_EQ(dataset["bytesWhenResident"], 5'000'000'000);
  EXPECT_EQ(dataset["defaultView"].dump(), encode_view(climate().default_view));
}

TEST(Shapes, UnreadDatasetHasNoRangesAndNoView) {
  DatasetDescription dataset = climate();
  dataset.default_view = View{};
  dataset.levels.clear();
  dataset.fields[0].range.reset();
  dataset.fields[0].masked.reset();
  dataset.fields[0].range_of.clear();
  const std::string json = encode_dataset(dataset);
  expect_shape("dataset", json);
  const Json told = Json::parse(json);
  EXPECT_FALSE(told.contains("defaultView"));
  EXPECT_FALSE(told.contains("levels"));
  EXPECT_TRUE(told["fields"][0]["range"].is_null());
  EXPECT_TRUE(told["fields"][0]["masked"].is_null());
}

TEST(Shapes, DatasetListHasShortForms) {
  const std::string json = encode_dataset_list({climate()});
  expect_shape("datasets", json);
  const Json list = Json::parse(json)["datasets"];
  ASSERT_EQ(list.size(), 1U);
  EXPECT_EQ(list[0]["steps"], 2);
  EXPECT_FALSE(list[0].contains("axes"));
  EXPECT_EQ(encode_dataset_list({}), R"({"datasets":[]})");
}

TEST(Shapes, FrameInfoContainsEveryCount) {
  FrameInfo info = frame_info();
  info.error_value = 0.002;
  info.error_kind = "measured";
  info.culled = 1;
  info.skipped_vector = 2;
  info.skipped_scalar = 3;
  info.skipped_both = 4;
  info.occluded = 5;
  info.pixel_updates = 6;
  info.exponentials = 7;
  info.tiles_stopped = 8;
  info.skipped_change = 0.125;
  info.skipped_change_kind = "measured";
  info.skipped_bound = 0.25;
  info.stop_bound = 0.125;
  const std::string json = encode_frame_info(info);
  expect_shape("frameInfo", json);
  EXPECT_EQ(Json::parse(json), Json::parse(R"({"method":"kernel","compositing":"analytic",
      "stride":1,"slabThickness":null,"width":640,"height":480,
      "error":{"value":0.002,"kind":"measured"},"jpegError":null,
      "skippedChange":{"value":0.125,"kind":"measured"},
      "work":{"samples":972800,"culled":1,"skippedVector":2,"skippedScalar":3,"skippedBoth":4,
              "occluded":5,"pixelUpdates":6,"exponentials":7,"tiles":300,"tilesStopped":8,
              "skippedBound":0.25,"stopBound":0.125,
              "fields":["wind"],"bytes":3891200,"variant":"vector perspective",
              "parts":[]}})"));
}

TEST(Shapes, FrameInfoCountsStreamletsWhereTheyAreTraced) {
  FrameInfo info = frame_info();
  EXPECT_FALSE(Json::parse(encode_frame_info(info))["work"].contains("streamlets"));
  info.streamlets = StreamletCounts{10, 40, 500, 12, 3, 2, 1, 2};
  const std::string json = encode_frame_info(info);
  expect_shape("frameInfo", json);
  EXPECT_EQ(Json::parse(json)["work"]["streamlets"],
            Json::parse(R"({"lines":10,"segments":40,"evaluations":500,
                "ends":{"length":12,"boundary":3,"mask":2,"stagnation":1,"steps":2}})"));
}

TEST(Shapes, FrameInfoNamesTheLevelAndThePartOfDataWithStoredLevels) {
  FrameInfo info = frame_info();
  EXPECT_FALSE(Json::parse(encode_frame_info(info)).contains("detail"));
  info.detail.emplace().drawn = {
      {1, 1, 0}, std::array{std::array{64, 0, 8}, std::array{128, 64, 16}}, {}};
  const std::string json = encode_frame_info(info);
  expect_shape("frameInfo", json);
  EXPECT_EQ(Json::parse(json)["detail"], Json::parse(R"({"wanted":{"halvings":[0,0,0]},
                "drawn":{"halvings":[1,1,0],"first":[64,0,8],"count":[128,64,16]}})"));
  info.detail->drawn.boxes = {{32, 64, 8}, 3};
  const std::string of_boxes = encode_frame_info(info);
  expect_shape("frameInfo", of_boxes);
  EXPECT_EQ(Json::parse(of_boxes)["detail"]["drawn"]["boxes"],
            Json::parse(R"({"size":[32,64,8],"count":3})"));
  info.detail->missing_bytes = 12345;
  const std::string standing_in = encode_frame_info(info);
  expect_shape("frameInfo", standing_in);
  EXPECT_EQ(Json::parse(standing_in)["detail"]["missingBytes"], 12345);
}

TEST(Shapes, FrameInfoHasARowForEachPart) {
  FrameInfo info = frame_info();
  for (const char* part : {"ground", "surfaces", "streamlets", "seeds", "light", "region",
                           "difference", "annotations"}) {
    info.parts.push_back({part, true, 12, 34});
  }
  info.parts[1] = {"surfaces", false, 0, 0};
  const std::string json = encode_frame_info(info);
  expect_shape("frameInfo", json);
  const Json parts = Json::parse(json)["work"]["parts"];
  ASSERT_EQ(parts.size(), 8U);
  EXPECT_EQ(parts[0], Json::parse(R"({"part":"ground","shown":true,"count":12,"bytes":34})"));
  EXPECT_EQ(parts[1], Json::parse(R"({"part":"surfaces","shown":false,"count":0,"bytes":0})"));
}

TEST(Shapes, ErrorsSayWhatWasAskedAndWhetherItIsKept) {
  FrameInfo info = frame_info();
  info.error_asked = 0.001;
  EXPECT_EQ(Json::parse(encode_frame_info(info))["error"],
            Json::parse(R"({"value":null,"kind":"none"})"));
  info.error_value = 0.002;
  info.error_kind = "estimated";
  expect_shape("frameInfo", encode_frame_info(info));
  EXPECT_EQ(Json::parse(encode_frame_info(info))["error"],
            Json::parse(R"({"value":0.002,"kind":"estimated","asked":0.001,"kept":false})"));
  info.error_asked = 0.002;
  EXPECT_EQ(Json::parse(encode_frame_info(info))["error"]["kept"], true);
}

TEST(Shapes, ReportIsTheFrameInfoWithItsTimes) {
  Json expected = Json::parse(encode_frame_info(frame_info()));
  expected["renderMs"] = 12.5;
  expected["encodeMs"] = 0.25;
  EXPECT_EQ(Json::parse(encode_frame_report(frame_info(), 12.5, 0.25)), expected);
}

TEST(Shapes, NumbersThatAreNotFiniteAreNull) {
  FrameInfo info = frame_info();
  info.error_value = std::numeric_limits<double>::quiet_NaN();
  info.jpeg_error = std::numeric_limits<double>::infinity();
  info.skipped_change = std::numeric_limits<double>::quiet_NaN();
  info.skipped_bound = std::numeric_limits<double>::infinity();
  const std::string json = encode_frame_info(info);
  expect_shape("frameInfo", json);
  EXPECT_TRUE(Json::parse(json)["error"]["value"].is_null());
  EXPECT_TRUE(Json::parse(json)["jpegError"].is_null());
  EXPECT_TRUE(Json::parse(json)["skippedChange"]["value"].is_null());
  EXPECT_TRUE(Json::parse(json)["work"]["skippedBound"].is_null());
}

TEST(Shapes, InvalidUtf8IsReplacedWithoutThrowing) {
  DatasetDescription dataset = climate();
  dataset.title = "caf\xe9 \xff";
  EXPECT_EQ(Json::parse(encode_dataset(dataset))["title"], "caf\xef\xbf\xbd \xef\xbf\xbd");
  Problem problem;
  problem.title = "broken";
  problem.detail = "\xc0\xaf";
  expect_shape("problem", encode_problem(problem));
}

TEST(Shapes, ServiceHealthColorMapsAndPresets) {
  ServiceDescription service;
  service.version = "0.1.0";
  service.links = {{"datasets", "/v1/datasets"}, {"stream", "/v1/stream"}};
  const std::string json = encode_service(service);
  expect_shape("service", json);
  EXPECT_EQ(Json::parse(json)["links"]["stream"], "/v1/stream");
  const std::string maps = encode_color_maps({{"grays", "sequential", {{0, 0, 0}, {255, 9, 160}}}});
  expect_shape("colorMaps", maps);
  EXPECT_EQ(Json::parse(maps), Json::parse(R"({"colormaps":[{"name":"grays","kind":"sequential",
                                               "colors":["#000000","#ff09a0"]}]})"));
  for (const char* state : {"live", "ready", "draining"}) {
    expect_shape("health", encode_health(state));
  }
  expect_shape("presets", encode_presets({"default", "top"}));
  EXPECT_EQ(encode_presets({"default", "top"}), R"({"presets":["default","top"]})");
}

// Every constant of limits.hpp is published under its name in camel case with its value.
TEST(Shapes, LimitsAreThoseOfTheLimitsFiles) {
  const Json limits = Json::parse(encode_service({}))["limits"];
  std::istringstream source(read_protocol_file("limits.hpp") +
                            read_protocol_file("animation/limits.hpp"));
  std::size_t found = 0;
  for (std::string line; std::getline(source, line);) {
    const auto equals = line.find(" = ");
    if (!line.starts_with("inline constexpr ") || equals == std::string::npos) continue;
    ++found;
    std::string name;
    for (const char c : line.substr(0, equals).substr(line.rfind(' ', equals - 1) + 1)) {
      const bool raise = !name.empty() && name.back() == '_';
      if (raise) name.pop_back();
      name += raise ? static_cast<char>(std::toupper(c)) : c;
    }
    ASSERT_TRUE(limits.contains(name)) << name;
    const std::string value = line.substr(equals + 3, line.find(';') - equals - 3);
    if (value.find_first_not_of("0123456789.e-") == std::string::npos) {
      EXPECT_EQ(limits[name].get<double>(), std::stod(value)) << name;
    }
  }
  constexpr std::size_t of_this_server = 2;  // those of uploads
  EXPECT_EQ(found + of_this_server, limits.size());
  EXPECT_EQ(limits["messageBytesMax"], 65536);
  EXPECT_EQ(limits["imagePixelsMax"], 8192 * 4320);
}

TEST(Problems, StatusFollowsTheKindOfError) {
  const std::vector<std::pair<ErrorKind, int>> expected{
      {ErrorKind::malformed, 400},     {ErrorKind::invalid, 422},   {ErrorKind::not_found, 404},
      {ErrorKind::bad_data, 422},      {ErrorKind::too_large, 413}, {ErrorKind::busy, 429},
      {ErrorKind::draining, 503},      {ErrorKind::cancelled, 499}, {ErrorKind::internal, 500},
      {ErrorKind::out_of_memory, 507},
  };
  for (const auto& [kind, status] : expected) {
    const Problem problem = problem_from(make_error(kind, "why"));
    EXPECT_EQ(problem.status, status);
    EXPECT_EQ(problem.detail, "why");
    EXPECT_EQ(problem.type, "problems/" + std::string(problem_type_of(kind).slug));
    EXPECT_FALSE(problem.title.empty());
    expect_shape("problem", encode_problem(problem));
    EXPECT_FALSE(Json::parse(encode_problem(problem)).contains("errors"));
  }
}

}  // namespace
}  // namespace windsplat::protocol::testing
