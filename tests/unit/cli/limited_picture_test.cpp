// Pictures of the command line with limits: how often their views are described.
#include "server/cli/limited_picture.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "server/data/samples/samples.hpp"
#include "server/frame/content.hpp"

namespace windsplat::cli {
namespace {

// Calibration, choice and up to three attempts share one description.
TEST(LimitedPictures, DescribeAViewOnce) {
  constexpr std::uint64_t bytes_max = std::uint64_t{1} << 28U;
  data::Dataset dataset(data::open_sample("tornado", {24, 24, 24}, 2).value(), "tornado",
                        bytes_max);
  ThreadPool pool(2);
  frame::Encoding encoding;
  encoding.measure = true;
  LimitedPictures pictures(dataset, encoding, pool);
  protocol::View view;
  view.image.width = 128;
  view.image.height = 96;
  view.quality.max_error = 1e-5;  // exceeded, so that other settings are tried
  const std::uint64_t before = frame::descriptions();
  ASSERT_TRUE(pictures.draw(view, {}));
  EXPECT_EQ(frame::descriptions() - before, 1U);
  ASSERT_TRUE(pictures.draw(view, {}));
  EXPECT_EQ(frame::descriptions() - before, 1U) << "the same view";
  view.step = 1;
  ASSERT_TRUE(pictures.draw(view, {}));
  EXPECT_EQ(frame::descriptions() - before, 2U) << "another step, not calibrated again";
}

}  // namespace
}  // namespace windsplat::cli
