// Queries of values over REST compared with the numbers in the file; datasets opened by POST.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/stat.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numeric>
#include <thread>

#include "server/data/model/source.hpp"
#include "server/data/model/volume.hpp"
#include "server/data/open/open.hpp"
#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

void expect_problem_saying(const Answer& answer, int status, const std::string& words = "") {
  EXPECT_EQ(answer.status, status) << answer.body;
  EXPECT_EQ(answer.header("content-type"), "application/problem+json");
  EXPECT_THAT(json_of(answer).value("detail", ""), HasSubstr(words));
}

// The same file, opened without a server.
class Measures : public testing::Test {
 protected:
  void SetUp() override {
    const auto added = store_.add(small_file());
    ASSERT_TRUE(added);
    dataset_ = *added;
  }
  [[nodiscard]] std::uint16_t port() const { return server_.port(); }
  Json ask(const std::string& what) {
    const Answer answer = get(port(), "/v1/datasets/small/" + what);
    EXPECT_EQ(answer.status, 200) << what << ' ' << answer.body;
    return json_of(answer);
  }
  Answer refused(const std::string& what) { return get(port(), "/v1/datasets/small/" + what); }
  const windsplat::data::FieldInfo& field(windsplat::data::FieldKind kind) {
    return *dataset_->info().first(kind);
  }
  std::shared_ptr<const windsplat::data::Volume> volume(const std::string& name, int step) {
    return dataset_->volume(name, static_cast<std::size_t>(step)).value();
  }
  // A query for a position slightly off the sample.
  std::string near(int i, int j, int k) {
    std::string query = "?";
    const std::array<int, 3> index{i, j, k};
    for (std::size_t a = 0; a < 3; ++a) {
      const auto& c = dataset_->info().grid.axes[a].coordinates;
      const auto at = static_cast<std::size_t>(index[a]);
      const double step = at + 1 < c.size() ? c[at + 1] - c[at] : c[at] - c[at - 1];
      query += std::string(a > 0 ? "&" : "") + "xyz"[a] + '=' + std::to_string(c[at] + 0.2 * step);
    }
    return query;
  }
  static std::size_t flat(int i, int j, int k) {
    return static_cast<std::size_t>((k * 16 + j) * 32 + i);
  }

  windsplat::data::Store store_{std::uint64_t{1} << 30};
  std::shared_ptr<windsplat::data::Dataset> dataset_;
  TestServer server_;
};

TEST_F(Measures, ProbeReturnsEveryFieldAtTheNearestSample) {
  const Json probe = ask("probe" + near(5, 3, 2) + "&step=1");
  EXPECT_EQ(probe["step"], 1);
  EXPECT_EQ(probe["position"]["index"], Json({{"x", 5}, {"y", 3}, {"z", 2}}));
  for (const auto& info : dataset_->info().fields) {
    EXPECT_EQ(probe["values"].contains(info.name), !info.derived) << info.name;
    if (info.derived) continue;
    const Json& told = probe["values"][info.name];
    const auto there = volume(info.name, 1);
    EXPECT_EQ(told["units"], info.units);
    for (std::size_t c = 0; c < info.components.size(); ++c) {
      const Json& value = info.components.size() == 1 ? told["value"] : told["value"][c];
      EXPECT_EQ(value.get<float>(), there->component(static_cast<int>(c))[flat(5, 3, 2)])
          << info.name;
    }
  }
}

// A file whose first scalar is the height of each sample, which rises with the levels and with x.
class RaisedSource : public windsplat::data::Source {
 public:
  explicit RaisedSource(std::unique_ptr<windsplat::data::Source> source)
      : source_(std::move(source)) {}
  [[nodiscard]] const windsplat::data::DatasetInfo& info() const override {
    return source_->info();
  }
  windsplat::Result<windsplat::data::Volume> read(std::size_t field, std::size_t step) override {
    auto volume = source_->read(field, step);
    if (!volume || &info().fields[field] != info().first(windsplat::data::FieldKind::scalar)) {
      return volume;
    }
    const std::size_t x = static_cast<std::size_t>(volume->dims[0]);
    const std::size_t layer = x * static_cast<std::size_t>(volume->dims[1]);
    for (std::size_t n = 0; n < volume->samples(); ++n) {
      volume->values[n] = static_cast<float>(500 * (n / layer) + 10 * (n % x));
    }
    windsplat::data::finish_volume(*volume);
    return volume;
  }

 private:
  std::unique_ptr<windsplat::data::Source> source_;
};

