// Opening, sharing and slow reading of datasets: one client must not affect another.
#include <gmock/gmock.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <future>
#include <thread>

#include "server/data/open/open.hpp"
#include "server/scene/build.hpp"
#include "server/scene/completed_view.hpp"
#include "server/tasks/drawing.hpp"
#include "server/tasks/viewer.hpp"
#include "server/transport/server_parts.hpp"
#include "tests/integration/server/opening.hpp"
#include "tests/integration/server/slow_source.hpp"
#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

using namespace windsplat;  // NOLINT(google-build-using-namespace)
namespace fs = std::filesystem;

fs::path folder_of_small() { return fs::path(small_file()).parent_path(); }

TEST(OpenedDatasets, DatasetsOfTheCommandLineAreKeptWhenPostedAgain) {
  TestServer server(with_root(folder_of_small()));
  const Json job = finished_job(server.port(), post_file(server.port(), "small.nc"));
  EXPECT_EQ(job["state"], "done");
  EXPECT_EQ(job["result"], "small");
  const Answer forgotten = request(server.port(), "DELETE", "/v1/datasets/small?forget=true");
  EXPECT_EQ(forgotten.status, 403);
  EXPECT_EQ(get(server.port(), "/v1/datasets/small").status, 200);
}

TEST(OpenedDatasets, EntriesOfADimensionAreDatasetsOfTheirOwn) {
  TestServer server(with_root(folder_of_small()));
  const auto probed = [&](const std::string& id, int step) {
    return json_of(get(server.port(), "/v1/datasets/" + id + "/probe?x=0&y=0&z=500&step=" +
                                          std::to_string(step)))["values"];
  };
  const Json whole = json_of(get(server.port(), "/v1/datasets/small"));
  EXPECT_EQ(whole["choices"], Json::array());
  for (int step = 0; step < small_steps; ++step) {
    const std::string time = whole["steps"]["times"][static_cast<std::size_t>(step)]["text"];
    const Json job = finished_job(server.port(), post_file(server.port(), "small.nc?time=" + time));
    ASSERT_EQ(job["state"], "done") << job;
    ASSERT_EQ(job["result"], "small,time=" + time);
    const Json one = json_of(get(server.port(), "/v1/datasets/small,time=" + time));
    EXPECT_EQ(one["steps"]["count"], 1);
    EXPECT_EQ(one["choices"][0]["chosen"], time);
    const Json values = probed("small,time=" + time, 0);
    ASSERT_FALSE(values.empty());
    EXPECT_EQ(values, probed("small", step));
  }
  EXPECT_NE(probed("small", 0), probed("small", 1));
  const Json wrong = finished_job(server.port(), post_file(server.port(), "small.nc?number=3"));
  EXPECT_EQ(wrong["state"], "failed");
  EXPECT_NE(wrong.dump().find("there is no dimension 'number'"), std::string::npos) << wrong;
  const Answer nameless =
      request(server.port(), "POST", "/v1/datasets", {{"Content-Type", "application/json"}},
              R"({"path": "small.nc?=3"})");
  EXPECT_EQ(nameless.status, 422);
}

// Files are opened once the gate is open.
class SharedDataset : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "windsplat-shared-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    root_ = name;
    fs::copy_file(small_file(), root_ / "posted.nc");
    server_ = std::make_unique<TestServer>(
        with_root(root_),
        [gate = gate_, server_has_begun = begun_](
            const data::Location& location,
            const CancelToken&) -> Result<std::unique_ptr<data::Source>> {
          if (*server_has_begun) gate->pass();
          auto source = data::open_dataset(data::direct_files(location));
          if (!source) return source.error();
          return std::unique_ptr<data::Source>(std::move(*source));
        });
    *begun_ = true;
    first_ = post_file(port(), "posted.nc");
    ASSERT_TRUE(gate_->wait_for(1)) << "the first one opens it";
    second_ = post_file(port(), "posted.nc");
    ASSERT_TRUE(is_running(port(), second_)) << "the second one waits for the first";
  }
  void TearDown() override {
    gate_->open();
    server_.reset();
    fs::remove_all(root_);
  }
  [[nodiscard]] std::uint16_t port() const { return server_->port(); }
  void cancel(const std::string& job) const {
    EXPECT_EQ(request(port(), "DELETE", "/v1/jobs/" + job).status, 204);
  }

  fs::path root_;
  std::shared_ptr<Gate> gate_ = std::make_shared<Gate>();
  std::shared_ptr<std::atomic<bool>> begun_ = std::make_shared<std::atomic<bool>>(false);
  std::unique_ptr<TestServer> server_;
  std::string first_;
  std::string second_;
};

