// REST responses about values and jobs, validated against messages.schema.json; requests for
// datasets.
#include "protocol/measurements.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "protocol/codec.hpp"
#include "protocol/folder.hpp"
#include "protocol/limits.hpp"
#include "support.hpp"

namespace windsplat::protocol::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

ProbedField mixed_wind() { return {"wind", true, "m/s", {"m/s", "m/s", "Pa/s"}}; }

PositionDescription position() {
  return {{1, 0, 2}, {10, -45.5, 850}, {"degrees_east", "degrees_north", "hPa"}};
}

TEST(Measurements, ProbeReportsEveryFieldWithUnitsAndNullWhereMasked) {
  ProbeDescription probe;
  probe.position = position();
  probe.step = 3;
  probe.fields = {{"cloud", false, "1", {"1"}},
                  mixed_wind(),
                  {"flow", true, "m", {"m", "m"}},
                  {"qi", false, "kg/kg", {"kg/kg"}}};
  probe.values = {std::vector{0.4}, std::vector{1.0, -2.0, 0.5}, std::vector{3.0, 4.0},
                  std::nullopt};
  const std::string json = encode_probe(probe);
  expect_shape("probe", json);
  const Json answer = Json::parse(json);
  EXPECT_EQ(answer["values"]["cloud"], (Json{{"value", 0.4}, {"units", "1"}}));
  EXPECT_EQ(answer["values"]["wind"]["value"], Json({1, -2, 0.5}));
  EXPECT_EQ(answer["values"]["wind"]["componentUnits"], Json({"m/s", "m/s", "Pa/s"}));
  EXPECT_FALSE(answer["values"]["flow"].contains("componentUnits"));
  EXPECT_TRUE(answer["values"]["qi"]["value"].is_null());
  EXPECT_EQ(answer["position"]["y"], -45.5);
  EXPECT_EQ(answer["position"]["units"]["z"], "hPa");
  EXPECT_EQ(answer["position"]["index"]["z"], 2);
}

TEST(Measurements, ValuesReportTheEndsOfTheirAxesOrEveryCoordinate) {
  ValuesDescription values;
  values.field = mixed_wind();
  values.step = 2;
  values.time = {6, "2001-01-01T06:00:00Z"};
  values.dims = {"component", "y", "x"};
  values.shape = {3, 2, 3};
  values.axes = {ValuesAxis{"lon", "degrees_east", 34, 1, {-20, -10, 0}},
                 ValuesAxis{"lat", "degrees_north", 0, 2, {-80, -60}},
                 ValuesAxis{"p", "hPa", 1, 1, {700}}};
  values.turn = 36;
  const std::string ends = encode_values(values, ValuesDetail::ends);
  expect_shape("values", ends);
  const Json x = Json::parse(ends)["axes"]["x"];
  EXPECT_EQ(x, (Json{{"name", "lon"},
                     {"units", "degrees_east"},
                     {"index", 34},
                     {"stride", 1},
                     {"count", 3},
                     {"turn", 36},
                     {"first", -20},
                     {"last", 0}}));
  values.longitudes = {1, 2, 3, 4, 5, 6};
  values.latitudes = {6, 5, 4, 3, 2, 1};
  const std::string all = encode_values(values, ValuesDetail::all);
  expect_shape("values", all);
  EXPECT_EQ(Json::parse(all)["axes"]["x"]["coordinates"], Json({-20, -10, 0}));
  EXPECT_EQ(Json::parse(all)["latitudes"], Json({6, 5, 4, 3, 2, 1}));
  EXPECT_FALSE(Json::parse(all)["axes"]["y"].contains("turn"));
}

TEST(Measurements, UploadsHaveTheirShape) {
  expect_shape("upload", encode_upload({"a.nc", 3, "sha-256=:" + std::string(43, 'A') + "=:",
                                        "2001-01-01T03:00:00Z"}));
  EXPECT_EQ(parse_dataset_request(R"({"upload": "a.nc"})")->upload, "a.nc");
  EXPECT_FALSE(parse_dataset_request(R"({"upload": "a.nc", "path": "b.nc"})"));
  EXPECT_FALSE(parse_dataset_request(R"({"upload": ""})"));
}

