// Differences over REST and the stream: the same pictures as of a file that contains them.
#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "protocol/frame_header.hpp"
#include "server/data/model/volume.hpp"
#include "server/data/resident/store.hpp"
#include "tests/integration/difference_files.hpp"
#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

namespace fs = std::filesystem;
namespace files = difference_files;
using testing::HasSubstr;

// A stream whose final frames are awaited.
class DifferenceStream : public StreamClient {
 public:
  using StreamClient::StreamClient;

  bool reaches_final(std::uint32_t rev, const std::string& patch) {
    say(R"({"type":"patch","rev":)" + std::to_string(rev) + R"(,"t":1,"patch":)" + patch + "}");
    const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(patience_ms);
    while (std::chrono::steady_clock::now() < end) {
      const auto bytes = next_frame();
      if (!bytes) return false;
      const auto header = windsplat::protocol::parse_frame_header(
          {reinterpret_cast<const std::uint8_t*>(bytes->data()), bytes->size()});
      if (!header) return false;
      say(Json{{"type", "ack"}, {"seq", header->seq}, {"decodeMs", 1}}.dump());
      const bool last = (header->flags & windsplat::protocol::flag_final) != 0;
      if (last && header->rev == rev) return true;
    }
    return false;
  }
};

class Differences : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "windsplat-minus-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    root_ = name;
    add("a", files::first);
    add("b", files::second);
  }
  void TearDown() override { fs::remove_all(root_); }

  void add(const std::string& id, const files::Fields& fields, double spacing = 500,
           const char* units = "K") {
    const std::string path = (root_ / (id + ".nc")).native();
    files::write(path, fields, spacing, units);
    const auto added = server_.store().add(path);
    ASSERT_TRUE(added) << added.error().message;
  }
  static Json view_of(const std::string& dataset, const Json& difference = nullptr) {
    Json view = Json::parse(files::explicit_view);
    view["dataset"] = dataset;
    if (!difference.is_null()) view["difference"] = difference;
    return view;
  }
  Answer post(const Json& view, const char* type = "application/x-npy") {
    return post_view(server_.port(), view.dump(), {{"Accept", type}});
  }
  std::string picture(const Json& view) {
    const Answer answer = post(view);
    EXPECT_EQ(answer.status, 200) << answer.body;
    return answer.body;
  }

  fs::path root_;
  TestServer server_;
};

TEST_F(Differences, PicturesAreThoseOfAFileThatContainsTheDifference) {
  add("of-datasets", files::minus(files::first, files::second));
  add("of-steps", files::minus(files::first, files::at_step(files::first, 0)));
  add("of-both", files::minus(files::first, files::at_step(files::second, 1)));
  const std::vector<std::pair<std::string, Json>> cases{
      {"of-datasets", {{"dataset", "b"}}},
      {"of-steps", {{"step", 0}}},
      {"of-both", {{"dataset", "b"}, {"step", 1}}}};
  const std::string plain = picture(view_of("a"));
  for (const char* method : {"kernel", "slab"}) {
    for (const auto& [id, difference] : cases) {
      Json expected = view_of(id);
      Json shown = view_of("a", difference);
      expected["method"]["name"] = shown["method"]["name"] = method;
      const std::string drawn = picture(shown);
      EXPECT_TRUE(drawn == picture(expected)) << id << " by " << method;
      EXPECT_FALSE(drawn == plain) << id;
    }
  }
}

TEST_F(Differences, TagsOfPicturesDependOnBothDatasets) {
  const Answer first = post(view_of("a", {{"dataset", "b"}}), "image/png");
  const Answer again =
      post_view(server_.port(), view_of("a", {{"dataset", "b"}}).dump(),
                {{"Accept", "image/png"}, {"If-None-Match", first.header("etag")}});
  EXPECT_EQ(again.status, 304);
  EXPECT_NE(post(view_of("a", {{"step", 1}}), "image/png").header("etag"), first.header("etag"));
}

