// Boxes of fields: which are read without the rest of a step, and their place in memory.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/data/resident/dataset.hpp"

namespace windsplat::data {
namespace {

using testing::HasSubstr;

constexpr std::array<int, 3> large_dims{128, 128, 80};  // 5 MiB
constexpr std::uint64_t large_bytes = 128 * 128 * 80 * sizeof(float);

struct ReadLog {
  int wholes = 0;
  std::vector<Box> boxes;
};

// Sample n of step s of field `f` is n + s / 10, of `whole`, which is not read by boxes, n.
class NumberedGrid final : public Source {
 public:
  NumberedGrid(const std::array<int, 3>& dims, std::shared_ptr<ReadLog> log,
               std::array<int, 3> chunk)
      : log_(std::move(log)) {
    for (std::size_t a = 0; a < 3; ++a) {
      info_.grid.axes.at(a).name = "xyz"[a];
      for (int n = 0; n < dims.at(a); ++n) info_.grid.axes.at(a).coordinates.push_back(n);
    }
    for (const char* name : {"f", "whole"}) {
      FieldInfo field;
      field.name = name;
      field.components = {name};
      field.component_units = {""};
      info_.fields.push_back(field);
    }
    info_.fields[0].box_chunk = chunk;
    info_.steps.resize(3);
    info_.id = "grid";
  }
  [[nodiscard]] const DatasetInfo& info() const override { return info_; }
  Result<Volume> read(std::size_t field, std::size_t step) override {
    ++log_->wholes;
    return values(field, step, whole_box(info_.grid.dims()));
  }
  Result<Volume> read_part(std::size_t field, std::size_t step, const StoredPart& part) override {
    log_->boxes.push_back(part.box);
    return values(field, step, part.box);
  }