TEST(Measurements, SeriesHistogramAndRangeHaveTheirShapes) {
  SeriesDescription series{
      position(), mixed_wind(), {{0, "a"}, {1, "b"}}, {std::vector{1.0, 2.0, 3.0}, std::nullopt}};
  expect_shape("series", encode_series(series));
  EXPECT_EQ(Json::parse(encode_series(series))["values"], Json({{1, 2, 3}, nullptr}));
  HistogramDescription histogram;
  histogram.counts = {1, 2};
  expect_shape("histogram", encode_histogram(histogram));
  EXPECT_TRUE(Json::parse(encode_histogram(histogram))["range"].is_null());
  histogram.range = Range{1, 100};
  histogram.log = true;
  histogram.edges = {1, 10, 100};
  histogram.below = 4;
  expect_shape("histogram", encode_histogram(histogram));
  const Json told = Json::parse(encode_histogram(histogram));
  EXPECT_EQ(told["edges"], Json({1, 10, 100}));
  EXPECT_EQ(told["below"], 4);
  expect_shape("fieldRange", encode_range({Range{-1, 2}, 5, "all", {}}));
  EXPECT_EQ(Json::parse(encode_range({std::nullopt, 5, "step", {}})),
            (Json{{"range", nullptr}, {"masked", 5}, {"rangeOf", "step"}}));
  RangeDescription with_places{Range{-1, 2}, 5, "step", {}};
  with_places.places.emplace();
  (*with_places.places)[1].index = {3, 1, 2};
  expect_shape("fieldRange", encode_range(with_places));
  EXPECT_EQ(Json::parse(encode_range(with_places))["places"]["max"]["index"]["x"], 3);
}

TEST(Measurements, PickHasItsShape) {
  expect_shape("pick", encode_pick(std::nullopt));
  EXPECT_EQ(Json::parse(encode_pick(std::nullopt)), (Json{{"feature", nullptr}}));
  PickedFeature feature;
  feature.layer = PickedLayer::lines;
  feature.field = "wind";
  feature.value = 57.25;
  feature.units = "m/s";
  feature.position.index = {5, 3, 2};
  feature.share = 0.75;
  feature.depth = 3.5;
  feature.at = {120.5, 80};
  expect_shape("pick", encode_pick(feature));
  const Json told = Json::parse(encode_pick(feature))["feature"];
  EXPECT_EQ(told["layer"], "lines");
  EXPECT_EQ(told["value"], 57.25);
  EXPECT_EQ(told["at"], Json({120.5, 80}));
  EXPECT_EQ(told["position"]["index"]["z"], 2);
  EXPECT_FALSE(told.contains("surface"));
  feature.layer = PickedLayer::medium;
  EXPECT_EQ(Json::parse(encode_pick(feature))["feature"]["layer"], "medium");
  feature.layer = PickedLayer::surface;
  feature.surface = 2;
  feature.value.reset();
  expect_shape("pick", encode_pick(feature));
  const Json masked = Json::parse(encode_pick(feature))["feature"];
  EXPECT_EQ(masked["layer"], "surface");
  EXPECT_EQ(masked["surface"], 2);
  EXPECT_TRUE(masked["value"].is_null());
}