// z is then one of the heights in the column; what views refuse as heights is refused here too.
TEST_F(Measures, PositionsAreAtTheHeightsOfAField) {
  namespace data = windsplat::data;
  TestServer raised(
      {},
      [](const data::Location& location,
         const windsplat::CancelToken&) -> windsplat::Result<std::unique_ptr<data::Source>> {
        auto source = data::open_dataset(data::direct_files(location));
        if (!source) return source.error();
        return std::unique_ptr<data::Source>(std::make_unique<RaisedSource>(std::move(*source)));
      });
  const auto at_raised = [&](const std::string& what) {
    const Answer answer = get(raised.port(), "/v1/datasets/small/" + what);
    EXPECT_EQ(answer.status, 200) << what << ' ' << answer.body;
    return json_of(answer);
  };
  const auto& heights = field(data::FieldKind::scalar);
  std::string at = near(5, 3, 2);
  at = at.substr(0, at.find("&z=")) + "&z=1640&heightField=" + heights.name;
  for (const std::string& query :
       {"probe" + at + "&step=1", "fields/" + heights.name + "/series" + at}) {
    const Json position = at_raised(query)["position"];
    EXPECT_EQ(position["index"], Json({{"x", 5}, {"y", 3}, {"z", 3}}));  // 50 m, and 500 m each
    EXPECT_EQ(position["z"], 1550);
    EXPECT_EQ(position["units"]["z"], heights.units);
  }
  // The page asks for the sample that it has drawn there.
  EXPECT_EQ(at_raised("probe?index=5,3,3&heightField=" + heights.name + "&step=1"),
            at_raised("probe" + at + "&step=1"));
  const std::string vector = field(data::FieldKind::vector).name;
  expect_problem_saying(refused("probe" + near(5, 3, 2) + "&heightField=" + vector), 422,
                        "is a vector, not a scalar");
  expect_problem_saying(refused("probe" + near(5, 3, 2) + "&heightField=none"), 422,
                        "'heightField'");
  expect_problem_saying(refused("probe?index=5,3,2&heightField=" + heights.name), 422,
                        "is not above the level below it on average");
}

TEST_F(Measures, SamplesAreProbedByTheirIndices) {
  EXPECT_EQ(ask("probe?index=5,3,2&step=1"), ask("probe" + near(5, 3, 2) + "&step=1"));
  const std::string name = field(windsplat::data::FieldKind::scalar).name;
  EXPECT_EQ(ask("fields/" + name + "/series?index=5,3,2"),
            ask("fields/" + name + "/series" + near(5, 3, 2)));
  for (const char* wrong : {"5,3", "5,3,2,1", "5,3,b", "5;3;2", ""}) {
    expect_problem_saying(refused(std::string("probe?index=") + wrong), 400, "three integers");
  }
  expect_problem_saying(refused("probe?index=5,16,2"), 422, "below 16 along y");
  expect_problem_saying(refused("probe?index=-1,3,2"), 422, "below 32 along x");
  expect_problem_saying(refused("probe?index=5,3,2&x=0"), 422, "mutually exclusive");
}

TEST_F(Measures, InvalidOrOutsideProbesAreRefused) {
  expect_problem_saying(refused("probe?x=0&y=95&z=500"), 422, "box");
  expect_problem_saying(refused("probe?x=0&y=0"), 422, "z (or level) is required");
  expect_problem_saying(refused("probe?x=here&y=0&z=500"), 400);
  expect_problem_saying(refused("probe?x=1e999&y=0&z=500"), 400);
  expect_problem_saying(refused("probe?x=0&y=0&z=500&step=3"), 422);
  expect_problem_saying(refused("probe?longitude=0&y=0&z=500"), 400,
                        "x, y, z, lon, lat, level, heightField, index, step");
  expect_problem_saying(get(port(), "/v1/datasets/none/probe?x=0&y=0&z=0"), 404);
}

