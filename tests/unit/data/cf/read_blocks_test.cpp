// Parts in which the levels of a variable are read, and chunks that are decoded for them, in files
// that claim certain chunks.
#include "server/data/cf/read_blocks.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <numeric>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/data/cf/source.hpp"
#include "server/data/files/files.hpp"
#include "server/data/formats/netcdf/file.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

using Lengths = std::vector<std::size_t>;

// Chunks of a file that were decoded, and are kept until they are forgotten.
struct ChunkLog {
  std::set<std::pair<int, Lengths>> kept;
  int variable = -1;  // the only one that is counted
  int decoded = 0;
  int touched = 0;  // by all reads, kept or not
  int forgotten = 0;
};

// A file whose variables of three dimensions have chunks of this size.
class ClaimedChunks final : public cf::ArrayFile {
 public:
  ClaimedChunks(std::unique_ptr<cf::ArrayFile> file, Lengths chunk, ChunkLog& log)
      : file_(std::move(file)), chunk_(std::move(chunk)), log_(log) {}

  [[nodiscard]] const FileContents& contents() const override { return file_->contents(); }
  [[nodiscard]] const std::string& name() const override { return file_->name(); }
  [[nodiscard]] std::string format() const override { return file_->format(); }
  [[nodiscard]] std::string identity() const override { return file_->identity(); }
  [[nodiscard]] cf::Numbers numbers(int variable, const char* attribute) const override {
    return file_->numbers(variable, attribute);
  }
  [[nodiscard]] std::string text_of(int variable, const char* attribute) const override {
    return file_->text_of(variable, attribute);
  }
  [[nodiscard]] Lengths chunk(int variable) const override {
    const std::size_t rank = contents().variables.at(cf::at(variable)).dims.size();
    return rank == chunk_.size() ? chunk_ : Lengths(rank, 1);
  }
  Result<void> read(int variable, const Lengths& start, const Lengths& count,
                    double* out) const override {
    decode(variable, start, count);
    return file_->read(variable, start, count, out);
  }
  Result<void> read(int variable, const Lengths& start, const Lengths& count,
                    float* out) const override {
    decode(variable, start, count);
    return file_->read(variable, start, count, out);
  }
  void forget_chunks(int variable) const override {
    if (variable != log_.variable) return;
    ++log_.forgotten;
    log_.kept.clear();
  }

 private:
  void decode(int variable, const Lengths& start, const Lengths& count) const {
    if (variable != log_.variable) return;
    const auto last = [&](std::size_t d) { return (start[d] + count[d] - 1) / chunk_[d]; };
    for (std::size_t k = start[0] / chunk_[0]; k <= last(0); ++k) {
      for (std::size_t j = start[1] / chunk_[1]; j <= last(1); ++j) {
        for (std::size_t i = start[2] / chunk_[2]; i <= last(2); ++i) {
          ++log_.touched;
          log_.decoded += log_.kept.insert({variable, {k, j, i}}).second ? 1 : 0;
        }
      }
    }
  }

  std::unique_ptr<cf::ArrayFile> file_;
  Lengths chunk_;
  ChunkLog& log_;
};

// Collects the parts of a field in a volume.
class Collected final : public PartTaker {
 public:
  Collected(std::size_t layer, std::size_t layers_max, std::size_t samples)
      : values(samples, -1.0F), layer_(layer), part_(layer * layers_max), layers_(layers_max) {}

  [[nodiscard]] std::size_t layers_max() const override { return layers_; }
  float* room() override { return part_.data(); }
  void take(const VolumePart& part) override {
    std::copy_n(part_.data(), part.layers * layer_, values.data() + part.first * layer_);
    ++parts;
  }

  std::vector<float> values;
  int parts = 0;

 private:
  std::size_t layer_;
  std::vector<float> part_;
  std::size_t layers_;
};