TEST_F(SharedDataset, RemainsForTheFirstClientWhenTheSecondCancels) {
  cancel(second_);
  gate_->open();
  EXPECT_EQ(finished_job(port(), second_)["state"], "cancelled");
  EXPECT_EQ(finished_job(port(), first_)["state"], "done");
  EXPECT_EQ(get(port(), "/v1/datasets/posted").status, 200);
}

TEST_F(SharedDataset, RemainsForTheSecondClientWhenTheFirstCancels) {
  cancel(first_);
  gate_->open();
  EXPECT_EQ(finished_job(port(), first_)["state"], "cancelled");
  EXPECT_EQ(finished_job(port(), second_)["state"], "done");
  EXPECT_EQ(get(port(), "/v1/datasets/posted").status, 200);
  EXPECT_EQ(request(port(), "DELETE", "/v1/datasets/posted?forget=true").status, 204)
      << "it was opened by POST nevertheless";
  EXPECT_EQ(get(port(), "/v1/datasets/posted").status, 404);
}

TEST_F(SharedDataset, IsReleasedWhenTheLastClientCancels) {
  cancel(first_);
  cancel(second_);
  gate_->open();
  EXPECT_EQ(finished_job(port(), first_)["state"], "cancelled");
  EXPECT_EQ(finished_job(port(), second_)["state"], "cancelled");
  EXPECT_EQ(get(port(), "/v1/datasets/posted").status, 404);
}

// A disk that does not respond until the read is cancelled.
class StuckSource : public data::Source {
 public:
  StuckSource(std::unique_ptr<data::Source> source, std::shared_ptr<Gate> gate)
      : source_(std::move(source)), gate_(std::move(gate)) {}
  [[nodiscard]] const data::DatasetInfo& info() const override { return source_->info(); }
  Result<data::Volume> read(std::size_t /*field*/, std::size_t /*step*/) override {
    gate_->pass();
    gate_->close();
    return make_error(ErrorKind::cancelled, "reading was cancelled");
  }
  void cancel() override { gate_->open(); }

 private:
  std::unique_ptr<data::Source> source_;
  std::shared_ptr<Gate> gate_;
};

// The client is still connected, so status 499 would be wrong.
TEST(ForgottenDatasets, WaitingPictureReportsTheRemoval) {
  std::string name = (fs::temp_directory_path() / "windsplat-forgot-XXXXXX").string();
  ASSERT_NE(mkdtemp(name.data()), nullptr);
  fs::copy_file(small_file(), name + "/posted.nc");
  const auto gate = std::make_shared<Gate>();
  {
    TestServer server(with_root(name),
                      [gate](const data::Location& location,
                             const CancelToken&) -> Result<std::unique_ptr<data::Source>> {
                        auto source = data::open_dataset(data::direct_files(location));
                        if (!source) return source.error();
                        return std::unique_ptr<data::Source>(
                            std::make_unique<StuckSource>(std::move(*source), gate));
                      });
    const std::uint16_t port = server.port();
    ASSERT_EQ(finished_job(port, post_file(port, "posted.nc"))["state"], "done");
    int reads = 0;
    for (const auto& [words, status] : {std::pair("", 409), std::pair("?forget=true", 404)}) {
      auto picture = std::async(std::launch::async, [port] {
        return get(port, "/v1/datasets/posted/frame.jpg?width=32&height=24");
      });
      ASSERT_TRUE(gate->wait_for(++reads));
      EXPECT_EQ(request(port, "DELETE", std::string("/v1/datasets/posted") + words).status, 204);
      const Answer answer = picture.get();
      EXPECT_EQ(answer.status, status) << answer.body;
    }
  }
  fs::remove_all(name);
}

// Files that differ in their folder only: name, size and time are equal.
TEST(KnownRanges, AreNotReusedForAnotherFileOfEqualSizeAndTime) {
  std::string name = (fs::temp_directory_path() / "windsplat-twins-XXXXXX").string();
  ASSERT_NE(mkdtemp(name.data()), nullptr);
  const fs::path root = name;
  fs::create_directory(root / "a");
  fs::create_directory(root / "b");
  // NRRD of four numbers each.
  const auto write = [&](const char* path, const std::string& numbers) {
    std::ofstream(root / path) << "NRRD0004\ntype: float\ndimension: 3\nsizes: 2 2 2\n"
                               << "encoding: ascii\n\n"
                               << numbers << '\n';
  };
  write("a/twin.nrrd", "1 2 3 4 5 6 7 8");
  write("b/twin.nrrd", "2 3 4 5 6 7 8 9");
  fs::last_write_time(root / "b/twin.nrrd", fs::last_write_time(root / "a/twin.nrrd"));
  {
    TestServer server(with_root(root));
    std::vector<Json> ranges;
    for (const char* path : {"a/twin.nrrd", "b/twin.nrrd"}) {
      const Json job = finished_job(server.port(), post_file(server.port(), path));
      ASSERT_EQ(job["state"], "done") << job;
      const std::string dataset = "/v1/datasets/" + job["result"].get<std::string>();
      const Json about = json_of(get(server.port(), dataset));
      const std::string field = about["fields"][0]["name"];
      ranges.push_back(
          json_of(get(server.port(), dataset + "/fields/" + field + "/range?of=all"))["range"]);
    }
    EXPECT_EQ(ranges[0], Json({1, 8}));
    EXPECT_EQ(ranges[1], Json({2, 9}));
  }
  fs::remove_all(root);
}

