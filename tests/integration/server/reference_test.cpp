// References over real sockets: drawn by a job, identical to those of `windsplat render`, limited,
// cancellable, and not delaying other work.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <thread>

#include "server/base/trim_storage.hpp"
#include "server/tasks/references.hpp"
#include "tests/integration/cli_program.hpp"
#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

using windsplat::CancelToken;
using windsplat::tasks::References;

const std::string reference_view = R"({"dataset":"small","image":{"width":96,"height":64}})";
// Takes at least some seconds.
const std::string large_view = R"({"dataset":"small","image":{"width":1600,"height":1200}})";

Answer post_reference(std::uint16_t port, const std::string& view) {
  return request(port, "POST", "/v1/references", {{"Content-Type", "application/json"}}, view);
}

std::string begun(std::uint16_t port, const std::string& view) {
  const Answer answer = post_reference(port, view);
  EXPECT_EQ(answer.status, 202) << answer.body;
  return answer.header("location");
}

bool is_over(const Json& job) { return job["state"] != "queued" && job["state"] != "running"; }

// The first state of the job for which `enough` returns true, or its last state.
template <class Enough>
Json job_when(std::uint16_t port, const std::string& path, const Enough& enough) {
  Json job;
  for (int i = 0; i < 12000; ++i) {
    job = json_of(get(port, path));
    if (is_over(job) || enough(job)) return job;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  ADD_FAILURE() << "the state is not reached: " << job;
  return job;
}

Json finished(std::uint16_t port, const std::string& path) {
  return job_when(port, path, [](const Json&) { return false; });
}

// The four values per pixel of a picture as .npy.
std::vector<float> values_of(const std::string& npy, std::size_t pixels) {
  std::vector<float> values(4 * pixels);
  const std::size_t bytes = values.size() * sizeof(float);
  if (npy.size() < bytes) return {};
  std::memcpy(values.data(), npy.data() + npy.size() - bytes, bytes);
  return values;
}

std::string rendered(const std::string& format, const std::string& change = "/step=0") {
  const cli_test::Folder folder;
  const std::string file = folder.file("truth" + format);
  const cli_test::Outcome drawn =
      cli_test::run({"render", small_file(), "--size", "96x64", "--set", "/method/name=reference",
                     "--set", change, "-o", file});
  EXPECT_EQ(drawn.code, 0) << drawn.err;
  return cli_test::read_file(file);
}

TEST(References, PostedViewBecomesThePictureOfRender) {
  TestServer server;
  const std::string job_path = begun(server.port(), reference_view);
  double progress = 0;
  const Json job = job_when(server.port(), job_path, [&](const Json& now) {
    EXPECT_GE(now["progress"].get<double>(), progress);
    progress = now["progress"].get<double>();
    return false;
  });
  ASSERT_EQ(job["state"], "done") << job;
  EXPECT_EQ(job["kind"], "reference");
  EXPECT_EQ(job["progress"], 1);
  const Json result = job["result"];
  EXPECT_EQ(result["width"], 96);
  EXPECT_EQ(result["height"], 64);
  const std::string path = result["picture"];
  EXPECT_EQ(path, "/v1/references/" + result["id"].get<std::string>() + ".png");
  const Answer picture = get(server.port(), path);
  ASSERT_EQ(picture.status, 200);
  EXPECT_EQ(picture.header("content-type"), "image/png");
  EXPECT_TRUE(picture.body == rendered(".png")) << "the same bytes";
  EXPECT_EQ(get(server.port(), path, {{"If-None-Match", picture.header("etag")}}).status, 304);
  EXPECT_EQ(get(server.port(), path.substr(0, path.size() - 4)).status, 404);

  const Answer own = post_view(server.port(), reference_view, {{"Accept", "application/x-npy"}});
  const auto values = values_of(own.body, std::size_t{96} * 64);
  const auto truth = values_of(rendered(".npy"), std::size_t{96} * 64);
  ASSERT_EQ(values.size(), truth.size());
  double squares = 0;
  double most = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const double d = static_cast<double>(values[i]) - truth[i];
    squares += d * d;
    most = std::max(most, std::abs(d));
  }
  const double rmse = std::sqrt(squares / static_cast<double>(truth.size()));
  EXPECT_GT(rmse, 0);
  EXPECT_NEAR(result["error"]["value"].get<double>(), rmse, 1e-5 * rmse);
  EXPECT_NEAR(result["error"]["max"].get<double>(), most, 1e-5 * most);
  EXPECT_NEAR(result["error"]["psnr"].get<double>(), -20 * std::log10(rmse), 1e-3);

  // A cached reference is not rendered again; another view is another picture.
  EXPECT_EQ(finished(server.port(), begun(server.port(), reference_view))["result"], result);
  const std::string hurried =
      R"({"dataset":"small","image":{"width":96,"height":64},"quality":{"budgetMs":40}})";
  EXPECT_EQ(finished(server.port(), begun(server.port(), hurried))["result"], result)
      << "the frame budget does not matter";
  const std::string other = R"({"dataset":"small","step":1,"image":{"width":96,"height":64}})";
  EXPECT_NE(finished(server.port(), begun(server.port(), other))["result"]["id"], result["id"]);
}

