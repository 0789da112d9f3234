// Stills: their size, their order among moving frames, and their errors.
#include <gmock/gmock.h>

#include "driver.hpp"

namespace session_test {
namespace {

using testing::ElementsAre;

TEST(Still, IsRenderedAtItsSizeAndAnnouncedWithItsId) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind","step":3})");
  driver.settle();
  driver.texts.clear();
  protocol::StillMessage still;
  still.id = 77;
  still.width = 1000;
  still.height = 500;
  still.scale = 2;
  driver.say(still);
  ASSERT_TRUE(driver.render);
  EXPECT_EQ(driver.render->view.image.width, 2000);
  EXPECT_EQ(driver.render->view.image.height, 1000);
  EXPECT_EQ(driver.render->setting.half_level, 0);
  driver.finish_render(500 * ms);
  const auto header = driver.frames.back().header;
  EXPECT_EQ(header.codec, protocol::Codec::png);
  EXPECT_EQ(header.width, 2000);
  EXPECT_TRUE(Driver::is_final(driver.frames.back()));
  const auto progress = driver.texts_of<protocol::ProgressMessage>();
  ASSERT_EQ(progress.size(), 2U);
  EXPECT_EQ(progress[1].id, 77U);
  EXPECT_EQ(progress[1].done, 1);
  EXPECT_EQ(driver.texts_of<protocol::ChosenMessage>().back().seq, header.seq);
}

TEST(Still, WaitsForCreditAndIsServedWhileTheViewMoves) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.finish_render();
  driver.ack(1);
  driver.patch(2, R"({"step":1})");
  protocol::StillMessage still;
  still.id = 1;
  still.format = "jpeg";
  driver.say(still);
  for (std::uint32_t rev = 3; rev < 8; ++rev) {
    driver.patch(rev, R"({"step":)" + std::to_string(rev) + "}");
    driver.finish_render();
    driver.ack(driver.frames.back().header.seq);
  }
  int stills = 0;
  for (const SendFrame& frame : driver.frames) stills += frame.header.quality == 95 ? 1 : 0;
  EXPECT_EQ(stills, 1);
}

TEST(Still, ReleasedDataDuringLoadingAreReported) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.settle();
  protocol::StillMessage still;
  still.id = 77;
  driver.say(still);
  driver.fail_render(make_error(ErrorKind::not_resident, "its memory was released; try again"));
  ASSERT_EQ(driver.errors().size(), 1U);
  EXPECT_EQ(driver.errors()[0].id, 77U);
  EXPECT_FALSE(driver.render) << "a client that still needs it requests it again";
}

TEST(Still, OversizeExcessOrEmptyStillIsAnError) {
  Driver driver;
  protocol::StillMessage still;
  still.id = 1;
  driver.say(still);
  driver.patch(1, R"({"dataset":"wind","image":{"width":4000,"height":4000}})");
  still.scale = 4;
  still.id = 2;
  driver.say(still);
  still.scale = 1;
  for (std::uint32_t id = 3; id < 9; ++id) {
    still.id = id;
    driver.say(still);
  }
  std::vector<std::pair<std::uint32_t, int>> answers;
  for (const auto& error : driver.errors()) {
    answers.emplace_back(error.id.value_or(0), error.problem.status);
  }
  EXPECT_THAT(answers, ElementsAre(std::pair(1U, 404), std::pair(2U, 413), std::pair(5U, 429),
                                   std::pair(6U, 429), std::pair(7U, 429), std::pair(8U, 429)));
}

}  // namespace
}  // namespace session_test
