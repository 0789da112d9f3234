// Volumes of boxes of a grid: what of them is read, and what is copied from those in memory.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/data/model/box_grid.hpp"
#include "server/data/resident/dataset.hpp"
#include "tests/numerics/stored/stored_fields.hpp"

namespace windsplat::data {
namespace {

constexpr std::array<int, 3> cube_dims{40, 40, 40};
constexpr std::array<int, 3> box_size{16, 16, 16};

struct ReadParts {
  std::vector<StoredPart> parts;
  std::function<Result<void>()> before;  // each read
};

// Records what is read of the fields in memory.
class CountedReads final : public Source {
 public:
  CountedReads(std::unique_ptr<Source> of, std::shared_ptr<ReadParts> log)
      : of_(std::move(of)), log_(std::move(log)) {}
  [[nodiscard]] const DatasetInfo& info() const override { return of_->info(); }
  Result<Volume> read(std::size_t field, std::size_t step) override {
    return of_->read(field, step);
  }
  Result<Volume> read_part(std::size_t field, std::size_t step, const StoredPart& part) override {
    log_->parts.push_back(part);
    if (log_->before) {
      if (auto may = log_->before(); !may) return may.error();
    }
    return of_->read_part(field, step, part);
  }

 private:
  std::unique_ptr<Source> of_;
  std::shared_ptr<ReadParts> log_;
};

// A cloud whose samples are their numbers.
struct Cube {
  explicit Cube(std::uint64_t bytes = std::uint64_t{16} << 20)
      : dataset(std::make_unique<CountedReads>(source(), log), "cube", bytes) {}

  static std::unique_ptr<Source> source() {
    DatasetInfo info;
    for (std::size_t a = 0; a < 3; ++a) {
      info.grid.axes.at(a).name = "xyz"[a];
      for (int n = 0; n < cube_dims.at(a); ++n) info.grid.axes.at(a).coordinates.push_back(n);
    }
    info.fields.resize(1);
    info.fields[0].name = "cloud";
    info.fields[0].components = {"cloud"};
    info.steps.resize(1);
    auto cloud = std::make_shared<Volume>();
    cloud->dims = cube_dims;
    std::vector<float> values;
    for (std::size_t n = 0; n < cloud->samples(); ++n) values.push_back(static_cast<float>(n));
    cloud->values = std::move(values);
    finish_volume(*cloud);
    return windsplat::test::stored_fields(std::move(info), {std::move(cloud)}, 2);
  }