TEST(Loads, HangingDatasetDoesNotBlockOthers) {
  const auto gate = std::make_shared<Gate>();
  std::string name = (fs::temp_directory_path() / "windsplat-hangs-XXXXXX").string();
  ASSERT_NE(mkdtemp(name.data()), nullptr);
  const fs::path root = name;
  fs::copy_file(small_file(), root / "hangs.nc");
  TestServer server(with_root(root),
                    [gate](const data::Location& location,
                           const CancelToken&) -> Result<std::unique_ptr<data::Source>> {
                      auto source = data::open_dataset(data::direct_files(location));
                      if (!source) return source.error();
                      if (location.stem != "hangs")
                        return std::unique_ptr<data::Source>(std::move(*source));
                      return std::unique_ptr<data::Source>(
                          std::make_unique<SlowSource>(std::move(*source), gate));
                    });
  ASSERT_EQ(finished_job(server.port(), post_file(server.port(), "hangs.nc"))["state"], "done");
  const std::string probe = "/v1/datasets/hangs/probe?x=0&y=0&z=500&step=";
  std::vector<std::unique_ptr<Socket>> waiting;
  for (int i = 0; i < 8; ++i) {  // the maximum for one address
    waiting.push_back(std::make_unique<Socket>(server.port()));
    waiting.back()->send("GET " + probe + std::to_string(i % small_steps) +
                         " HTTP/1.1\r\nHost: x\r\n\r\n");
  }
  ASSERT_TRUE(gate->wait_for(1));
  // More jobs than threads are queued before any of these.
  EXPECT_EQ(get(server.port(), "/v1/datasets/small/probe?x=0&y=0&z=500&step=0").status, 200);
  EXPECT_EQ(get(server.port(), "/v1/datasets/small/frame.png?width=32&height=32").status, 200);
  EXPECT_EQ(get(server.port(), "/v1/datasets/small").status, 200);
  EXPECT_EQ(gate->arrived(), 1);
  gate->open();
  for (const auto& socket : waiting) EXPECT_EQ(read_answer(*socket).status, 200);
  fs::remove_all(root);
}

TEST(Loads, JobsOfADatasetKeepTheirOrderAndCancelledOnesDoNotWait) {
  Gate gate;
  const auto one = std::make_shared<int>(1);
  std::mutex mutex;
  std::vector<int> order;
  const auto note = [&](int number) {
    const std::lock_guard lock(mutex);
    order.push_back(number);
  };
  std::promise<void> cancelled_ran;
  std::promise<void> other_ran;
  std::promise<void> last_ran;
  tasks::TaskExecutor loads({"loads", 2, 16});  // last: its threads use all of these until they end
  ASSERT_TRUE(loads.submit({{}, [&] { gate.pass(); }, false, one}));
  ASSERT_TRUE(gate.wait_for(1));
  const CancelToken unwanted;
  for (const int i : {1, 2, 3}) ASSERT_TRUE(loads.submit({{}, [&, i] { note(i); }, false, one}));
  ASSERT_TRUE(loads.submit({unwanted, [&] { cancelled_ran.set_value(); }, false, one}));
  ASSERT_TRUE(loads.submit({{}, [&] { last_ran.set_value(); }, false, one}));
  unwanted.cancel();
  ASSERT_TRUE(loads.submit({{}, [&] { other_ran.set_value(); }}));
  cancelled_ran.get_future().wait();
  other_ran.get_future().wait();
  note(0);
  gate.open();
  last_ran.get_future().wait();  // end() cancels waiting jobs, and cancelled jobs run in any order
  loads.end();
  EXPECT_THAT(order, testing::ElementsAre(0, 1, 2, 3));
}

