// The reference rendered in pieces: the same picture, with memory requested in advance.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "server/engine/reference/kernels.hpp"
#include "server/engine/reference/reference.hpp"
#include "server/engine/reference/screen_grid.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

namespace reference = engine::reference;

// From the last piece to the first, by alternating workers, with one piece interrupted and
// repeated.
TEST(ReferencePainting, RenderingInPiecesEqualsTheWholePicture) {
  const scene::Scene scene = cloudy_scene(8, 33);
  ThreadPool pool(1);
  const auto at_once = reference::render(scene, pool, {});
  ASSERT_TRUE(at_once);
  const reference::Picture& whole = *at_once;
  constexpr unsigned workers = 3;
  const CancelToken cancel;
  const auto begun = reference::Painting::begin(scene, workers, cancel);
  ASSERT_TRUE(begun);
  reference::Painting& painting = **begun;
  std::vector<double> rgba(whole.rgba.size(), -1);
  const auto draw = [&](int row, int x0, unsigned worker, const CancelToken& stop) {
    const auto at = 4 * (static_cast<std::size_t>(row) * whole.width + x0);
    return painting.draw(row, x0, std::min(x0 + 5, whole.width), worker, stop, rgba.data() + at);
  };
  const CancelToken raised;
  raised.cancel();
  EXPECT_FALSE(draw(0, 0, 0, raised));
  unsigned turn = 0;
  for (int row = whole.height - 1; row >= 0; --row) {
    for (int x0 = 0; x0 < whole.width; x0 += 5)
      EXPECT_TRUE(draw(row, x0, ++turn % workers, cancel));
  }
  EXPECT_EQ(rgba, whole.rgba);
  EXPECT_EQ(painting.pieces(), whole.pieces);
  EXPECT_EQ(painting.evaluations(), whole.evaluations);
}

TEST(ReferencePainting, RequestsMemoryBeforeUseAndStopsWhenCancelled) {
  const scene::Scene scene = cloudy_scene(8, 33);
  std::vector<std::uint64_t> asked;
  // The error, if any, when the n-th memory request is refused or cancelled.
  const auto error_at = [&](std::size_t n, bool refuses, const CancelToken& cancel) {
    asked.clear();
    const auto begun = reference::Painting::begin(
        scene, 2, cancel, {}, [&](std::uint64_t bytes) -> Result<std::shared_ptr<const void>> {
          asked.push_back(bytes);
          if (asked.size() == n && refuses) return make_error(ErrorKind::out_of_memory, "no room");
          if (asked.size() == n) cancel.cancel();
          return std::shared_ptr<const void>(std::make_shared<int>());
        });
    return begun ? std::optional<ErrorKind>() : begun.error().kind;
  };
  EXPECT_EQ(error_at(0, false, {}), std::nullopt);
  ASSERT_EQ(asked.size(), 2U) << "for the kernels, and for the lists of tiles that they cover";
  const auto kernels = reference::list_kernels(scene, reference::make_view(scene.camera));
  ASSERT_GT(kernels.splats.size(), 0U);
  EXPECT_GE(asked[0], kernels.splats.size() * sizeof(reference::Splat) +
                          kernels.ribbons.size() * sizeof(reference::Ribbon));
  for (const std::size_t n : {1U, 2U}) {
    EXPECT_EQ(error_at(n, true, {}), ErrorKind::out_of_memory);
    EXPECT_EQ(asked.size(), n) << "no request after a refusal";
    EXPECT_EQ(error_at(n, false, {}), ErrorKind::cancelled);
    EXPECT_EQ(asked.size(), n);
  }
  const CancelToken raised;
  raised.cancel();
  EXPECT_EQ(error_at(0, false, raised), ErrorKind::cancelled);
  EXPECT_TRUE(asked.empty()) << "cancelled before";
}

TEST(ReferenceGrid, ListsCountedKernelsByTileAndStopsWhenCancelled) {
  // 20 x 12 pixels: 3 x 2 tiles of 8. Boxes: the whole picture, one tile, none, the middle column.
  const std::vector<reference::ScreenBox> boxes{
      {0, 20, 0, 12}, {2, 5, 9, 11}, {30, 40, 0, 12}, {9, 15, 2, 11}};
  reference::ScreenGrid grid(20, 12);
  const CancelToken cancel;
  std::size_t seen = 0;
  const auto box_of = [&](std::size_t id) {
    ++seen;
    return boxes[id];
  };
  ASSERT_TRUE(grid.count(boxes.size(), box_of, cancel));
  EXPECT_EQ(grid.bytes(), 4U * (6 + 1 + 0 + 2));
  EXPECT_EQ(grid.longest(), 2U);
  ASSERT_TRUE(grid.fill(boxes.size(), box_of, cancel));
  const auto at = [&](int x, int y) {
    const auto ids = grid.at(x, y);
    return std::vector<std::uint32_t>(ids.begin(), ids.end());
  };
  using Ids = std::vector<std::uint32_t>;
  EXPECT_EQ(at(7, 7), Ids({0}));
  EXPECT_EQ(at(8, 7), Ids({0, 3}));
  EXPECT_EQ(at(19, 0), Ids({0}));
  EXPECT_EQ(at(0, 8), Ids({0, 1}));
  EXPECT_EQ(at(15, 11), Ids({0, 3}));
  EXPECT_EQ(at(16, 11), Ids({0}));

  const auto cancelling = [&](std::size_t id) {
    if (++seen == 2) cancel.cancel();
    return boxes[id];
  };
  seen = 0;
  EXPECT_FALSE(grid.fill(boxes.size(), cancelling, cancel));
  EXPECT_EQ(seen, 2U);
  const CancelToken again;
  seen = 0;
  EXPECT_FALSE(grid.count(
      boxes.size(),
      [&](std::size_t id) {
        if (++seen == 2) again.cancel();
        return boxes[id];
      },
      again));
  EXPECT_EQ(seen, 2U);
}

}  // namespace
}  // namespace windsplat::test