TEST_F(Differences, AreShownByAStreamThatPlaysThem) {
  DifferenceStream stream(server_.port());
  Json view = view_of("a", {{"dataset", "b"}});
  view["step"] = 0;
  ASSERT_TRUE(stream.reaches_final(1, view.dump()));
  ASSERT_TRUE(stream.reaches_final(2, R"({"step": 2})"));
  Json chosen;
  for (const std::string& text : stream.texts) {
    const Json json = Json::parse(text);
    if (json["type"] == "chosen") chosen = json;
  }
  ASSERT_TRUE(chosen.contains("view"));
  EXPECT_EQ(chosen["view"]["difference"]["dataset"], "b");
  EXPECT_EQ(chosen["view"]["step"], 2);
  stream.say(R"({"type": "open", "id": 1, "dataset": "small"})");
  ASSERT_TRUE(stream.reaches_final(3, R"({"image": {"width": 150}})"))
      << "neither its grid nor its fields are those of the surfaces and the difference";
}

TEST_F(Differences, WhatCannotBeSubtractedIsRefusedWithItsPlace) {
  add("stretched", files::second, 600);
  add("celsius", files::second, 500, "degC");
  const auto expect_refused = [&](const Json& view, int status, const std::string& pointer,
                                  const std::string& words) {
    const Answer answer = post(view);
    EXPECT_EQ(answer.status, status) << answer.body;
    EXPECT_THAT(answer.body, HasSubstr("\"" + pointer + "\"")) << answer.body;
    EXPECT_THAT(answer.body, HasSubstr(words)) << answer.body;
  };
  expect_refused(view_of("a", {{"dataset", "stretched"}}), 422, "/difference/dataset",
                 "the grids differ along z ('z'): sample 1 is at 500 here, at 600 in 'stretched'");
  expect_refused(view_of("a", {{"dataset", "celsius"}}), 422, "/difference",
                 "the units of 't' differ: 'K' here, 'degC' in 'celsius'");
  expect_refused(view_of("a", {{"dataset", "none"}}), 404, "/difference/dataset", "'none'");
  expect_refused(view_of("a", Json::object()), 422, "/difference", "must name a dataset, a step");
  expect_refused(view_of("a", {{"step", 3}}), 422, "/difference/step", "has steps 0 to 2");
}

TEST_F(Differences, FiguresSayWhatIsSubtracted) {
  Json view = view_of("a", {{"dataset", "b"}, {"step", 1}});
  view["image"] = {{"width", 900}, {"height", 700}};
  view["annotations"] = {{"legend", true}, {"title", true}, {"stepTime", true}};
  const std::string figure = post(view, "image/svg+xml").body;
  EXPECT_THAT(figure, HasSubstr("difference of t"));
  EXPECT_THAT(figure, HasSubstr("difference of "));
  EXPECT_THAT(figure, HasSubstr("minus b"));
  EXPECT_THAT(figure, HasSubstr("step 2 of 3"));
  view.erase("difference");
  EXPECT_THAT(post(view, "image/svg+xml").body, testing::Not(HasSubstr("minus")));
}

// Values of differences: steps 1 and 0 of the same file, opened without a server.
class ComparedValues : public testing::Test {
 protected:
  void SetUp() override {
    const auto added = store_.add(small_file());
    ASSERT_TRUE(added);
    dataset_ = *added;
    name_ = dataset_->info().first(windsplat::data::FieldKind::scalar)->name;
    later_ = dataset_->volume(name_, 1).value();
    first_ = dataset_->volume(name_, 0).value();
  }
  Answer answer(const std::string& what) {
    return get(server_.port(), "/v1/datasets/small/" + what);
  }
  Json ask(const std::string& what) {
    const Answer got = answer(what);
    EXPECT_EQ(got.status, 200) << what << ' ' << got.body;
    return json_of(got);
  }
  [[nodiscard]] float change(std::size_t sample) const {
    return later_->component(0)[sample] - first_->component(0)[sample];
  }

  windsplat::data::Store store_{std::uint64_t{1} << 30};
  std::shared_ptr<windsplat::data::Dataset> dataset_;
  std::string name_;
  std::shared_ptr<const windsplat::data::Volume> later_;
  std::shared_ptr<const windsplat::data::Volume> first_;
  TestServer server_;
};