TEST_F(Measures, HistogramCountsEverySampleOnce) {
  for (const auto kind : {windsplat::data::FieldKind::scalar, windsplat::data::FieldKind::vector}) {
    const std::string name = field(kind).name;
    const auto there = volume(name, 2);
    for (const char* query : {"?step=2", "?step=2&bins=7", "?step=2&clip=0.1", "?step=2&log=true",
                              "?step=2&range=0.1,0.2"}) {
      const Json h = ask("fields/" + name + "/histogram" + query);
      std::int64_t sum = h["below"].get<std::int64_t>() + h["above"].get<std::int64_t>() +
                         h["masked"].get<std::int64_t>();
      for (const Json& count : h["counts"]) sum += count.get<std::int64_t>();
      EXPECT_EQ(sum, 32 * 16 * 6) << name << query;
    }
    const Json h = ask("fields/" + name + "/histogram?step=2");
    EXPECT_EQ(h["counts"].size(), 64U);
    EXPECT_FLOAT_EQ(h["range"][0].get<float>(), there->range[0]);
    EXPECT_FLOAT_EQ(h["range"][1].get<float>(), there->range[1]);
    EXPECT_EQ(h["log"], false);
    EXPECT_EQ(ask("fields/" + name + "/histogram?log=1&bins=5")["edges"].size(), 6U);
  }
}

// A clip of 0.1 excludes a tenth of the values, rounded down, at either end.
TEST_F(Measures, HistogramClipOmitsBothEnds) {
  const std::string name = field(windsplat::data::FieldKind::scalar).name;
  const auto there = volume(name, 2);
  std::vector<float> values(there->values.data(), there->values.data() + there->values.size());
  std::erase_if(values, [](float value) { return std::isnan(value); });
  std::sort(values.begin(), values.end());
  const std::size_t dropped = values.size() / 10;
  const Json h = ask("fields/" + name + "/histogram?step=2&clip=0.1");
  EXPECT_EQ(h["range"][0].get<float>(), values[dropped]);
  EXPECT_EQ(h["range"][1].get<float>(), values[values.size() - 1 - dropped]);
  EXPECT_LT(values.front(), values[dropped]) << "otherwise this test proves nothing";
}

TEST_F(Measures, InvalidHistogramsAreRefused) {
  const std::string base =
      "fields/" + field(windsplat::data::FieldKind::scalar).name + "/histogram";
  expect_problem_saying(refused(base + "?bins=0"), 422);
  expect_problem_saying(refused(base + "?bins=4097"), 422);
  EXPECT_EQ(ask(base + "?bins=4096")["counts"].size(), 4096U);
  expect_problem_saying(refused(base + "?range=1"), 400);
  expect_problem_saying(refused(base + "?range=1,2,3"), 400);
  expect_problem_saying(refused(base + "?range=2,1"), 422);
  expect_problem_saying(refused(base + "?range=0,1&log=true"), 422);
  expect_problem_saying(refused(base + "?range=0,1e39"), 422);
  expect_problem_saying(refused(base + "?range=0,1&clip=0.1"), 422);
  expect_problem_saying(refused(base + "?clip=0.5"), 422);
  expect_problem_saying(refused(base + "?log=maybe"), 400);
  expect_problem_saying(refused(base + "?colour=1"), 400, "bins");
  expect_problem_saying(refused("fields/nope/histogram"), 404, "nope");
  expect_problem_saying(refused("fields/nope/mean"), 404);
}

TEST_F(Measures, SeriesIsTheProbeAtEveryStep) {
  for (const auto kind : {windsplat::data::FieldKind::scalar, windsplat::data::FieldKind::vector}) {
    const auto& info = field(kind);
    const Json series = ask("fields/" + info.name + "/series" + near(9, 8, 1));
    ASSERT_EQ(series["values"].size(), static_cast<std::size_t>(small_steps));
    ASSERT_EQ(series["times"].size(), static_cast<std::size_t>(small_steps));
    EXPECT_EQ(series["units"], info.units);
    EXPECT_EQ(series["position"]["index"], Json({{"x", 9}, {"y", 8}, {"z", 1}}));
    for (int step = 0; step < small_steps; ++step) {
      const auto at = static_cast<std::size_t>(step);
      const auto there = volume(info.name, step);
      const Json& value =
          info.components.size() == 1 ? series["values"][at] : series["values"][at][1];
      const int component = info.components.size() == 1 ? 0 : 1;
      EXPECT_EQ(value.get<float>(), there->component(component)[flat(9, 8, 1)]);
      EXPECT_EQ(series["times"][at]["text"], dataset_->info().steps[at].text);
    }
  }
  expect_problem_saying(refused("fields/wind/series?x=0&y=95&z=500"), 422, "box");
  expect_problem_saying(refused("fields/nope/series?x=0&y=0&z=500"), 404);
}

