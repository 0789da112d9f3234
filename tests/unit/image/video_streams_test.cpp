// The limit on video encoders of all sessions.
#include "server/image/video_streams.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace {

using windsplat::image::VideoStreams;

TEST(VideoStreams, AreLimitedAndCountedUntilTheirLastUse) {
  int counted = 0;
  VideoStreams streams([&counted](int more) { counted += more; });
  std::vector<std::shared_ptr<windsplat::image::VideoEncoder>> open;
  for (int n = 0; n < VideoStreams::streams_max; ++n) {
    open.push_back(streams.open());
    ASSERT_NE(open.back(), nullptr);
  }
  EXPECT_EQ(streams.open(), nullptr);
  EXPECT_EQ(counted, VideoStreams::streams_max);
  auto in_a_render = open.back();
  open.pop_back();
  EXPECT_EQ(streams.open(), nullptr) << "a render still uses it";
  open.erase(open.begin());
  EXPECT_NE(streams.open(), nullptr);
  open.clear();
  EXPECT_EQ(counted, 1);
  in_a_render.reset();
  EXPECT_EQ(counted, 0);
}

}  // namespace