class LevelParts : public testing::Test {
 protected:
  // A scalar f on a grid of z.size() x side x side samples.
  std::unique_ptr<cf::ArrayFile> file_of(const std::vector<double>& z, std::size_t side,
                                         Lengths chunk) {
    const std::string path = folder_ / "file.nc";
    {
      NetcdfMaker file(path);
      const int level = file.axis("z", z, "m");
      file.text(file.variable_id("z"), "axis", "Z");
      const int y = file.dimension("y", side);
      const int x = file.dimension("x", side);
      std::vector<double> values;
      for (std::size_t i = 0; i < z.size() * side * side; ++i) {
        values.push_back(static_cast<double>(i));
      }
      file.variable("f", NC_FLOAT, {level, y, x}, values);
    }
    auto input = direct_files(locate(path).value())->open("file.nc");
    auto file = netcdf::File::open(std::move(input.value()));
    EXPECT_TRUE(file) << file.error().message;
    log_.variable = cf::variable_named((*file)->contents(), "f");
    return std::make_unique<ClaimedChunks>(std::move(*file), std::move(chunk), log_);
  }

  // The number of parts of at most `levels_max` levels of a grid of 4 x side x side samples.
  std::size_t parts_of(std::size_t side, Lengths chunk, std::size_t levels_max) {
    const auto file = file_of({0, 1, 2, 3}, side, std::move(chunk));
    const auto& dims = file->contents().variables.at(cf::at(log_.variable)).dims;
    cf::Placement grid;
    grid.space = {dims[2], dims[1], dims[0]};
    grid.length = {side, side, 4};
    return cf::level_parts(*file, grid, log_.variable, levels_max).size();
  }

  Folder folder_;
  ChunkLog log_;
};

TEST_F(LevelParts, ManyDeepChunksAreReadTogether) {
  EXPECT_EQ(parts_of(100, {4, 4, 4}, 2), 2U);  // 625 chunks
  EXPECT_EQ(parts_of(100, {4, 3, 4}, 2), 2U);  // 850
  EXPECT_EQ(parts_of(100, {4, 3, 3}, 2), 0U);  // 1156
  EXPECT_EQ(parts_of(100, {2, 1, 1}, 2), 2U);  // each chunk in one part
}

// 128 x 128 x 8 bytes a level in whole chunks, of which 100 x 100 x 8 have samples.
TEST_F(LevelParts, ChunksAtTheEdgesCountAsWhole) {
  EXPECT_EQ(parts_of(100, {512, 64, 64}, 2), 2U);  // 64 MiB
  EXPECT_EQ(parts_of(100, {513, 64, 64}, 2), 0U);
}

TEST_F(LevelParts, ChunksAreDecodedOnceForBothDirectionsOfTheLevels) {
  for (const bool falls : {false, true}) {
    std::vector<double> z{0, 1, 2, 3, 4, 5, 6, 7};
    if (falls) std::reverse(z.begin(), z.end());
    log_ = {};
    auto source = cf::make_source(file_of(z, 32, {8, 16, 16}));
    ASSERT_TRUE(source) << source.error().message;
    log_.decoded = 0;
    log_.forgotten = 0;
    Collected collected(32 * 32, 3, 8 * 32 * 32);
    const auto done = (*source)->fill_in_parts(0, 0, collected);
    ASSERT_TRUE(done) << done.error().message;
    EXPECT_TRUE(*done);
    EXPECT_EQ(collected.parts, 3);
    EXPECT_EQ(log_.decoded, 4);
    EXPECT_EQ(log_.forgotten, 1);
    EXPECT_TRUE(log_.kept.empty());
    std::vector<float> whole(8 * 32 * 32);
    ASSERT_TRUE((*source)->fill(0, 0, whole.data()));
    EXPECT_EQ(collected.values, whole);
    EXPECT_EQ(whole[0], falls ? 7 * 32 * 32 : 0);
  }
}

// More than 2^22 samples, which are read in several blocks; the box begins and ends within chunks.
TEST_F(LevelParts, BlocksOfABoxEndWithChunks) {
  std::vector<double> z(80);
  std::iota(z.begin(), z.end(), 0.0);
  const auto file = file_of(z, 256, {24, 64, 256});
  const auto& dims = file->contents().variables.at(cf::at(log_.variable)).dims;
  cf::Placement grid;
  grid.space = {dims[2], dims[1], dims[0]};
  grid.length = {256, 256, 80};
  const Box box{{3, 1, 5}, {250, 255, 70}};
  std::vector<float> values(box.samples());
  const auto done = cf::read_box(*file, grid, log_.variable, 0, box, values.data(), [](double) {});
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(log_.touched, 4 * 4);
  EXPECT_EQ(values.front(), 5 * 65536 + 256 + 3);
  EXPECT_EQ(values.back(), 74 * 65536 + 255 * 256 + 252);
}

}  // namespace
}  // namespace windsplat::data::test