TEST_F(Measures, RangeOfAllStepsIsReadOnce) {
  const std::string name = field(windsplat::data::FieldKind::scalar).name;
  float low = std::numeric_limits<float>::infinity();
  float high = -low;
  for (int step = 0; step < small_steps; ++step) {
    low = std::min(low, volume(name, step)->range[0]);
    high = std::max(high, volume(name, step)->range[1]);
  }
  const Json one = ask("fields/" + name + "/range?step=1");
  EXPECT_EQ(one["rangeOf"], "step");
  EXPECT_EQ(one["range"][1].get<float>(), volume(name, 1)->range[1]);
  EXPECT_EQ(server_.loads(), 1U);
  const Json all = ask("fields/" + name + "/range?of=all");
  EXPECT_EQ(all["rangeOf"], "all");
  EXPECT_EQ(all["range"][0].get<float>(), low);
  EXPECT_EQ(all["range"][1].get<float>(), high);
  EXPECT_EQ(server_.loads(), 3U);
  EXPECT_EQ(request(port(), "DELETE", "/v1/datasets/small").status, 204);
  EXPECT_EQ(ask("fields/" + name + "/range?of=all"), all);
  EXPECT_EQ(server_.loads(), 3U) << "cached though evicted";
  expect_problem_saying(refused("fields/" + name + "/range?of=most"), 422);
  expect_problem_saying(refused("fields/" + name + "/range?of=all&step=1"), 422);
  expect_problem_saying(refused("fields/" + name + "/range?of=all&datetime=2001-01-01"), 422);
}

// The page goes to the maximum of what is drawn.
TEST_F(Measures, RangeInTheRegionOfAViewIsThatOfItsSamples) {
  const auto& info = field(windsplat::data::FieldKind::scalar);
  const auto& x = dataset_->info().grid.axes[0].coordinates;
  const Json view = {{"step", 1}, {"region", {{"x", {x[3], x[6]}}}}};
  const auto posted = [&](const std::string& name, const std::string& body) {
    return request(port(), "POST", "/v1/datasets/small/fields/" + name + "/range",
                   {{"Content-Type", "application/json"}}, body);
  };
  const Answer answer = posted(info.name, view.dump());
  ASSERT_EQ(answer.status, 200) << answer.body;
  const Json told = json_of(answer);
  const auto there = volume(info.name, 1);
  float high = -std::numeric_limits<float>::infinity();
  for (int k = 0; k < there->dims[2]; ++k) {
    for (int j = 0; j < there->dims[1]; ++j) {
      for (int i = 3; i <= 6; ++i) high = std::max(high, there->component(0)[flat(i, j, k)]);
    }
  }
  EXPECT_EQ(told["range"][1].get<float>(), high);
  const Json& index = told["places"]["max"]["index"];
  EXPECT_EQ(there->component(0)[flat(index["x"], index["y"], index["z"])], high);
  EXPECT_EQ(told["places"]["max"]["x"], x[index["x"].get<std::size_t>()]);
  const std::string whole = "fields/" + info.name + "/range?step=1";
  EXPECT_EQ(json_of(posted(info.name, R"({"step":1})")), ask(whole));
  // Of a difference, as the view shows it.
  const auto before = volume(info.name, 0);
  float changed = -std::numeric_limits<float>::infinity();
  for (std::size_t n = 0; n < there->samples(); ++n) {
    changed = std::max(changed, there->component(0)[n] - before->component(0)[n]);
  }
  const Json difference = json_of(posted(info.name, R"({"step":1,"difference":{"step":0}})"));
  EXPECT_EQ(difference["range"][1].get<float>(), changed);
  expect_problem_saying(posted("none", "{}"), 404, "none");
  expect_problem_saying(posted(info.name, "{"), 400);
  expect_problem_saying(posted(info.name, R"({"step":99})"), 422);
  expect_problem_saying(posted(info.name, R"({"region":{"y":[1e6,2e6]}})"), 422, "no sample");
}

// Samples are named by which the values of the range are read again.
TEST_F(Measures, RangeOfAStepNamesTheSamplesOfItsEnds) {
  for (const auto& info : dataset_->info().fields) {
    const Json told = ask("fields/" + info.name + "/range?step=1");
    for (const char* end : {"min", "max"}) {
      const Json& index = told["places"][end]["index"];
      const auto there = volume(info.name, 1);
      double square = 0;
      for (int c = 0; c < there->components; ++c) {
        square += std::pow(there->component(c)[flat(index["x"], index["y"], index["z"])], 2);
      }
      const double expected = told["range"][end == std::string("max") ? 1 : 0].get<double>();
      EXPECT_NEAR(std::sqrt(square), std::abs(expected), 1e-5 * std::abs(expected)) << info.name;
      const auto& x = dataset_->info().grid.axes[0].coordinates;
      EXPECT_EQ(told["places"][end]["x"], x[index["x"].get<std::size_t>()]);
    }
  }
  EXPECT_FALSE(ask("fields/" + field(windsplat::data::FieldKind::scalar).name + "/range?of=all")
                   .contains("places"));
}

