// frame::ReferenceDrawing: rendering in interrupted pieces equals one pass; the error of the
// picture of the view.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <vector>

#include "server/data/resident/budget.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/data/samples/samples.hpp"
#include "server/frame/frame.hpp"
#include "server/frame/reference.hpp"

namespace windsplat::frame {
namespace {

class Drawing : public testing::Test {
 protected:
  void SetUp() override {
    auto source = data::open_sample("climate", {24, 12, 5}, 1);
    ASSERT_TRUE(source) << source.error().message;
    dataset = std::make_unique<data::Dataset>(std::move(*source), "climate", 1ULL << 30);
    view.dataset = "climate";
    view.image.width = 75;  // not a multiple of a piece
    view.image.height = 40;
  }

  Result<std::unique_ptr<ReferenceDrawing>> begin(const CancelToken& cancel = {}) {
    reserved = 0;
    const WorkMemory memory{[this](std::uint64_t bytes) -> Result<std::shared_ptr<const void>> {
                              if (reserved + bytes > limit)
                                return make_error(ErrorKind::out_of_memory, "a field");
                              reserved += bytes;
                              return std::shared_ptr<const void>(std::make_shared<int>());
                            },
                            [this] { return limit - reserved; }};
    return ReferenceDrawing::begin(scene::complete(view, *dataset).value(), *dataset, pool.size(),
                                   cancel, memory);
  }

  Result<Frame> at_once(protocol::MethodName method, Format format) {
    Encoding encoding;
    encoding.format = format;
    encoding.allow_reference = true;
    protocol::View asked = view;
    asked.method.name = method;
    return produce(asked, *dataset, encoding, pool, {});
  }

  // The values of a picture as .npy.
  std::vector<float> values_of(const Frame& frame) const {
    std::vector<float> values(4 * static_cast<std::size_t>(frame.width * frame.height));
    const std::size_t bytes = values.size() * sizeof(float);
    std::memcpy(values.data(), frame.bytes.data() + frame.bytes.size() - bytes, bytes);
    return values;
  }

  std::unique_ptr<data::Dataset> dataset;
  protocol::View view;
  ThreadPool pool{3};
  std::uint64_t limit = 1ULL << 40;
  std::uint64_t reserved = 0;
};

TEST_F(Drawing, InterruptedStripsGiveThePictureRenderedAtOnce) {
  const auto drawing = begin();
  ASSERT_TRUE(drawing) << drawing.error().message;
  int strips = 0;
  double before = 0;
  while ((*drawing)->done() < 1 && strips < 10000) {
    const CancelToken stop;
    std::atomic<int> asked{0};
    // Every other strip is interrupted.
    const auto enough = [&] {
      if (++asked < 4) return false;
      if (strips % 2 == 1) stop.cancel();
      return strips % 2 == 0;
    };
    (*drawing)->draw(pool, stop, enough);
    ASSERT_GE((*drawing)->done(), before);
    before = (*drawing)->done();
    ++strips;
  }
  EXPECT_EQ((*drawing)->done(), 1);
  EXPECT_GT(strips, 10);
  const auto whole = at_once(protocol::MethodName::reference, Format::png);
  ASSERT_TRUE(whole) << whole.error().message;
  EXPECT_EQ((*drawing)->encode_png().value(), whole->bytes);
  EXPECT_GT(reserved, 16U * 75 * 40);
}

TEST_F(Drawing, ItsErrorIsTheDifferenceOfTheTwoPictures) {
  view.method.name = protocol::MethodName::kernel;
  const auto drawing = begin();
  ASSERT_TRUE(drawing) << drawing.error().message;
  (*drawing)->draw(pool, {}, [] { return false; });
  Workspace workspace;
  const auto found = (*drawing)->compare(pool, {}, workspace);
  ASSERT_TRUE(found) << found.error().message;
  const auto own = values_of(at_once(protocol::MethodName::kernel, Format::npy).value());
  const auto truth = values_of(at_once(protocol::MethodName::reference, Format::npy).value());
  double squares = 0;
  double most = 0;
  for (std::size_t i = 0; i < own.size(); ++i) {
    squares += std::pow(static_cast<double>(own[i]) - truth[i], 2);
    most = std::max(most, std::abs(static_cast<double>(own[i]) - truth[i]));
  }
  const double rmse = std::sqrt(squares / static_cast<double>(own.size()));
  EXPECT_GT(rmse, 1e-4) << "kernels have an error";
  EXPECT_NEAR(found->rmse, rmse, 1e-6 * rmse);
  EXPECT_NEAR(found->max, most, 1e-6 * most);
  EXPECT_NEAR(found->psnr, 10 * std::log10(1 / (rmse * rmse)), 1e-6);
}

// Lines 128 pixels wide cover at least 256 tiles, except at the edge of the picture.
TEST_F(Drawing, MemoryOfListsIsCountedAndRefusedByPictureSize) {
  view.image.width = 640;
  view.image.height = 480;
  view.vector.r1 = 0.5;
  view.vector.r2 = 1;
  ASSERT_TRUE(begin());
  const std::uint64_t narrow = reserved;
  view.vector.r2 = 64;
  ASSERT_TRUE(begin());
  const std::uint64_t wide = reserved;
  EXPECT_GT(wide, narrow + 4 * 100 * 200) << "at least 100 lines in the middle";
  limit = wide;
  EXPECT_TRUE(begin()) << "this limit suffices";
  limit = wide - 1;
  const auto refused = begin();
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::out_of_memory);
  ASSERT_EQ(refused.error().at.size(), 1U);
  EXPECT_EQ(refused.error().at[0].pointer, "/image");
  const std::string detail = refused.error().at[0].detail;
  EXPECT_NE(detail.find("needs at least " + data::megabytes(wide)), std::string::npos) << detail;
  EXPECT_NE(detail.find(data::megabytes(limit) + " are free"), std::string::npos) << detail;
  EXPECT_NE(detail.find("a smaller picture or a larger stride"), std::string::npos) << detail;
  limit = 0;
  EXPECT_FALSE(begin());
}

TEST_F(Drawing, CancelledDrawingIsNotStarted) {
  ASSERT_TRUE(scene::complete(view, *dataset));
  const std::uint64_t loads = dataset->loads();
  const CancelToken raised;
  raised.cancel();
  const auto unwanted = begin(raised);
  ASSERT_FALSE(unwanted);
  EXPECT_EQ(unwanted.error().kind, ErrorKind::cancelled);
  EXPECT_EQ(reserved, 0U);
  EXPECT_EQ(dataset->loads(), loads);
}

TEST(Difference, OfFourValues) {
  const std::vector<float> picture{0.5F, 0.25F, 0, 1};
  const std::vector<float> truth{0.5F, 0.5F, 0.25F, 0.5F};
  const Difference difference = difference_of(picture, truth);
  EXPECT_DOUBLE_EQ(difference.rmse, std::sqrt((0.0625 + 0.0625 + 0.25) / 4));
  EXPECT_EQ(difference.max, 0.5);
  EXPECT_NEAR(difference.psnr, 10 * std::log10(4 / 0.375), 1e-12);
  EXPECT_EQ(difference_of(truth, truth).rmse, 0);
  EXPECT_EQ(difference_of(truth, truth).psnr, std::numeric_limits<double>::infinity());
  const std::vector<float> hole{0.5F, 0.5F, std::numeric_limits<float>::quiet_NaN(), 0.5F};
  EXPECT_TRUE(std::isnan(difference_of(hole, truth).psnr));
  EXPECT_TRUE(std::isnan(difference_of(hole, truth).max));
}

}  // namespace
}  // namespace windsplat::frame
