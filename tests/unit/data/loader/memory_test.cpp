// The memory of loaders counts towards the budget and is limited.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <memory>

#include "server/data/loader/loader.hpp"
#include "server/data/resident/budget.hpp"
#include "tests/unit/data/loader/loader_fixture.hpp"
#include "tests/unit/data/loader_files.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::loader {
namespace {

using test::NetcdfMaker;

TEST_F(Loader, ItsMemoryAndTransfersAreCountedWhileItRuns) {
  const std::string path = folder_ / "a.nc";
  test::write_wind(path, NC_NETCDF4);
  Limits limits;
  limits.budget = std::make_shared<Budget>(std::uint64_t{64} << 20);
  const auto source = opened(path, limits);
  ASSERT_TRUE(source);
  const std::uint64_t of_process = limits.budget->counts().bytes;
  EXPECT_GE(of_process, std::uint64_t{8} << 20);
  ASSERT_TRUE(source->read(0, 0));
  EXPECT_GT(limits.budget->counts().bytes, of_process) << "the memory for the next volume is kept";
  source->release();
  EXPECT_EQ(limits.budget->counts().bytes, 0U);
  limits.budget = std::make_shared<Budget>(std::uint64_t{1} << 20);
  const auto refused = open_path(path, limits);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::out_of_memory);
  EXPECT_THAT(refused.error().message, testing::HasSubstr("needs 8.0 MiB"));
}

TEST_F(Loader, ExceedingTheBudgetWhileOpeningIsAnError) {
  const std::string path = folder_ / "a.nc";
  test::write_positions(path, 1500);  // 36 MB of coordinates
  Limits limits;
  // Memory of an idle loader, with a small margin.
  limits.budget = std::make_shared<Budget>((std::uint64_t{8} << 20) + (std::uint64_t{64} << 10));
  for (int n = 0; n < 3; ++n) {
    const auto source = open_path(path, limits);
    // The loader may have opened the file between two measurements: the loader has then exited, and
    // its result is valid.
    if (source) {
      EXPECT_EQ((*source)->process(), -1);
      EXPECT_GT((*source)->info().stored_bytes, 0U);
    } else {
      EXPECT_EQ(source.error().kind, ErrorKind::out_of_memory);
    }
    EXPECT_EQ(limits.budget->counts().bytes, 0U);
  }
}

#ifndef WINDSPLAT_SANITIZED  // its shadow memory counts
TEST_F(Loader, VolumeIsTheSameWhenTransferMemoryIsNotKept) {
  const std::string path = folder_ / "a.nc";
  test::write_large(path);
  Limits limits;
  const auto keeps = opened(path, limits);
  // More than an eighth of this.
  limits.budget = std::make_shared<Budget>(std::uint64_t{24} << 20);
  const auto keeps_not = opened(path, limits);
  ASSERT_TRUE(keeps && keeps_not);
  const std::uint64_t before = limits.budget->counts().bytes;
  for (int n = 0; n < 3; ++n) {
    const auto a = keeps->read(0, 0);
    const auto b = keeps_not->read(0, 0);
    ASSERT_TRUE(a && b);
    expect_same(*a, *b);
    EXPECT_LT(limits.budget->counts().bytes, before + (std::uint64_t{4} << 20));
  }
}
#endif

#ifndef WINDSPLAT_SANITIZED
// A chunk of 48 MiB, compressed to a few kilobytes.
TEST_F(Loader, FileThatDecompressesBeyondTheMemoryIsAnError) {
  const std::string path = folder_ / "bomb.nc";
  {
    NetcdfMaker file(path);
    const int z = file.dimension("z", NC_UNLIMITED);
    const int y = file.dimension("y", 512);
    const int x = file.dimension("x", 512);
    const int v = file.variable("T", NC_FLOAT, {z, y, x}, std::vector<double>(512 * 512, 1));
    file.chunk(v, {48, 512, 512});
    file.deflate(v);
  }
  Limits limits;
  limits.memory_bytes = std::uint64_t{8} << 20;
  const auto small = opened(path, limits);
  ASSERT_TRUE(small);
  EXPECT_FALSE(small->read(0, 0));
  limits.memory_bytes = std::uint64_t{1} << 30;
  const auto large = opened(path, limits);
  ASSERT_TRUE(large);
  const auto read = large->read(0, 0);
  EXPECT_TRUE(read) << read.error().message;
}
#endif

}  // namespace
}  // namespace windsplat::data::loader
