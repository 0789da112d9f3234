// Animations over real sockets: a posted motion becomes a movie whose pictures are those of
// POST /v1/frames; refusals, limits, cancelling and what is served.

#include <gmock/gmock.h>

#include <atomic>
#include <cstdlib>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "tests/integration/cli_program.hpp"
#include "tests/integration/server/opening.hpp"
#include "tests/integration/server/test_server.hpp"
#include "tests/unit/movie/movie_files.hpp"

namespace server_test {
namespace {

using testing::HasSubstr;
using windsplat::movie::testing::MovieFolder;

const Json camera{{"eye", {2.5, -1.5, 1.5}}, {"target", {0, 0, 0}}};

Json view_of(const Json& more = Json::object()) {
  Json view{{"dataset", "small"}, {"image", {{"width", 90}, {"height", 60}}}};
  view.merge_patch(more);
  return view;
}

Answer post_animation(std::uint16_t port, const Json& body) {
  return request(port, "POST", "/v1/animations", {{"Content-Type", "application/json"}},
                 body.dump());
}

// The job once it is over.
Json animated(std::uint16_t port, const Json& body) {
  const Answer answer = post_animation(port, body);
  EXPECT_EQ(answer.status, 202) << answer.body;
  EXPECT_NE(answer.header("retry-after"), "");
  const Json job = json_of(answer);
  if (!job.contains("id")) return {};
  EXPECT_EQ(answer.header("location"), "/v1/jobs/" + job["id"].get<std::string>());
  return finished_job(port, job["id"]);
}

// The pictures of an archive, in order, unpacked by another program.
std::vector<std::string> pictures_of(const std::string& zip) {
  const MovieFolder folder;
  folder.write("movie.zip", zip);
  const std::string unpack =
      "python3 -m zipfile -e " + folder.file("movie.zip") + " " + folder.file("out");
  EXPECT_EQ(std::system(unpack.c_str()), 0);
  std::vector<std::string> out;
  for (int n = 0;; ++n) {
    char name[40];
    std::snprintf(name, sizeof name, "out/frame_%06d.png", n);
    std::string png = folder.text(name);
    if (png.empty()) return out;
    out.push_back(std::move(png));
  }
}

std::vector<std::string> pictures_of(std::uint16_t port, Json body) {
  body["format"] = "zip";
  const Json job = animated(port, body);
  EXPECT_EQ(job.value("state", ""), "done") << job;
  if (job.value("state", "") != "done") return {};
  return pictures_of(get(port, job["result"]["movie"]).body);
}

std::string still(std::uint16_t port, const Json& view) {
  return post_view(port, view.dump(), {{"Accept", "image/png"}}).body;
}

// Searches programs elsewhere while it exists; begins before a server and ends after it.
class SearchPath {
 public:
  explicit SearchPath(const std::string& path) : before_(std::getenv("PATH")) { set(path); }
  ~SearchPath() { set(before_); }
  SearchPath(const SearchPath&) = delete;
  SearchPath& operator=(const SearchPath&) = delete;

