// Levels that a source has stored: read in place of volumes from which they would be computed.
#include "server/data/model/stored.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/data/resident/dataset.hpp"

namespace windsplat::data {
namespace {

using testing::HasSubstr;

constexpr std::array<int, 3> dims{40, 24, 16};
constexpr std::uint64_t scalar_bytes = 40 * 24 * 16 * sizeof(float);

struct PartLog {
  int wholes = 0;
  std::vector<StoredPart> parts;
  std::function<Result<void>()> before_part = [] { return Result<void>(); };
};

enum class With { levels, samples_alone };

// A scalar `f` and a vector `v`, whose levels are those of coarsen().
class SourceWithLevels final : public Source {
 public:
  explicit SourceWithLevels(std::shared_ptr<PartLog> log, With with = With::levels)
      : log_(std::move(log)) {
    for (std::size_t a = 0; a < 3; ++a) {
      info_.grid.axes.at(a).name = "xyz"[a];
      for (int n = 0; n < dims.at(a); ++n) info_.grid.axes.at(a).coordinates.push_back(n);
    }
    info_.fields.resize(2);
    info_.fields[0].name = "f";
    info_.fields[0].components = {"f"};
    info_.fields[1].name = "v";
    info_.fields[1].kind = FieldKind::vector;
    info_.fields[1].components = {"a", "b"};
    for (FieldInfo& field : info_.fields) field.box_chunk = {16, 8, 16};
    info_.steps.resize(2);
    info_.id = "grid";
    if (with == With::samples_alone) return;
    StoredLevels stored;
    stored.levels = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}};
    stored.fields.resize(2);
    for (std::size_t f = 0; f < 2; ++f) {
      stored.fields[f].has_levels = true;
      for (std::size_t step = 0; step < 2; ++step) {
        const Volume volume = made(f, step);
        stored.fields[f].ranges.push_back({volume.range, volume.masked});
      }
    }
    stored.fields[1].strided = 2;
    info_.stored = std::make_shared<const StoredLevels>(std::move(stored));
  }
  [[nodiscard]] const DatasetInfo& info() const override { return info_; }
  Result<Volume> read(std::size_t field, std::size_t step) override {
    ++log_->wholes;
    return made(field, step);
  }
  Result<Volume> read_part(std::size_t field, std::size_t step, const StoredPart& part) override {
    if (auto fine = check_part(field, part); !fine) return fine.error();
    log_->parts.push_back(part);
    if (auto done = log_->before_part(); !done) return done.error();
    if (part.level == 0) return cut(made(field, step), part.box);
    Coarsening how;
    how.halvings.fill(static_cast<int>(part.level));
    for (std::size_t a = 0; a < 3; ++a) {
      how.widths.at(a).assign(static_cast<std::size_t>(dims.at(a)), 1.0);
    }
    if (part.as != StoredAs::two_values) how.reduction = Reduction::drawn;
    if (part.as == StoredAs::strided) how.stride = 1 << part.level;
    Volume level = coarsen(made(field, step), how);
    return part.box == whole_box(level.dims) ? std::move(level) : cut(level, part.box);
  }

  static Volume made(std::size_t field, std::size_t step) {
    Volume out;
    out.dims = dims;
    out.components = field == 0 ? 1 : 2;
    std::vector<float> values;
    for (std::size_t n = 0; n < out.samples() * (field + 1); ++n) {
      values.push_back(static_cast<float>(std::sin(static_cast<double>(n * (step + 2)) * 0.1)));
    }
    out.values = std::move(values);
    finish_volume(out);
    return out;
  }

 private:
  std::shared_ptr<PartLog> log_;
  DatasetInfo info_;
};

Coarsening halved_by(int h, Reduction reduction, int stride = 1) {
  Coarsening how;
  how.halvings = {h, h, h};
  for (std::size_t a = 0; a < 3; ++a) {
    how.widths.at(a).assign(static_cast<std::size_t>(dims.at(a)), 0.25);
  }
  how.reduction = reduction;
  how.stride = stride;
  return how;
}