// The queue of one dataset is full: others are still admitted.
TEST(Loads, EveryDatasetHasItsOwnQueue) {
  Gate gate;
  tasks::TaskExecutor loads({"loads", 2, 2});
  const auto one = std::make_shared<int>(1);
  const auto two = std::make_shared<int>(2);
  ASSERT_TRUE(loads.submit({{}, [&] { gate.pass(); }, false, one}));
  ASSERT_TRUE(gate.wait_for(1));
  EXPECT_TRUE(loads.submit({{}, [] {}, false, one}));
  EXPECT_TRUE(loads.submit({{}, [] {}, false, one}));
  const auto refused = loads.submit({{}, [] {}, false, one});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::busy);
  EXPECT_TRUE(loads.submit({{}, [] {}, false, two}));
  gate.open();
}

// The views do not specify ranges, so completing each would read the field it shows; all but one
// are superseded.
TEST(Viewer, OnlyTheNewestWaitingPrefetchRequestIsLoaded) {
  const auto store = std::make_shared<data::Store>(std::uint64_t{1} << 30);
  const auto dataset = store->add("climate:32x16x6").value();
  const std::string scalar = dataset->info().first(data::FieldKind::scalar)->name;
  const std::string vector = dataset->info().first(data::FieldKind::vector)->name;
  Gate gate;
  std::promise<void> done;
  transport::ServerParts parts({}, store, std::make_shared<ThreadPool>(2));
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(parts.backend.loads.submit({{}, [&] { gate.pass(); }}));
  }
  ASSERT_TRUE(gate.wait_for(2)) << "both threads are busy";
  protocol::View of_scalar;
  of_scalar.dataset = dataset->info().id;
  protocol::View of_vector = of_scalar;
  of_scalar.vector.field = {protocol::FieldChoice::Kind::none, ""};
  of_scalar.scalars.emplace(1);
  of_scalar.scalars->front().field = scalar;
  of_vector.scalars.emplace();
  tasks::Viewer viewer(parts.backend, 1, "192.0.2.1");
  for (int i = 0; i < 1000; ++i) {
    viewer.start(session::Prefetch{i < 999 ? of_scalar : of_vector, {1}, {}});
  }
  ASSERT_TRUE(
      parts.backend.loads.submit({{}, [&] { done.set_value(); }, true, dataset->shared_info()}));
  gate.open();
  done.get_future().wait();
  EXPECT_FALSE(dataset->seen(scalar, 0)) << "the prefetch request was withdrawn";
  EXPECT_TRUE(dataset->seen(vector, 0));
}

// The next step of a section is drawn without a load: its fields are sampled ahead.
TEST(Viewer, PrefetchCoversTheFieldsOfSections) {
  const auto store = std::make_shared<data::Store>(std::uint64_t{1} << 30);
  const auto dataset = store->add("climate:32x16x6").value();
  transport::ServerParts parts({}, store, std::make_shared<ThreadPool>(2));
  tasks::Viewer viewer(parts.backend, 1, "192.0.2.1");
  protocol::View layer;
  layer.dataset = dataset->info().id;
  protocol::View plane = layer;
  layer.geometry.slice = protocol::SliceView{protocol::GridAxis::z, 2.5};
  plane.geometry.plane = protocol::PlaneView{{0, 0, 0}, {1, 2, 3}};
  plane.vector.color.by = protocol::ColorBy::direction;
  for (const protocol::View& view : {layer, plane}) {
    ASSERT_TRUE(scene::build_scene(view, *dataset)) << "step 0 is shown";
    viewer.start(session::Prefetch{view, {1}, {}});
    protocol::View next = view;
    next.step = 1;
    const auto completed = scene::complete(next, *dataset).value();
    data::Dataset resident = dataset->resident_only();
    bool drawable = false;
    for (int i = 0; i < 5000 && !drawable; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      drawable = scene::build_scene(completed, resident).has_value();
    }
    EXPECT_TRUE(drawable);
  }
}