// The surfaces are looked up while it is drawn, when the scene that has them is gone.
TEST(References, SurfacesAreThoseOfThePictureOfRender) {
  TestServer server;
  const std::string surfaces = R"([{"field":"cloud","isovalue":0.2}])";
  const Json job = finished(
      server.port(),
      begun(server.port(),
            R"({"dataset":"small","image":{"width":96,"height":64},"surfaces":)" + surfaces + "}"));
  ASSERT_EQ(job["state"], "done") << job;
  const Answer picture = get(server.port(), job["result"]["picture"]);
  EXPECT_TRUE(picture.body == rendered(".png", "/surfaces=" + surfaces)) << "the same bytes";
  EXPECT_FALSE(picture.body == rendered(".png")) << "they are seen";
}

TEST(References, OtherRequestsAreServedMeanwhileAndNoWorkIsLost) {
  TestServer server;
  const std::string job_path = begun(server.port(), large_view);
  double progress = 0;
  for (int i = 0; i < 5; ++i) {
    const Json job = job_when(server.port(), job_path, [&](const Json& now) {
      EXPECT_GE(now["progress"].get<double>(), progress);
      return now["progress"].get<double>() > progress;
    });
    ASSERT_EQ(job["state"], "running") << "expected to take longer: " << job;
    progress = job["progress"];
    const std::string frame =
        R"({"dataset":"small","step":)" + std::to_string(i % small_steps) + "}";
    EXPECT_EQ(post_view(server.port(), frame).status, 200);
  }
  EXPECT_EQ(json_of(get(server.port(), job_path))["state"], "running");
  EXPECT_GT(json_of(get(server.port(), job_path))["etaMs"].get<double>(), 0);
}  // and the server ends while it is being drawn

TEST(References, DeletedJobStopsAndFreesItsSlot) {
  TestServer server;
  const std::string first = begun(server.port(), large_view);
  job_when(server.port(), first, [](const Json& now) { return now["state"] == "running"; });
  const Answer refused = post_reference(server.port(), reference_view);
  EXPECT_EQ(refused.status, 429) << "one at a time per address";
  EXPECT_EQ(refused.header("retry-after"), "5");
  EXPECT_EQ(request(server.port(), "DELETE", first).status, 204);
  const std::string second = begun(server.port(), reference_view);
  EXPECT_EQ(finished(server.port(), second)["state"], "done");
  const Json cancelled = json_of(get(server.port(), first));
  EXPECT_EQ(cancelled["state"], "cancelled");
  EXPECT_EQ(cancelled["result"], nullptr);
}