struct StoredFixture {
  explicit StoredFixture(std::uint64_t bytes = 100 * scalar_bytes, With with = With::levels)
      : budget(std::make_shared<Budget>(bytes)),
        dataset(std::make_unique<SourceWithLevels>(log, with), "grid", budget) {}
  // Bricks had, bricks read, bytes read.
  [[nodiscard]] std::array<std::uint64_t, 3> bricks() const {
    const BrickCounts counts = budget->counts().bricks;
    return {counts.resident, counts.read, counts.bytes_read};
  }
  std::shared_ptr<PartLog> log = std::make_shared<PartLog>();
  std::shared_ptr<Budget> budget;
  Dataset dataset;
};

void expect_equal(const Volume& found, const Volume& wanted) {
  EXPECT_EQ(found.dims, wanted.dims);
  EXPECT_EQ(found.range, wanted.range);
  EXPECT_EQ(found.masked, wanted.masked);
  ASSERT_EQ(found.values.size(), wanted.values.size());
  for (std::size_t n = 0; n < wanted.values.size(); ++n) {
    const bool both_masked = std::isnan(found.values[n]) && std::isnan(wanted.values[n]);
    ASSERT_TRUE(both_masked || found.values[n] == wanted.values[n]) << n;
  }
}

TEST(Stored, LevelsAreReadOnceWithoutTheVolume) {
  StoredFixture f;
  for (const auto& [field, reduction] :
       {std::pair{0, Reduction::two_values}, std::pair{1, Reduction::drawn}}) {
    const std::string name = field == 0 ? "f" : "v";
    for (int round = 0; round < 2; ++round) {
      const auto level = f.dataset.level(name, 1, halved_by(2, reduction));
      ASSERT_TRUE(level) << level.error().message;
      expect_equal(**level, coarsen(SourceWithLevels::made(static_cast<std::size_t>(field), 1),
                                    halved_by(2, reduction)));
    }
  }
  EXPECT_EQ(f.log->wholes, 0);
  EXPECT_EQ(f.log->parts.size(), 2U);
  EXPECT_EQ(f.dataset.levels(), 0U) << "none is computed";
  const auto there = f.dataset.resident_only().level("v", 1, halved_by(2, Reduction::drawn));
  EXPECT_TRUE(there);
}

TEST(Stored, LevelsThatAreNotStoredAreComputed) {
  StoredFixture f;
  Coarsening other = halved_by(1, Reduction::two_values);
  other.widths[2][3] = 0.5;
  Coarsening flat = halved_by(1, Reduction::two_values);
  flat.halvings = {1, 1, 0};
  for (const Coarsening& how :
       {other, flat, halved_by(3, Reduction::two_values), halved_by(1, Reduction::drawn)}) {
    EXPECT_FALSE(f.dataset.stored_reduction("f", how));
    EXPECT_EQ(f.dataset.bytes_beside_level("f", how), scalar_bytes);
    const auto level = f.dataset.level("f", 0, how);
    ASSERT_TRUE(level) << level.error().message;
    expect_equal(**level, coarsen(SourceWithLevels::made(0, 0), how));
  }
  EXPECT_TRUE(f.log->parts.empty());
  EXPECT_EQ(f.log->wholes, 1);
  const auto difference = f.dataset.minus(f.dataset, 1);
  ASSERT_TRUE(difference);
  EXPECT_FALSE(difference->stored_reduction("f", halved_by(1, Reduction::two_values)))
      << "of a difference";
}