TEST(Measurements, ForecastHasItsShape) {
  ForecastPoint coarse;
  coarse.method = "kernel";
  coarse.width = 320;
  coarse.height = 180;
  coarse.coarser = 2;
  coarse.ms = 1.5;
  coarse.error = 0.04;
  coarse.error_low = 0.02;
  coarse.error_high = 0.08;
  ForecastPoint fine = coarse;
  fine.method = "slab";
  fine.slab_thickness = 0.25;
  fine.timed = fine.measured = fine.pareto = true;
  ForecastDescription forecast{640, 360, {coarse, fine}, {}};
  expect_shape("forecast", encode_forecast(forecast));
  EXPECT_TRUE(Json::parse(encode_forecast(forecast))["chosen"].is_null());
  forecast.chosen = 1;
  expect_shape("forecast", encode_forecast(forecast));
  const Json told = Json::parse(encode_forecast(forecast));
  EXPECT_EQ(told["view"], (Json{{"width", 640}, {"height", 360}}));
  EXPECT_EQ(told["chosen"], 1);
  EXPECT_TRUE(told["points"][0]["slabThickness"].is_null());
  EXPECT_EQ(told["points"][0]["kind"], "estimated");
  EXPECT_EQ(told["points"][0]["coarser"], 2);
  EXPECT_EQ(told["points"][1]["slabThickness"], 0.25);
  EXPECT_EQ(told["points"][1]["kind"], "measured");
  EXPECT_EQ(told["points"][1]["errorHigh"], 0.08);
}

TEST(Measurements, JobsHaveTheirShape) {
  JobDescription job;
  job.id = "1";
  job.kind = "dataset";
  job.state = "queued";
  expect_shape("job", encode_job(job));
  job.state = "failed";
  job.problem.emplace();
  job.problem->status = 422;
  job.problem->detail = "no data";
  expect_shape("job", encode_job(job));
  EXPECT_EQ(Json::parse(encode_job(job))["problem"]["status"], 422);
  job.problem.reset();
  job.kind = "reference";
  job.result = AnimationDescription{"b2",  "/v1/animations/b2.mp4", "mp4", 640, 480, 90, 24,
                                    12345, "2026-01-01T14:00:00Z"};
  expect_shape("job", encode_job(job));
  EXPECT_EQ(Json::parse(encode_job(job))["result"]["movie"], "/v1/animations/b2.mp4");
  job.result = ReferenceDescription{"a1", "/v1/references/a1.png", 640, 480, 2e-4, 0.01, 74};
  expect_shape("job", encode_job(job));
  EXPECT_EQ(Json::parse(encode_job(job))["result"]["error"]["value"], 2e-4);
  std::get<ReferenceDescription>(*job.result).psnr = std::numeric_limits<double>::infinity();
  expect_shape("job", encode_job(job));
  EXPECT_EQ(Json::parse(encode_job(job))["result"]["error"]["psnr"], nullptr);
  expect_shape("jobs", encode_jobs({job, job}));
  expect_shape("jobs", encode_jobs({}));
}

TEST(Measurements, FoldersHaveTheirShape) {
  FolderDescription folder;
  expect_shape("folder", encode_folder(folder));
  folder.folder = "runs";
  folder.entries = {{"may", true, 0, ""}, {"a.nc", false, 12, "netCDF"}, {"b.txt", false, 3, ""}};
  folder.groups = {{"s_*.nc", 24}};
  folder.next = "b.txt";
  folder.omitted = 2;
  folder.cut = true;
  expect_shape("folder", encode_folder(folder));
  const Json told = Json::parse(encode_folder(folder));
  EXPECT_EQ(told["entries"][0]["bytes"], nullptr);
  EXPECT_EQ(told["entries"][1]["bytes"], 12);
  EXPECT_EQ(told["entries"][2]["format"], nullptr);
}