  std::shared_ptr<ReadParts> log = std::make_shared<ReadParts>();
  Dataset dataset;
};

Derivation samples_in(const Box& box) {
  Derivation out;
  out.variant = part_variant + key_of(box);
  out.bytes = box.samples() * sizeof(float);
  out.stored = StoredPart{box};
  return out;
}

Derivation samples_in(const BoxGrid& grid) {
  Derivation out;
  out.variant = part_variant + key_of(grid);
  out.bytes = samples_of(grid) * sizeof(float);
  out.gathered = std::make_shared<const GatheredBoxes>(
      GatheredBoxes{grid, [grid](std::size_t n) { return samples_in(grid.boxes()[n]); }});
  return out;
}

BoxGrid grid_at(const std::vector<std::array<int, 3>>& firsts) {
  std::vector<Box> boxes;
  for (const auto& first : firsts) boxes.push_back({first, box_size});
  return grid_of(boxes, box_size, cube_dims);
}

void expect_samples(const Volume& volume, const BoxGrid& grid) {
  ASSERT_EQ(volume.dims, dims_of(grid));
  std::int64_t held = 0;
  std::array<int, 3> at{};
  for (at[2] = 0; at[2] < cube_dims[2]; ++at[2]) {
    for (at[1] = 0; at[1] < cube_dims[1]; ++at[1]) {
      for (at[0] = 0; at[0] < cube_dims[0]; ++at[0]) {
        bool within = true;
        for (std::size_t a = 0; a < 3; ++a) {
          const int beyond = at.at(a) - grid.bounds.first.at(a);
          within = within && beyond >= 0 && beyond < grid.bounds.count.at(a);
        }
        if (!within) continue;
        const float found = volume.values[grid.number_of(at)];
        if (grid.places[grid.index_of(at)] == 0) {
          EXPECT_TRUE(std::isnan(found));
          continue;
        }
        ++held;
        EXPECT_EQ(found, static_cast<float>((at[2] * 40 + at[1]) * 40 + at[0]));
      }
    }
  }
  EXPECT_EQ(volume.masked, static_cast<std::int64_t>(volume.samples()) - held);
}

TEST(GatheredVolume, ReadsItsBoxesAloneAndIsKept) {
  Cube cube;
  const BoxGrid grid = grid_at({{0, 0, 0}, {16, 16, 0}, {32, 32, 32}});
  const auto volume = cube.dataset.derived("cloud", 0, samples_in(grid));
  ASSERT_TRUE(volume) << volume.error().message;
  expect_samples(**volume, grid);
  EXPECT_EQ((*volume)->range, (std::array{0.0F, 63999.0F}));
  EXPECT_EQ(cube.log->parts.size(), 3U);
  EXPECT_EQ(cube.dataset.resident_bytes(), (*volume)->bytes());
  EXPECT_EQ(cube.dataset.resident_only().derived("cloud", 0, samples_in(grid)).value(), *volume);
  EXPECT_EQ(cube.dataset.derived("cloud", 0, samples_in(grid)).value(), *volume);
  EXPECT_EQ(cube.log->parts.size(), 3U);
}

TEST(GatheredVolume, CopiesWhatOtherPartsHold) {
  Cube cube;
  const BoxGrid before = grid_at({{0, 0, 0}, {16, 0, 0}});
  ASSERT_TRUE(cube.dataset.derived("cloud", 0, samples_in(before)));
  ASSERT_TRUE(cube.dataset.derived("cloud", 0, samples_in(Box{{0, 16, 0}, {40, 16, 20}})));
  cube.log->parts.clear();
  // One of the boxes, one within the large one, one that it holds in part, and one of neither.
  const BoxGrid after = grid_at({{16, 0, 0}, {32, 16, 0}, {0, 16, 16}, {32, 32, 32}});
  const auto volume = cube.dataset.derived("cloud", 0, samples_in(after));
  ASSERT_TRUE(volume) << volume.error().message;
  expect_samples(**volume, after);
  ASSERT_EQ(cube.log->parts.size(), 2U);
  EXPECT_EQ(cube.log->parts[0].box, (Box{{0, 16, 16}, box_size}));
  EXPECT_EQ(cube.log->parts[1].box, (Box{{32, 32, 32}, {8, 8, 8}}));
}

TEST(GatheredVolume, IsRefusedBeyondTheLimit) {
  const BoxGrid grid = grid_at({{0, 0, 0}, {16, 16, 0}});
  Cube cube(samples_of(grid) * sizeof(float) - 1);
  const auto volume = cube.dataset.derived("cloud", 0, samples_in(grid));
  ASSERT_FALSE(volume);
  EXPECT_EQ(volume.error().kind, ErrorKind::out_of_memory);
  EXPECT_TRUE(cube.log->parts.empty());
}

TEST(GatheredVolume, ACancelledOneReadsNoMore) {
  Cube cube;
  CancelToken cancel;
  cancel.cancel();
  const auto volume = cube.dataset.cancelled_by(cancel).derived(
      "cloud", 0, samples_in(grid_at({{0, 0, 0}, {16, 16, 0}})));
  ASSERT_FALSE(volume);
  EXPECT_EQ(volume.error().kind, ErrorKind::cancelled);
  EXPECT_TRUE(cube.log->parts.empty());
  EXPECT_EQ(cube.dataset.resident_bytes(), 0U);
}

TEST(GatheredVolume, OfAnotherWhoWasCancelledIsGatheredAgain) {
  Cube cube;
  const Derivation both = samples_in(grid_at({{0, 0, 0}, {16, 16, 0}}));
  CancelToken cancel;
  std::promise<void> reads, may_go_on;
  bool is_first = true;
  cube.log->before = [&]() -> Result<void> {
    if (!std::exchange(is_first, false)) return {};
    reads.set_value();
    may_go_on.get_future().wait();
    return {};
  };
  auto cancelled = std::async(std::launch::async, [&] {
    return cube.dataset.cancelled_by(cancel).derived("cloud", 0, both);
  });
  reads.get_future().wait();
  auto waiting =
      std::async(std::launch::async, [&] { return cube.dataset.derived("cloud", 0, both); });
  EXPECT_NE(waiting.wait_for(std::chrono::milliseconds(50)), std::future_status::ready);
  cancel.cancel();
  may_go_on.set_value();
  EXPECT_EQ(cancelled.get().error().kind, ErrorKind::cancelled);
  const auto volume = waiting.get();
  EXPECT_TRUE(volume) << volume.error().message;
}

TEST(GatheredVolume, AReadThatFailsLeavesNothing) {
  Cube cube;
  int reads = 0;
  cube.log->before = [&]() -> Result<void> {
    if (++reads < 2) return {};
    return make_error(ErrorKind::bad_data, "broken");
  };
  const auto volume =
      cube.dataset.derived("cloud", 0, samples_in(grid_at({{0, 0, 0}, {16, 16, 0}})));
  ASSERT_FALSE(volume);
  EXPECT_EQ(volume.error().message, "broken");
  EXPECT_EQ(cube.dataset.resident_bytes(), 0U);
}

}  // namespace
}  // namespace windsplat::data