TEST(Stored, StridedDrawsAreMadeFromMiddlesOfKernels) {
  StoredFixture f;
  for (const int stride : {2, 4}) {
    for (const int h : {1, 2, 3}) {
      const Coarsening how = halved_by(h, Reduction::drawn, stride);
      const bool kernels = 1 << h == stride;  // the middles themselves
      EXPECT_EQ(f.dataset.bytes_beside_level("v", how),
                kernels ? 0 : 2 * scalar_bytes / static_cast<unsigned>(stride * stride * stride));
      const auto level = f.dataset.level("v", 0, how);
      ASSERT_TRUE(level) << level.error().message;
      expect_equal(**level, coarsen(SourceWithLevels::made(1, 0), how));
    }
  }
  EXPECT_EQ(f.log->wholes, 0);
  EXPECT_EQ(f.log->parts.size(), 2U);
  EXPECT_FALSE(f.dataset.stored_reduction("v", halved_by(1, Reduction::drawn, 3)));
  EXPECT_FALSE(f.dataset.stored_reduction("v", halved_by(1, Reduction::drawn, 8)));
}

TEST(Stored, RangesAreKnownBeforeAnythingIsRead) {
  StoredFixture f;
  const auto seen = f.dataset.seen("f", 1);
  ASSERT_TRUE(seen);
  EXPECT_EQ(seen->range, SourceWithLevels::made(0, 1).range);
  EXPECT_FALSE(f.dataset.seen("f", 2));
  EXPECT_EQ(f.log->wholes, 0);
}

// A box of a level as a scene asks for it.
Derivation part_of(const StoredPart& part, std::uint64_t values) {
  Derivation how;
  how.variant = part_variant + (part.level > 0 ? level_variant(part.level) : "") +
                std::to_string(static_cast<int>(part.as)) + ' ' + key_of(part.box);
  how.bytes = part.box.samples() * values * sizeof(float);
  how.stored = part;
  return how;
}

TEST(Stored, MiddlesOfAResidentVolumeAreNotRead) {
  StoredFixture f;
  ASSERT_TRUE(f.dataset.volume("v", 0));
  const Volume all = SourceWithLevels::made(1, 0);
  for (const int h : {1, 2}) {
    const Coarsening how = halved_by(h, Reduction::drawn, 1 << h);
    const auto level = f.dataset.level("v", 0, how);
    ASSERT_TRUE(level) << level.error().message;
    expect_equal(**level, coarsen(all, how));
    const StoredPart box{{{3, 2, 1}, {6, 4, 3}}, static_cast<std::size_t>(h), StoredAs::strided};
    const auto part = f.dataset.derived("v", 0, part_of(box, 2));
    ASSERT_TRUE(part) << part.error().message;
    expect_equal(**part, cut(coarsen(all, how), box.box));
  }
  EXPECT_EQ(f.log->wholes, 1);
  EXPECT_TRUE(f.log->parts.empty());
  EXPECT_TRUE(f.dataset.level("v", 1, halved_by(1, Reduction::drawn, 2)));
  EXPECT_EQ(f.log->parts.size(), 1U) << "of a step that is not resident";
}

TEST(Stored, MiddlesOfAPackedVolumeAreRead) {
  const auto log = std::make_shared<PartLog>();
  Dataset dataset(std::make_unique<SourceWithLevels>(log), "grid",
                  std::make_shared<Budget>(100 * scalar_bytes), Storage::packed16);
  ASSERT_TRUE(dataset.volume("v", 0));
  const Coarsening how = halved_by(1, Reduction::drawn, 2);
  const auto level = dataset.level("v", 0, how);
  ASSERT_TRUE(level) << level.error().message;
  expect_equal(**level, coarsen(SourceWithLevels::made(1, 0), how));
  EXPECT_EQ(log->parts.size(), 1U);
}