// At 1920 x 1080 the pixel values alone are 32 MiB.
TEST(References, InsufficientMemoryIsReported) {
  TestServer server({}, {}, std::uint64_t{24} << 20);
  const std::string view = R"({"dataset":"small","image":{"width":1920,"height":1080}})";
  const Json job = finished(server.port(), begun(server.port(), view));
  EXPECT_EQ(job["state"], "failed") << job;
  EXPECT_EQ(job["problem"]["status"], 507) << job;
  EXPECT_EQ(job["problem"]["errors"][0]["pointer"], "/image") << job;
  const std::string detail = job["problem"]["detail"];
  EXPECT_NE(detail.find("31.6 MiB"), std::string::npos) << detail;
  EXPECT_NE(detail.find("smaller picture or a larger stride"), std::string::npos) << detail;
  EXPECT_EQ(finished(server.port(), begun(server.port(), reference_view))["state"], "done");
}

TEST(References, InvalidViewIsRefusedWithItsPointer) {
  TestServer server;
  const auto refused = [&](const std::string& view) {
    const Answer answer = post_reference(server.port(), view);
    const Json problem = json_of(answer);
    const std::string at = problem.contains("errors") ? problem["errors"][0]["pointer"] : Json("");
    return std::pair<int, std::string>(answer.status, at);
  };
  using Told = std::pair<int, std::string>;
  static_assert(1921 * 1088 > windsplat::retained_pixels);
  EXPECT_EQ(refused(R"({"dataset":"small","image":{"width":1921,"height":1088}})"),
            Told(413, "/image"));
  EXPECT_EQ(refused(R"({"dataset":"small","method":{"name":"reference"}})"),
            Told(422, "/method/name"));
  EXPECT_EQ(refused(R"({"dataset":"small","step":99})"), Told(422, "/step"));
  EXPECT_EQ(refused(R"({"image":{"width":96,"height":64}})"), Told(422, "/dataset"));
  EXPECT_EQ(refused(R"({"dataset":"none"})").first, 404);
  EXPECT_EQ(refused("{").first, 400);
  const auto plain = request(server.port(), "POST", "/v1/references", {}, reference_view);
  EXPECT_EQ(plain.status, 415);
  EXPECT_EQ(get(server.port(), "/v1/references").header("allow"), "POST, OPTIONS");
  EXPECT_EQ(get(server.port(), "/v1/references/none.png").status, 404);
  EXPECT_EQ(json_of(get(server.port(), "/v1"))["links"]["references"], "/v1/references");
}

TEST(ReferenceTickets, OnePerAddressAndFourOfAKind) {
  References references;
  const CancelToken unwanted;
  const auto first = references.admit("a", unwanted);
  ASSERT_TRUE(first);
  EXPECT_EQ(references.admit("a", {}).error().kind, windsplat::ErrorKind::busy);
  auto b = references.admit("b", {});
  const auto c = references.admit("c", {});
  const auto d = references.admit("d", {});
  ASSERT_TRUE(b && c && d);
  EXPECT_FALSE(references.admit("e", {})) << "four are waiting";
  EXPECT_TRUE(references.admit("e", {}, References::Drawn::animation)) << "which are references";
  b->reset();
  const auto e = references.admit("e", {});
  EXPECT_TRUE(e) << "one has ended";
  EXPECT_FALSE(references.admit("f", {}));
  unwanted.cancel();
  EXPECT_TRUE(references.admit("a", {})) << "the first is cancelled";
}

TEST(ReferencePictures, LeastRecentlyRequestedAreEvicted) {
  References references;
  const auto keep = [&](const std::string& id, std::size_t bytes) {
    windsplat::protocol::ReferenceDescription description;
    description.id = id;
    references.keep({description, std::make_shared<windsplat::image::Bytes>(bytes)});
  };
  constexpr std::size_t third = References::bytes_max / 3;
  for (const char* id : {"a", "b", "c"}) keep(id, third);
  EXPECT_TRUE(references.find("a"));
  keep("d", third);
  EXPECT_TRUE(references.find("a"));
  EXPECT_FALSE(references.find("b"));
  EXPECT_TRUE(references.find("c") && references.find("d"));
  keep("e", 2 * References::bytes_max);
  EXPECT_FALSE(references.find("d"));
  EXPECT_EQ(references.find("e")->png->size(), 2 * References::bytes_max);
}

}  // namespace
}  // namespace server_test