TEST(Measurements, DatasetRequestIsAPathOrEntries) {
  using ::testing::Pair;
  EXPECT_EQ(parse_dataset_request(R"({"path":"a/b.nc"})")->path, "a/b.nc");
  const auto entries =
      parse_dataset_request(R"({"from":"gcm","selection":{"number":3,"bin":0.5,"run":"a b"}})");
  ASSERT_TRUE(entries);
  EXPECT_EQ(entries->from, "gcm");
  EXPECT_THAT(entries->selection, ::testing::UnorderedElementsAre(
                                      Pair("number", "3"), Pair("bin", "0.5"), Pair("run", "a b")));
  const auto list = parse_dataset_request(R"({"title":"T","files":["a_*.nc","b.nc"]})");
  ASSERT_TRUE(list);
  EXPECT_EQ(list->first, "a_*.nc");
  EXPECT_EQ(Json::parse(list->list), Json::parse(R"({"title":"T","files":["a_*.nc","b.nc"]})"));
  const std::string longest(limits::path_chars_max, 'p');
  EXPECT_TRUE(parse_dataset_request(R"({"path":")" + longest + "\"}"));
  for (const auto& [json, pointer] : std::vector<std::pair<std::string, std::string>>{
           {R"({"path":")" + longest + "p\"}", "/path"},
           {R"({"path":""})", "/path"},
           {R"({"path":7})", "/path"},
           {R"({"path":"a\nb"})", "/path"},
           {R"({"path":"a\u0000b"})", "/path"},
           {R"({})", "/path"},
           {R"({"path":"a","mode":1})", "/mode"},
           {R"({"path":"a","from":"b","selection":{"n":1}})", "/path"},
           {R"({"from":"b"})", "/selection"},
           {R"({"selection":{"n":1}})", "/from"},
           {R"({"from":"b","selection":{}})", "/selection"},
           {R"({"from":"b","selection":3})", "/selection"},
           {R"({"from":"b","selection":{"n":[1]}})", "/selection/n"},
           {R"({"from":"b","selection":{"n":""}})", "/selection/n"},
           {R"({"from":"b","selection":{"":1}})", "/selection/"},
           {R"({"files":[]})", "/files"},
           {R"({"files":"a.nc"})", "/files"},
           {R"({"files":[3]})", "/files/0"},
           {R"({"files":["a.nc",""]})", "/files/1"},
           {R"({"files":["a.nc","b/../../c.nc"]})", "/files/1"},
           {R"({"files":["/a.nc"]})", "/files/0"},
           {R"({"files":["a.nc"],"titles":"T"})", "/titles"},
           {R"({"files":["a.nc"],"title":3})", "/title"},
           {R"({"files":["a.nc"],"windsplat":"raw"})", "/windsplat"},
           {R"({"files":["a.nc"],"selection":[3]})", "/selection"},
           {R"({"files":["a.nc"],"path":"b.nc"})", "/path"},
           {R"({"path":"b.nc","selection":{"number":3}})", "/selection"},
           {R"([])", ""}}) {
    const auto refused = parse_dataset_request(json);
    ASSERT_FALSE(refused) << json;
    EXPECT_EQ(refused.error().at.front().pointer, pointer) << json;
  }
  EXPECT_THAT(parse_dataset_request(R"({"path":"b.nc","selection":{"number":3}})").error().message,
              HasSubstr("winds.nc?number=3"));
  // A body without a known key names all three.
  for (const char* json : {"{}", R"({"file":"a.nc"})"}) {
    const std::string message = parse_dataset_request(json).error().message;
    for (const char* key : {"\"path\"", "\"files\"", "\"from\"", "--data-host"}) {
      EXPECT_THAT(message, HasSubstr(key)) << json;
    }
  }
  for (const char* json : {"", "{", R"({"path":"a","path":"b"})", "{\"path\":\"\xff\"}"}) {
    const auto refused = parse_dataset_request(json);
    ASSERT_FALSE(refused) << json;
    EXPECT_EQ(refused.error().kind, ErrorKind::malformed) << json;
  }
}

TEST(Views, UnknownKeyIsReportedWithTheKnownOnes) {
  const auto refused = ViewDocument::parse(R"({"depthCue":{"strenght":1}})");
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("strength"));
  EXPECT_THAT(refused.error().message, HasSubstr("near"));
  EXPECT_THAT(refused.error().message, HasSubstr("far"));
}

}  // namespace
}  // namespace windsplat::protocol::testing