TEST_F(ComparedValues, HistogramAndRangeOfADifferenceCountTheChangesOfAllSamples) {
  float low = change(0);
  float high = low;
  std::size_t rising = 0;
  for (std::size_t n = 0; n < later_->samples(); ++n) {
    low = std::min(low, change(n));
    high = std::max(high, change(n));
    rising += change(n) > 0 ? 1 : 0;
  }
  ASSERT_LT(low, 0);
  ASSERT_GT(rising, 0U);
  const std::string field = "fields/" + name_;
  const Json histogram = ask(field + "/histogram?step=1&minusStep=0");
  EXPECT_EQ(histogram["range"][0].get<float>(), low);
  EXPECT_EQ(histogram["range"][1].get<float>(), high);
  const Json upper =
      ask(field + "/histogram?step=1&minusStep=0&bins=1&range=1e-30," + std::to_string(2 * high));
  EXPECT_EQ(upper["counts"][0], rising);
  EXPECT_EQ(ask(field + "/range?step=1&minusStep=0")["range"], histogram["range"]);
  EXPECT_EQ(ask(field + "/range?step=1&minus=small&minusStep=0")["range"], histogram["range"]);
}

// The ranges of a field and of its differences are kept apart.
TEST_F(ComparedValues, RangeOfAllStepsOfADifferenceIsNotThatOfTheField) {
  const std::string all = "fields/" + name_ + "/range?of=all";
  const Json changes = ask(all + "&minusStep=0");
  const Json values = ask(all);
  EXPECT_LT(changes["range"][0].get<float>(), 0);
  EXPECT_NE(values["range"], changes["range"]);
  EXPECT_EQ(ask(all + "&minusStep=0"), changes);
}

TEST_F(ComparedValues, ProbeAndSeriesOfADifferenceAreTheChangesOfASample) {
  constexpr std::size_t sample = (2 * 16 + 3) * 32 + 5;
  const Json probe = ask("probe?index=5,3,2&step=1&minusStep=0");
  EXPECT_EQ(probe["values"][name_]["value"].get<float>(), change(sample));
  const Json series = ask("fields/" + name_ + "/series?index=5,3,2&minusStep=0");
  EXPECT_EQ(series["values"][0], 0);
  EXPECT_EQ(series["values"][1].get<float>(), change(sample));
}

TEST_F(ComparedValues, AProbeComputesTheDerivedFieldsThatItIsAskedFor) {
  const auto& fields = dataset_->info().fields;
  const auto derived =
      std::find_if(fields.begin(), fields.end(), [](const auto& field) { return field.derived; });
  ASSERT_NE(derived, fields.end());
  EXPECT_FALSE(ask("probe?index=5,3,2&step=1")["values"].contains(derived->name));
  const Json probe = ask("probe?index=5,3,2&step=1&fields=" + name_ + "," + derived->name);
  const auto there = dataset_->volume(derived->name, 1).value();
  const Json& value = probe["values"][derived->name]["value"];
  EXPECT_EQ((derived->components.size() == 1 ? value : value[0]).get<float>(),
            there->component(0)[(2 * 16 + 3) * 32 + 5]);
  for (const auto& field : fields) {
    if (field.derived) continue;
    EXPECT_TRUE(probe["values"].contains(field.name)) << field.name;
  }
}

TEST_F(ComparedValues, WhatCannotBeSubtractedIsRefused) {
  const auto refused = [&](const std::string& what, int status, const std::string& words) {
    const Answer got = answer(what);
    EXPECT_EQ(got.status, status) << got.body;
    EXPECT_THAT(json_of(got).value("detail", ""), testing::HasSubstr(words));
  };
  const std::string histogram = "fields/" + name_ + "/histogram?";
  refused(histogram + "minus=gone", 404, "'minusStep': there is no dataset 'gone'");
  refused(histogram + "minusStep=99", 422, "steps 0 to");
  refused(histogram + "minusStep=-1", 422, "minusStep");
  refused("probe?index=5,3,2&fields=nope", 422, "nope");
}

}  // namespace
}  // namespace server_test