TEST(Stored, ResidentBytesAreThoseOfEachLevel) {
  using Bytes = std::vector<std::uint64_t>;
  StoredFixture f;
  EXPECT_EQ(f.dataset.resident_bytes_of_levels(), (Bytes{0, 0, 0}));
  ASSERT_TRUE(f.dataset.volume("f", 0));
  Bytes wanted{40 * 24 * 16 * 4, 0, 0};
  EXPECT_EQ(f.dataset.resident_bytes_of_levels(), wanted);
  ASSERT_TRUE(f.dataset.part("f", 1, {{8, 0, 0}, {16, 8, 4}}));
  wanted[0] += 16 * 8 * 4 * 4;
  ASSERT_TRUE(f.dataset.level("f", 1, halved_by(2, Reduction::two_values)));
  wanted[2] += 10 * 6 * 4 * 4 * 4;
  ASSERT_TRUE(f.dataset.level("v", 0, halved_by(1, Reduction::drawn)));
  wanted[1] += 20 * 12 * 8 * 2 * 4;
  ASSERT_TRUE(f.dataset.level("v", 0, halved_by(2, Reduction::drawn, 2)));
  wanted[1] += 20 * 12 * 8 * 2 * 4;  // middles of kernels
  wanted[2] += 10 * 6 * 4 * 2 * 4;   // their draws
  const StoredPart box{{{4, 2, 0}, {8, 8, 8}}, 1, StoredAs::drawn};
  ASSERT_TRUE(f.dataset.derived("v", 0, part_of(box, 2)));
  wanted[1] += 8 * 8 * 8 * 2 * 4;
  EXPECT_EQ(f.dataset.resident_bytes_of_levels(), wanted);
  EXPECT_EQ(f.dataset.resident_bytes(), wanted[0] + wanted[1] + wanted[2]);
  EXPECT_EQ(f.budget->counts().part_bytes, 16U * 8 * 4 * 4 + 8U * 8 * 8 * 2 * 4);

  const auto difference = f.dataset.minus(f.dataset, 1);
  ASSERT_TRUE(difference);
  ASSERT_TRUE(Dataset(*difference).volume("f", 0));
  wanted[0] += 40 * 24 * 16 * 4;  // step 1, but not the difference
  EXPECT_EQ(f.dataset.resident_bytes_of_levels(), wanted);
  EXPECT_EQ(f.dataset.resident_bytes(), wanted[0] + wanted[1] + wanted[2] + scalar_bytes);
  f.dataset.evict();
  EXPECT_EQ(f.dataset.resident_bytes_of_levels(), (Bytes{0, 0, 0}));
  EXPECT_EQ(f.budget->counts().part_bytes, 0U);
}

// Chunks are 16 x 8 x 16 samples.
TEST(Stored, BricksAreCountedByWhetherTheyAreInMemory) {
  using Counts = std::array<std::uint64_t, 3>;
  StoredFixture f;
  const auto level = [&](const std::string& field, int h, Reduction how, int stride = 1) {
    return f.dataset.level(field, 0, halved_by(h, how, stride)).has_value();
  };
  ASSERT_TRUE(level("f", 1, Reduction::two_values));  // 20 x 12 x 8 samples
  Counts wanted{0, 4, 20 * 12 * 8 * 4 * 4};
  EXPECT_EQ(f.bricks(), wanted);
  ASSERT_TRUE(level("f", 1, Reduction::two_values));
  wanted[0] += 4;
  EXPECT_EQ(f.bricks(), wanted);
  ASSERT_TRUE(level("v", 2, Reduction::drawn, 2));  // from the middles at level 1
  wanted[1] += 4;
  wanted[2] += 20 * 12 * 8 * 2 * 4;
  EXPECT_EQ(f.bricks(), wanted);

  const Box box{{10, 0, 0}, {10, 9, 16}};
  EXPECT_FALSE(f.dataset.resident_only().part("f", 0, box));
  EXPECT_EQ(f.bricks(), wanted) << "nothing was had or read";
  ASSERT_TRUE(f.dataset.part("f", 0, box));
  wanted[1] += 4;
  wanted[2] += 10 * 9 * 16 * 4;
  EXPECT_EQ(f.bricks(), wanted);
  ASSERT_TRUE(f.dataset.part("f", 0, box));
  ASSERT_TRUE(f.dataset.resident_only().part("f", 0, box));
  wanted[0] += 8;
  EXPECT_EQ(f.bricks(), wanted);
  const StoredPart of_level{{{0, 7, 0}, {1, 2, 1}}, 1, StoredAs::drawn};
  ASSERT_TRUE(f.dataset.derived("v", 0, part_of(of_level, 2)));
  ASSERT_TRUE(f.dataset.resident_only().derived("v", 0, part_of(of_level, 2)));
  wanted = {wanted[0] + 2, wanted[1] + 2, wanted[2] + 2 * 2 * 4};
  EXPECT_EQ(f.bricks(), wanted);

  ASSERT_TRUE(f.dataset.volume("v", 0));  // 3 x 3 x 1 chunks
  wanted[1] += 9;
  wanted[2] += 2 * scalar_bytes;
  EXPECT_EQ(f.bricks(), wanted);
  ASSERT_TRUE(f.dataset.volume("v", 0));
  ASSERT_TRUE(f.dataset.resident_only().volume("v", 0));
  ASSERT_TRUE(f.dataset.part("v", 0, {{0, 0, 0}, {1, 1, 1}})) << "a cut of the volume";
  wanted[0] += 19;
  EXPECT_EQ(f.bricks(), wanted);
}