TEST_F(Measures, RangeOfAllStepsIsTheUnionOfTheSteps) {
  int wider_than_the_first = 0;
  for (const auto& info : dataset_->info().fields) {
    std::array<float, 2> range = volume(info.name, 0)->range;
    const std::array<float, 2> first = range;
    for (int step = 1; step < small_steps; ++step) {
      range[0] = std::min(range[0], volume(info.name, step)->range[0]);
      range[1] = std::max(range[1], volume(info.name, step)->range[1]);
    }
    const Json all = ask("fields/" + info.name + "/range?of=all");
    EXPECT_EQ(all["range"][0].get<float>(), range[0]) << info.name;
    EXPECT_EQ(all["range"][1].get<float>(), range[1]) << info.name;
    wider_than_the_first += range != first ? 1 : 0;
  }
  EXPECT_GT(wider_than_the_first, 0) << "otherwise this test proves nothing";
}

TEST_F(Measures, EvictionKeepsDatasetsAndOnlyPostedOnesCanBeRemoved) {
  ask("probe" + near(1, 1, 1));
  const auto resident = [&] {
    return json_of(get(port(), "/v1/datasets"))["datasets"][0]["residentBytes"].get<int>();
  };
  EXPECT_GT(resident(), 0);
  EXPECT_EQ(request(port(), "DELETE", "/v1/datasets/small").status, 204);
  EXPECT_EQ(resident(), 0);
  expect_problem_saying(request(port(), "DELETE", "/v1/datasets/small?forget=true"), 403);
  expect_problem_saying(request(port(), "DELETE", "/v1/datasets/small?now=1"), 400, "forget");
  expect_problem_saying(request(port(), "DELETE", "/v1/datasets/none"), 404);
  ask("probe" + near(1, 1, 1));
}

// --- POST ---------------------------------------------------------------------------------------

Answer post_path(std::uint16_t port, const std::string& path) {
  return request(port, "POST", "/v1/datasets", {{"Content-Type", "application/json"}},
                 Json{{"path", path}}.dump());
}

