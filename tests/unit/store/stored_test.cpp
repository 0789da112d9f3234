// Levels that a source has stored: read in place of volumes from which they would be computed.
#include "server/data/model/stored.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
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
};

// A scalar `f` and a vector `v`, whose levels are those of coarsen().
class SourceWithLevels final : public Source {
 public:
  explicit SourceWithLevels(std::shared_ptr<PartLog> log) : log_(std::move(log)) {
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
    for (FieldInfo& field : info_.fields) field.box_chunk = {1, 1, 1};
    info_.steps.resize(2);
    info_.id = "grid";
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
    if (part.level == 0) return cut(made(field, step), part.box);
    Coarsening how;
    how.halvings.fill(static_cast<int>(part.level));
    for (std::size_t a = 0; a < 3; ++a) {
      how.widths.at(a).assign(static_cast<std::size_t>(dims.at(a)), 1.0);
    }
    if (part.as != StoredAs::two_values) how.reduction = Reduction::drawn;
    if (part.as == StoredAs::strided) how.stride = 1 << part.level;
    return coarsen(made(field, step), how);
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
  explicit StoredFixture(std::uint64_t bytes = 100 * scalar_bytes)
      : dataset(std::make_unique<SourceWithLevels>(log), "grid", bytes) {}
  std::shared_ptr<PartLog> log = std::make_shared<PartLog>();
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
      EXPECT_EQ(f.dataset.bytes_beside_level("v", how),
                2 * scalar_bytes / static_cast<unsigned>(stride * stride * stride));
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