 private:
  [[nodiscard]] Volume values(std::size_t field, std::size_t step, const Box& box) const {
    const auto dims = info_.grid.dims();
    Volume out;
    out.dims = box.count;
    std::vector<float> samples;
    for (int k = 0; k < box.count[2]; ++k) {
      for (int j = 0; j < box.count[1]; ++j) {
        const int row = ((box.first[2] + k) * dims[1] + box.first[1] + j) * dims[0] + box.first[0];
        for (int i = 0; i < box.count[0]; ++i) {
          samples.push_back(static_cast<float>(row + i) +
                            (field == 0 ? static_cast<float>(step) / 10 : 0));
        }
      }
    }
    out.values = std::move(samples);
    finish_volume(out);
    return out;
  }
  std::shared_ptr<ReadLog> log_;
  DatasetInfo info_;
};

struct PartFixture {
  explicit PartFixture(std::uint64_t bytes = 4 * large_bytes, std::array<int, 3> dims = large_dims,
                       std::array<int, 3> chunk = {1, 1, 1})
      : dataset(std::make_unique<NumberedGrid>(dims, log, chunk), "grid", bytes) {}
  std::shared_ptr<ReadLog> log = std::make_shared<ReadLog>();
  Dataset dataset;
};

const Box small_box{{5, 6, 7}, {2, 1, 3}};

float value_at_first(const Box& box, std::size_t step) {
  return static_cast<float>((box.first[2] * 128 + box.first[1]) * 128 + box.first[0]) +
         static_cast<float>(step) / 10;
}

TEST(Part, IsReadOnceWithoutTheRest) {
  PartFixture f;
  for (int round = 0; round < 2; ++round) {
    const auto part = f.dataset.part("f", 2, small_box);
    ASSERT_TRUE(part) << part.error().message;
    EXPECT_EQ((*part)->dims, small_box.count);
    EXPECT_EQ((*part)->values[0], value_at_first(small_box, 2));
  }
  EXPECT_EQ(f.log->wholes, 0);
  EXPECT_EQ(f.log->boxes, std::vector<Box>{small_box});
  EXPECT_FALSE(f.dataset.seen("f", 2)) << "its range is not that of the step";
  EXPECT_EQ(f.dataset.resident_only().part("f", 2, small_box).value()->samples(), 6U);
  EXPECT_FALSE(f.dataset.resident_only().part("f", 1, small_box));
  EXPECT_FALSE(f.dataset.resident_only().volume("f", 2));
}

TEST(Part, OfAResidentVolumeIsCopied) {
  PartFixture f;
  const auto whole = f.dataset.volume("f", 1);
  ASSERT_TRUE(whole);
  EXPECT_FALSE(f.dataset.reads_apart("f", 1, {small_box}));
  const auto part = f.dataset.part("f", 1, small_box);
  ASSERT_TRUE(part);
  EXPECT_EQ((*part)->values[0], value_at_first(small_box, 1));
  EXPECT_TRUE(f.log->boxes.empty());
}

TEST(Part, IsReadWhereItCostsAtMostHalfOfTheStep) {
  PartFixture f;
  EXPECT_TRUE(f.dataset.reads_apart("f", 0, {small_box}));
  EXPECT_TRUE(f.dataset.reads_apart("f", 0, {{{0, 0, 0}, {128, 128, 40}}}));
  EXPECT_FALSE(f.dataset.reads_apart("f", 0, {{{0, 0, 0}, {128, 128, 41}}}));
  EXPECT_TRUE(f.dataset.reads_apart("f", 0, {whole_box(large_dims)}, 17)) << "every 17th layer";
  EXPECT_FALSE(f.dataset.reads_apart("f", 0, {whole_box(large_dims)}, 16)) << "below 1 MiB";
  const Box half{{0, 0, 0}, {64, 128, 80}};
  EXPECT_TRUE(f.dataset.reads_apart("f", 0, {half}));
  EXPECT_FALSE(f.dataset.reads_apart("f", 0, {half, half})) << "together";
  EXPECT_FALSE(f.dataset.reads_apart("whole", 0, {small_box}));
  const PartFixture chunked(4 * large_bytes, large_dims, {128, 128, 41});
  EXPECT_FALSE(chunked.dataset.reads_apart("f", 0, {small_box})) << "one chunk is half of the step";
  const PartFixture little(4 * large_bytes, {100, 100, 100});
  EXPECT_FALSE(little.dataset.reads_apart("f", 0, {small_box})) << "below 4 MiB";
}

TEST(Part, OfAFieldBeyondTheMemoryLimitIsReadWhateverItCosts) {
  PartFixture f(large_bytes - 1, large_dims, {128, 128, 80});
  EXPECT_TRUE(f.dataset.reads_apart("f", 0, {small_box}));
  EXPECT_FALSE(f.dataset.volume("f", 0));
  const auto part = f.dataset.part("f", 0, small_box);
  ASSERT_TRUE(part) << part.error().message;
  EXPECT_EQ((*part)->values[0], value_at_first(small_box, 0));
  const auto much = f.dataset.part("f", 0, whole_box(large_dims));
  ASSERT_FALSE(much);
  EXPECT_EQ(much.error().kind, ErrorKind::out_of_memory);
  EXPECT_THAT(much.error().message,
              HasSubstr("a box of 128 x 128 x 80 samples, in chunks of 128 x 128 x 80, cannot be "
                        "read: the field needs 5.0 MiB"));
}

TEST(Part, OnlyFieldsThatAreReadByBoxesAreReadBeyondTheMemoryLimit) {
  const auto log = std::make_shared<ReadLog>();
  const Dataset small(std::make_unique<NumberedGrid>(large_dims, log, std::array{8, 8, 8}), "grid",
                      std::uint64_t{1} << 20);
  EXPECT_TRUE(small.reads_within_limit("f"));
  EXPECT_FALSE(small.reads_within_limit("whole"));
  const Dataset roomy(std::make_unique<NumberedGrid>(large_dims, log, std::array{8, 8, 8}), "grid",
                      2 * large_bytes);
  EXPECT_TRUE(roomy.reads_within_limit("whole"));
}

TEST(Part, IsEvictedBeforeVolumes) {
  PartFixture f(large_bytes + (std::uint64_t{1} << 20));
  ASSERT_TRUE(f.dataset.volume("f", 0));
  for (int n = 0; n < 5; ++n) {  // of 256 KiB each
    ASSERT_TRUE(f.dataset.part("f", 1, {{n, 0, 0}, {64, 64, 16}}));
  }
  EXPECT_TRUE(f.dataset.resident_only().volume("f", 0));
  EXPECT_FALSE(f.dataset.resident_only().part("f", 1, {{0, 0, 0}, {64, 64, 16}}));
  EXPECT_TRUE(f.dataset.resident_only().part("f", 1, {{4, 0, 0}, {64, 64, 16}}));
  EXPECT_LE(f.dataset.resident_bytes(), large_bytes + (std::uint64_t{1} << 20));
}

// The search for room visits every entry.
TEST(Part, OnlyTheLastOnesAreKept) {
  PartFixture f;
  const auto box = [](std::size_t n) {
    return Box{{static_cast<int>(n % 128), static_cast<int>(n / 128), 0}, {1, 1, 1}};
  };
  const auto held = f.dataset.part("f", 0, box(0));
  for (std::size_t n = 1; n < parts_kept_max + 10; ++n) {
    ASSERT_TRUE(f.dataset.part("f", 0, box(n)));
  }
  std::size_t kept = 0;
  for (std::size_t n = 0; n < parts_kept_max + 10; ++n) {
    kept += f.dataset.resident_only().part("f", 0, box(n)) ? 1U : 0U;
  }
  EXPECT_EQ(kept, parts_kept_max + 1) << "one is in use";
  EXPECT_FALSE(f.dataset.resident_only().part("f", 0, box(9)));
  EXPECT_TRUE(f.dataset.resident_only().part("f", 0, box(10)));
}

TEST(Part, VolumeIsReadOnceBoxesWouldCostMoreThanHalfOfIt) {
  PartFixture f(4 * large_bytes, large_dims, {64, 64, 40});  // eight chunks
  const auto box = [](int n) {
    return Box{{64 * (n % 2), 64 * (n / 2 % 2), 40 * (n / 4)}, {1, 1, 1}};
  };
  for (int n = 0; n < 4; ++n) {
    EXPECT_TRUE(f.dataset.reads_apart("f", 1, {box(n)})) << n;
    ASSERT_TRUE(f.dataset.part("f", 1, box(n)));
  }
  EXPECT_FALSE(f.dataset.reads_apart("f", 1, {box(4)}));
  EXPECT_TRUE(f.dataset.reads_apart("f", 0, {box(4)})) << "of another step";
  EXPECT_FALSE(f.dataset.minus(f.dataset, 1).value().reads_apart("f", 0, {box(4)}));
  ASSERT_TRUE(f.dataset.volume("f", 1));
  f.dataset.evict();
  EXPECT_TRUE(f.dataset.reads_apart("f", 1, {box(4)})) << "after it was read";
}

TEST(Part, BeyondTheGridOrOfAFieldThatIsReadAsAWholeIsRefused) {
  PartFixture f;
  const auto beyond = f.dataset.part("f", 0, {{127, 0, 0}, {2, 1, 1}});
  ASSERT_FALSE(beyond);
  EXPECT_EQ(beyond.error().kind, ErrorKind::invalid);
  EXPECT_EQ(beyond.error().message, "the box 127,0,0,2,1,1 of 'f' cannot be read");
  EXPECT_EQ(f.dataset.part("whole", 0, small_box).error().kind, ErrorKind::invalid);
  EXPECT_EQ(f.dataset.part("f", 3, small_box).error().kind, ErrorKind::not_found);
  EXPECT_EQ(f.dataset.part("g", 0, small_box).error().kind, ErrorKind::not_found);
  EXPECT_TRUE(f.log->boxes.empty());
}

TEST(Part, OfADifferenceIsReadFromBoxesOfBoth) {
  PartFixture f;
  Dataset difference = f.dataset.minus(f.dataset, 0).value();
  EXPECT_TRUE(difference.reads_apart("f", 2, {small_box}));
  const auto part = difference.part("f", 2, small_box);
  ASSERT_TRUE(part) << part.error().message;
  EXPECT_EQ((*part)->values[0], value_at_first(small_box, 2) - value_at_first(small_box, 0));
  EXPECT_EQ(f.log->wholes, 0);
  EXPECT_EQ(f.log->boxes, (std::vector<Box>{small_box, small_box}));
  EXPECT_TRUE(difference.resident_only().part("f", 2, small_box));
  EXPECT_FALSE(difference.reads_apart("whole", 2, {small_box}));
}

}  // namespace
}  // namespace windsplat::data