TEST(Drawings, SamplingOfASectionIsChargedLikeRendering) {
  constexpr std::int64_t hour_us = 3'600'000'000;
  const auto store = std::make_shared<data::Store>(std::uint64_t{1} << 30);
  const auto dataset = store->add("climate:64x32x8").value();
  protocol::View plane;
  plane.dataset = dataset->info().id;
  plane.geometry.plane = protocol::PlaneView{{0, 0, 0}, {1, 2, 30}};
  const auto completed = scene::complete(plane, *dataset).value();
  metrics::Metrics metrics;
  std::vector<std::int64_t> charged;
  tasks::BackendOptions options;
  options.charge = [&](const std::string& payer, std::int64_t us) {
    if (payer == "192.0.2.1") charged.push_back(us);
  };
  tasks::Backend backend(store, std::make_shared<ThreadPool>(1), metrics, std::move(options));
  // Time of sampling; that of the picture is raised by an hour unless there was none.
  const auto sampling_us = [&] {
    std::promise<std::int64_t> told;
    tasks::Drawing drawing;
    drawing.dataset = dataset;
    drawing.payer = "192.0.2.1";
    drawing.prepare = [&](data::Dataset& data, tasks::Loading loading) {
      auto picture =
          tasks::prepare_picture(completed, frame::own_setting(completed), {}, data, loading);
      if (picture && (*picture)->frame.scene.sampling_us > 0) {
        (*picture)->frame.scene.sampling_us += hour_us;
      }
      return picture;
    };
    drawing.draw = [&](const tasks::PreparedPicture& picture, data::Dataset& /*dataset*/,
                       std::int64_t /*queue_us*/, tasks::Loading /*loading*/) {
      told.set_value(picture.frame.scene.sampling_us);
    };
    drawing.fail = [&](const Error& error) {
      ADD_FAILURE() << error.message;
      told.set_value(-1);
    };
    EXPECT_TRUE(tasks::submit(backend, std::move(drawing)));
    return told.get_future().get();
  };
  EXPECT_GT(sampling_us(), hour_us);
  EXPECT_EQ(sampling_us(), 0) << "it is kept";
  backend.end();
  ASSERT_EQ(charged.size(), 3U) << "the first found that data are missing";
  EXPECT_LT(charged[0], hour_us);
  EXPECT_GT(charged[1], hour_us);
  EXPECT_LT(charged[2], hour_us);
}

TEST(Drawings, TheListsOfSurfacesAreChargedWhileTheirPictureExists) {
  const auto store = std::make_shared<data::Store>(std::uint64_t{1} << 30);
  const auto dataset = store->add("climate:64x32x8").value();
  protocol::View view;
  view.dataset = dataset->info().id;
  view.surfaces.emplace_back();
  view.surfaces[0].field = "cloud";
  view.surfaces[0].isovalue = 0.3;
  const auto completed = scene::complete(view, *dataset).value();
  auto picture = tasks::prepare_picture(completed, frame::own_setting(completed), {}, *dataset,
                                        tasks::Loading::allowed);
  ASSERT_TRUE(picture);
  const auto& mesh = *(*picture)->frame.scene.surfaces.at(0).mesh;
  const std::uint64_t least = 16 * mesh.places.size() + 4 * mesh.triangles.size();
  const std::uint64_t with_lists = store->counts().bytes;
  picture->reset();
  EXPECT_GT(least, 1000U);
  EXPECT_GE(with_lists - store->counts().bytes, least);
}

TEST(Drawings, AdmittedRequestIsNotRefusedAfterLoading) {
  Gate gate;  // declared before the parts: their threads use it until they end
  std::promise<std::string> told;
  const auto store = std::make_shared<data::Store>(std::uint64_t{1} << 30);
  transport::ServerParts parts({}, store, std::make_shared<ThreadPool>(1));
  tasks::Drawing drawing;
  drawing.dataset = store->add("climate:8x8x4").value();
  drawing.draw = [&](const tasks::PreparedPicture& /*picture*/, data::Dataset& /*dataset*/,
                     std::int64_t /*queue_us*/, tasks::Loading loading) {
    told.set_value(loading == tasks::Loading::allowed ? "drawn" : "drawn without loading");
  };
  // While it loads, the maximum number of requests waits.
  drawing.prepare = [&](data::Dataset& dataset,
                        tasks::Loading loading) -> Result<tasks::PreparedPtr> {
    if (loading == tasks::Loading::none) return make_error(ErrorKind::not_resident, "not loaded");
    const auto hold = [&](std::int64_t /*queue_us*/) { gate.pass(); };
    const tasks::RenderService::Job job{tasks::RenderService::Kind::request, 1, {}, hold, false, 0};
    EXPECT_TRUE(parts.backend.renderer.submit(job));
    EXPECT_TRUE(gate.wait_for(1));
    while (parts.backend.renderer.submit(job)) {
    }
    return tasks::prepare_picture(frame::complete({}, dataset).value(), {}, {}, dataset, loading);
  };
  drawing.fail = [&](const Error& error) { told.set_value(error.message); };
  ASSERT_TRUE(tasks::submit(parts.backend, std::move(drawing)));
  ASSERT_TRUE(gate.wait_for(1));
  gate.open();
  EXPECT_EQ(told.get_future().get(), "drawn");
}

}  // namespace
}  // namespace server_test