TEST(Stored, BricksWaitWhileTheyAreRead) {
  StoredFixture f;
  std::uint64_t waiting = 0;
  f.log->before_part = [&] {
    waiting = f.budget->counts().bricks.waiting;
    return Result<void>();
  };
  const Box box{{10, 0, 0}, {10, 9, 16}};
  ASSERT_TRUE(f.dataset.part("f", 0, box));
  EXPECT_EQ(waiting, 4U);
  EXPECT_EQ(f.budget->counts().bricks.waiting, 0U);
  f.log->before_part = [] { return make_error(ErrorKind::bad_data, "torn"); };
  EXPECT_FALSE(f.dataset.part("f", 1, box));
  EXPECT_EQ(f.budget->counts().bricks.waiting, 0U);
  EXPECT_EQ(f.budget->counts().bricks.read, 4U) << "failed reads are not counted";
}

TEST(Stored, DataWithoutLevelsHaveNoBricks) {
  StoredFixture f(100 * scalar_bytes, With::samples_alone);
  ASSERT_TRUE(f.dataset.part("f", 0, {{0, 0, 0}, {2, 2, 2}}));
  for (int round = 0; round < 2; ++round) ASSERT_TRUE(f.dataset.volume("f", 0));
  ASSERT_TRUE(f.dataset.level("f", 0, halved_by(1, Reduction::two_values)));
  EXPECT_EQ(f.bricks(), (std::array<std::uint64_t, 3>{}));
  EXPECT_TRUE(f.dataset.resident_bytes_of_levels().empty());
  EXPECT_EQ(f.budget->counts().part_bytes, 2 * 2 * 2 * 4U);
}

TEST(Stored, AFieldThatDoesNotFitNeedsItsCoarsestLevel) {
  StoredFixture f(scalar_bytes / 2);
  EXPECT_FALSE(f.dataset.fits_in_full({"f"}));
  EXPECT_EQ(f.dataset.least_bytes("f"), scalar_bytes / 16);
  EXPECT_EQ(f.dataset.least_bytes("v"), scalar_bytes / 32);
  EXPECT_TRUE(f.dataset.check_room({"f", "v"}));
  const auto level = f.dataset.level("f", 0, halved_by(2, Reduction::two_values));
  ASSERT_TRUE(level) << level.error().message;
  const auto refused = f.dataset.volume("f", 0);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::out_of_memory);
  StoredFixture tiny(scalar_bytes / 33);
  const auto room = tiny.dataset.check_room({"f"});
  ASSERT_FALSE(room);
  EXPECT_THAT(room.error().message, HasSubstr("'f' needs"));
}

}  // namespace
}  // namespace windsplat::data