class DataRoot : public testing::Test {
 protected:
  DataRoot() {
    std::string name = (fs::temp_directory_path() / "windsplat-root-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) return;
    root_ = fs::canonical(name) / "root";
    fs::create_directories(root_ / "runs");
    fs::copy_file(small_file(), root_ / "runs/gcm.nc");
    fs::copy_file(small_file(), root_.parent_path() / "secret.nc");
    std::ofstream(root_ / "broken.nc") << "not a data file";
    fs::create_symlink("../secret.nc", root_ / "out.nc");
    EXPECT_EQ(mkfifo((root_ / "pipe.nc").c_str(), 0600), 0);
    windsplat::api::ServerOptions options;
    options.data_root = root_.native();
    server_ = std::make_unique<TestServer>(options);
  }
  ~DataRoot() override {
    std::error_code ignored;
    fs::remove_all(root_.parent_path(), ignored);
  }
  [[nodiscard]] std::uint16_t port() const { return server_->port(); }
  // The job once it is finished.
  Json finished(const std::string& location) {
    for (int turn = 0; turn < 6000; ++turn) {
      Json job = json_of(get(port(), location));
      if (job.value("state", "queued") != "queued" && job["state"] != "running") return job;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return {};
  }

  fs::path root_;
  std::unique_ptr<TestServer> server_;
};

TEST_F(DataRoot, PostedPathBecomesADatasetThroughAJob) {
  const Answer accepted = post_path(port(), "runs/gcm.nc");
  ASSERT_EQ(accepted.status, 202) << accepted.body;
  const std::string location = accepted.header("location");
  EXPECT_EQ(location, "/v1/jobs/" + json_of(accepted)["id"].get<std::string>());
  const Json job = finished(location);
  EXPECT_EQ(job["state"], "done") << job;
  EXPECT_EQ(job["kind"], "dataset");
  EXPECT_EQ(job["progress"], 1);
  EXPECT_EQ(job["result"], "gcm");
  EXPECT_EQ(get(port(), "/v1/datasets/gcm/frame.jpg?width=32&height=32").status, 200);
  EXPECT_EQ(json_of(get(port(), "/v1/jobs"))["jobs"].size(), 1U);
  const Json list = json_of(get(port(), "/v1/datasets"))["datasets"];
  ASSERT_EQ(list.size(), 2U);
  EXPECT_EQ(list[1]["state"], "ready");
  EXPECT_TRUE(list[1]["notes"].is_array());

  EXPECT_EQ(request(port(), "DELETE", location).status, 204);
  EXPECT_EQ(request(port(), "DELETE", "/v1/datasets/gcm?forget=true").status, 204);
  expect_problem_saying(get(port(), "/v1/datasets/gcm"), 404);
  EXPECT_EQ(json_of(get(port(), "/v1/datasets"))["datasets"].size(), 1U);
}

TEST_F(DataRoot, LinksOmittedFromAPatternAreListed) {
  fs::create_symlink("../../secret.nc", root_ / "runs/gcm2.nc");
  const Json job = finished(post_path(port(), "runs/gcm*.nc").header("location"));
  ASSERT_EQ(job["state"], "done") << job;
  const Json told = json_of(get(port(), "/v1/datasets/" + job["result"].get<std::string>()));
  EXPECT_EQ(told["state"], "ready");
  EXPECT_THAT(told["notes"].dump(), HasSubstr("1 of 2 names that match the pattern is omitted"));
}

TEST_F(DataRoot, UnreadableFileIsAFailedJob) {
  for (const char* path : {"broken.nc", "runs"}) {
    const Answer accepted = post_path(port(), path);
    ASSERT_EQ(accepted.status, 202) << accepted.body;
    const Json job = finished(accepted.header("location"));
    EXPECT_EQ(job["state"], "failed") << job;
    EXPECT_TRUE(job["result"].is_null());
    EXPECT_EQ(job["problem"]["status"], 422);
    EXPECT_THAT(job["problem"]["detail"].get<std::string>(), Not(HasSubstr(root_.native())));
  }
  EXPECT_EQ(json_of(get(port(), "/v1/datasets"))["datasets"].size(), 1U);
  EXPECT_EQ(get(port(), "/v1/datasets/small/frame.jpg?width=32&height=32").status, 200);
}

TEST_F(DataRoot, PathsOutsideTheRootAreRefused) {
  for (const std::string path :
       {"../secret.nc", "runs/../../secret.nc", "/etc/passwd", "out.nc", "http://127.0.0.1/a.nc",
        "file:///etc/passwd", "pipe.nc", ".", "..", "../*.nc", "o*.nc"}) {
    SCOPED_TRACE(path);
    const Answer answer = post_path(port(), path);
    expect_problem_saying(answer, 422);
    EXPECT_EQ(json_of(answer)["errors"][0]["pointer"], "/path");
    EXPECT_THAT(answer.body, Not(HasSubstr(root_.native())));
  }
  expect_problem_saying(post_path(port(), "%2e%2e/secret.nc"), 404);
  expect_problem_saying(post_path(port(), "nothing.nc"), 404);
  expect_problem_saying(post_path(port(), "runs/gcm.nc#mode=zarr"), 404);
  expect_problem_saying(post_path(port(), std::string("runs/gcm.nc\0.png", 16)), 422);
  EXPECT_TRUE(json_of(get(port(), "/v1/jobs"))["jobs"].empty());
}

TEST_F(DataRoot, InvalidBodiesAreRefused) {
  const auto post = [&](const std::string& type, const std::string& body) {
    return request(port(), "POST", "/v1/datasets", {{"Content-Type", type}}, body);
  };
  expect_problem_saying(post("text/plain", R"({"path":"runs/gcm.nc"})"), 415);
  expect_problem_saying(post("application/json", "{"), 400);
  expect_problem_saying(post("application/json", "{}"), 422);
  expect_problem_saying(post("application/json", R"({"path":"runs/gcm.nc","id":"x"})"), 422,
                        "path");
  expect_problem_saying(
      request(port(), "POST", "/v1/datasets?path=x", {{"Content-Type", "application/json"}}, "{}"),
      400);
  expect_problem_saying(get(port(), "/v1/jobs/77"), 404);
  expect_problem_saying(request(port(), "DELETE", "/v1/jobs/77"), 404);
  expect_problem_saying(request(port(), "DELETE", "/v1/jobs"), 405);
}

TEST(NoDataRoot, PostedFilesAreRefusedWithTheReason) {
  TestServer server;
  expect_problem_saying(post_path(server.port(), "a.nc"), 403, "--data-root");
}

}  // namespace
}  // namespace server_test