 private:
  static void set(const std::string& path) {
    ::setenv("PATH", path.c_str(), 1);  // NOLINT(concurrency-mt-unsafe)
  }
  std::string before_;
};

TEST(Animations, StepsAreThePicturesOfTheirViews) {
  TestServer server;
  const Json view = view_of();
  const Json job = animated(server.port(), {{"view", view}, {"format", "zip"}, {"fps", 5}});
  ASSERT_EQ(job["state"], "done") << job;
  EXPECT_EQ(job["kind"], "animation");
  EXPECT_EQ(job["progress"], 1);
  const Json result = job["result"];
  EXPECT_EQ(result["frames"], small_steps);
  EXPECT_EQ(result["fps"], 5);
  EXPECT_EQ(result["width"], 90);
  EXPECT_EQ(result["height"], 60);
  EXPECT_EQ(result["movie"], "/v1/animations/" + result["id"].get<std::string>() + ".zip");
  const Answer file = get(server.port(), result["movie"]);
  ASSERT_EQ(file.status, 200);
  EXPECT_EQ(file.header("content-type"), "application/zip");
  EXPECT_EQ(file.header("content-disposition"), "attachment; filename=\"small.zip\"");
  EXPECT_EQ(file.body.size(), result["bytes"]);
  const auto pictures = pictures_of(file.body);
  ASSERT_EQ(pictures.size(), small_steps);
  for (int step = 0; step < small_steps; ++step) {
    EXPECT_TRUE(pictures[static_cast<std::size_t>(step)] ==
                still(server.port(), view_of({{"step", step}})))
        << step;
  }
  EXPECT_FALSE(pictures[0] == pictures[1]);
  EXPECT_EQ(pictures_of(server.port(), {{"view", view}, {"steps", {{"first", 1}}}}),
            std::vector(pictures.begin() + 1, pictures.end()));
  EXPECT_EQ(pictures_of(server.port(), {{"view", view}, {"steps", {{"stride", 2}}}}),
            (std::vector{pictures[0], pictures[2]}));
}

TEST(Animations, ATurnBeginsAtThePictureOfItsViewAndEveryPictureDiffers) {
  TestServer server;
  const Json view = view_of({{"camera", camera}});
  const auto pictures = pictures_of(
      server.port(), {{"view", view}, {"steps", {{"last", 0}}}, {"turn", 360}, {"frames", 4}});
  ASSERT_EQ(pictures.size(), 4);
  EXPECT_TRUE(pictures[0] == still(server.port(), view));
  // A quarter of a turn about the vertical through the target.
  EXPECT_TRUE(pictures[1] ==
              still(server.port(),
                    view_of({{"camera", {{"eye", {1.5, 2.5, 1.5}}, {"target", {0, 0, 0}}}}})));
  for (std::size_t a = 0; a < pictures.size(); ++a) {
    EXPECT_EQ(cli_test::png_size(pictures[a]), (std::pair<std::uint32_t, std::uint32_t>(90, 60)));
    for (std::size_t b = 0; b < a; ++b) EXPECT_FALSE(pictures[a] == pictures[b]) << a << ' ' << b;
  }
}

TEST(Animations, APathEndsAtItsLastKeyframe) {
  TestServer server;
  const Json from{{"projection", "perspective"}, {"eye", {3, -2, 2}}, {"target", {0, 0, 0}}};
  const Json to{{"projection", "perspective"}, {"eye", {2, 2, 1}}, {"target", {0.1, 0, 0}}};
  const Json path{{"keyframes", {{{"time", 0}, {"camera", from}}, {{"time", 2}, {"camera", to}}}}};
  const auto pictures = pictures_of(
      server.port(), {{"view", view_of()}, {"steps", {{"last", 0}}}, {"path", path}, {"fps", 1}});
  ASSERT_EQ(pictures.size(), 3) << "at 0, 1 and 2 s";
  EXPECT_TRUE(pictures[0] == still(server.port(), view_of({{"camera", from}})));
  EXPECT_TRUE(pictures[2] == still(server.port(), view_of({{"camera", to}})));
}

TEST(Animations, LinesFlowBetweenTheSteps) {
  TestServer server;
  const Json flow{{"vector", {{"motion", {{"mode", "phase"}}}}}};
  const auto pictures = pictures_of(
      server.port(), {{"view", view_of(flow)}, {"steps", {{"last", 0}}}, {"perStep", 4}});
  ASSERT_EQ(pictures.size(), 4);
  Json half = view_of(flow);
  half["vector"]["motion"]["time"] = 0.5;
  EXPECT_TRUE(pictures[2] == still(server.port(), half));
  EXPECT_FALSE(pictures[2] == pictures[0]);
}

TEST(Animations, VideosAreWrittenByFfmpeg) {
  if (std::system("ffmpeg -version > /dev/null 2>&1") != 0) GTEST_SKIP() << "no ffmpeg";
  TestServer server;
  for (const auto& [format, type, start] :
       {std::tuple("mp4", "video/mp4", std::string("ftyp")),
        std::tuple("webm", "video/webm", std::string("\x1a\x45\xdf\xa3"))}) {
    const Json job = animated(server.port(), {{"view", view_of()}, {"format", format}});
    ASSERT_EQ(job["state"], "done") << job;
    const Answer file = get(server.port(), job["result"]["movie"]);
    EXPECT_EQ(file.header("content-type"), type);
    EXPECT_THAT(file.body.substr(0, 12), HasSubstr(start));
    const MovieFolder folder;
    folder.write("movie", file.body);
    const std::string count =
        "ffprobe -v error -count_frames -show_entries "
        "stream=width,height,nb_read_frames -of csv=p=0 " +
        folder.file("movie") + " > " + folder.file("count");
    ASSERT_EQ(std::system(count.c_str()), 0);
    EXPECT_EQ(folder.text("count"), "90,60,3\n");
  }
}

TEST(Animations, WithoutFfmpegVideosAreRefusedAtOnceAndArchivesAreMade) {
  const SearchPath path("/nonexistent");
  TestServer server;
  const Answer refused = post_animation(server.port(), {{"view", view_of()}, {"format", "mp4"}});
  EXPECT_EQ(refused.status, 422);
  EXPECT_EQ(json_of(refused)["errors"][0]["pointer"], "/format");
  EXPECT_THAT(refused.body, HasSubstr("zip"));
  EXPECT_EQ(animated(server.port(), {{"view", view_of()}, {"format", "zip"}})["state"], "done");
}

TEST(Animations, RefusalsNameThePlaceAndTheLimit) {
  TestServer server;
  struct Case {
    Json body;
    int status;
    const char* pointer;
    const char* words;
  };
  const Json turn{{"view", view_of()}, {"format", "zip"}, {"turn", 360}};
  // Its camera looks upward at its end, which is an error of /path that costs all of its pictures.
  const Json path{{"keyframes",
                   {{{"time", 0}, {"camera", {{"eye", {3, -2, 2}}, {"target", {0, 0, 0}}}}},
                    {{"time", 5000}, {"camera", {{"eye", {0, 0, 2}}, {"target", {0, 0, 0}}}}}}}};
  const auto with = [&](const Json& more) {
    Json body = turn;
    body.merge_patch(more);
    return body;
  };
  for (const Case& each : std::vector<Case>{
           {{{"format", "zip"}}, 422, "/view", "required"},
           {with({{"view", {{"dataset", "none"}}}}), 404, "", "none"},
           {with({{"view", {{"image", {{"width", 0}}}}}}), 422, "/view/image/width", "1 to 8192"},
           {with({{"view", {{"vector", {{"field", "nope"}}}}}}), 422, "/view/vector/field", "nope"},
           {with({{"view", {{"quality", {{"budgetMs", 40}}}}}}), 422, "/view/quality", "one size"},
           {with({{"view", {{"method", {{"name", "reference"}}}}}}), 422, "/view/method/name",
            "slab"},
           {with({{"format", "gif"}}), 422, "/format", "webm"},
           {with({{"steps", {{"last", 3}}}}), 422, "/steps", "is 2"},
           {with({{"steps", {{"first", 2}, {"last", 1}}}}), 422, "/steps/last", "before"},
           {with({{"frames", 4}, {"perStep", 2}}), 422, "/perStep", "frames"},
           {with({{"path", {{"keyframes", Json::array()}}}}), 422, "/path/keyframes", "keyframes"},
           {with({{"turn", nullptr}, {"frames", 9}}), 422, "/frames", "phase"},
           {with({{"fps", 1000}}), 422, "/fps", "240"},
           {with({{"frames", 3601}}), 413, "/frames", "3600 pictures"},
           {with({{"frames", 3600}, {"view", {{"image", {{"width", 1280}, {"height", 900}}}}}}),
            413, "/frames", "4000000000 pixels"},
           {with({{"turn", nullptr}, {"path", path}}), 413, "/frames", "3600 pictures"},
           {with({{"format", "mp4"}, {"view", {{"image", {{"width", 4097}, {"height", 2304}}}}}}),
            413, "/view/image", "zip"},
       }) {
    const Answer answer = post_animation(server.port(), each.body);
    EXPECT_EQ(answer.status, each.status) << each.body << answer.body;
    const Json problem = json_of(answer);
    if (each.pointer[0] != '\0' && problem.contains("errors")) {
      EXPECT_EQ(problem["errors"][0]["pointer"], each.pointer) << answer.body;
    } else {
      EXPECT_THAT(problem["detail"].get<std::string>(), HasSubstr(each.pointer));
    }
    EXPECT_THAT(answer.body, HasSubstr(each.words));
  }
  EXPECT_EQ(request(server.port(), "POST", "/v1/animations", {}, turn.dump()).status, 415);
  EXPECT_TRUE(json_of(get(server.port(), "/v1/jobs"))["jobs"].empty()) << "nothing was begun";
}

TEST(Animations, OneAtATimeForAnAddressAndACancelledOneEnds) {
  TestServer server;
  const Json large{{"view", view_of({{"image", {{"width", 1600}, {"height", 1200}}}})},
                   {"format", "zip"},
                   {"turn", 360},
                   {"frames", 300}};
  const Answer begun = post_animation(server.port(), large);
  ASSERT_EQ(begun.status, 202) << begun.body;
  const std::string id = json_of(begun)["id"];
  ASSERT_TRUE(is_running(server.port(), id));
  const Answer second = post_animation(server.port(), large);
  EXPECT_EQ(second.status, 429);
  EXPECT_NE(second.header("retry-after"), "");
  ASSERT_TRUE(comes_true(
      [&] { return json_of(get(server.port(), "/v1/jobs/" + id)).value("progress", 0.0) > 0; }));
  EXPECT_EQ(get(server.port(), "/v1/datasets/small/frame.jpg?width=64&height=48").status, 200)
      << "pictures of others are drawn meanwhile";
  EXPECT_EQ(request(server.port(), "DELETE", "/v1/jobs/" + id).status, 204);
  EXPECT_EQ(finished_job(server.port(), id)["state"], "cancelled");
  EXPECT_EQ(animated(server.port(), {{"view", view_of()}, {"format", "zip"}})["state"], "done");
}

TEST(Animations, AreFinishedWhileOthersDrawAllTheTime) {
  TestServer server;
  std::atomic<bool> over{false};
  std::atomic<int> drawn{0};
  std::thread viewer([&] {
    for (int n = 0; !over; ++n) {
      const std::string size = "width=" + std::to_string(64 + n % 500) + "&height=48";
      if (get(server.port(), "/v1/datasets/small/frame.jpg?" + size).status == 200) ++drawn;
    }
  });
  const Json job =
      animated(server.port(), {{"view", view_of({{"image", {{"width", 1600}, {"height", 1200}}}})},
                               {"format", "zip"},
                               {"turn", 360},
                               {"frames", 3}});
  over = true;
  viewer.join();
  EXPECT_EQ(job["state"], "done") << job;
  EXPECT_GT(drawn, 3);
}

TEST(Animations, ADrainEndsThem) {
  TestServer server;
  const Json large{{"view", view_of({{"image", {{"width", 1600}, {"height", 1200}}}})},
                   {"format", "zip"},
                   {"turn", 360},
                   {"frames", 300}};
  ASSERT_EQ(post_animation(server.port(), large).status, 202);
  server.stop();  // does not wait for 300 pictures, or the test runs out of time
}

TEST(Animations, TheSameRequestIsTheSameFile) {
  TestServer server;
  const Json body{{"view", view_of()}, {"format", "zip"}};
  const Json first = animated(server.port(), body)["result"];
  EXPECT_EQ(animated(server.port(), body)["result"], first);
  const std::string path = first["movie"];
  const Answer file = get(server.port(), path);
  EXPECT_EQ(get(server.port(), path, {{"If-None-Match", file.header("etag")}}).status, 304);
  EXPECT_EQ(request(server.port(), "HEAD", path).header("content-length"),
            std::to_string(file.body.size()));
  const std::string other = path.substr(0, path.size() - 3) + "mp4";
  EXPECT_EQ(get(server.port(), other).status, 404) << "it is a ZIP";
  EXPECT_EQ(get(server.port(), "/v1/animations/none.zip").status, 404);
  EXPECT_EQ(request(server.port(), "DELETE", other).status, 404);
  EXPECT_EQ(request(server.port(), "DELETE", path).status, 204);
  EXPECT_EQ(get(server.port(), path).status, 404);
  EXPECT_EQ(animated(server.port(), body)["result"]["movie"], path) << "it is made again";
}

}  // namespace
}  // namespace server_test
