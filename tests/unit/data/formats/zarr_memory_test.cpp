// Zarr read level by level, in either direction: what of it stays in memory.
#include <gtest/gtest.h>
#include <malloc.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "server/data/formats/zarr/store.hpp"
#include "tests/unit/data/formats/zarr_maker.hpp"

namespace windsplat::data::test {
namespace {

std::size_t bytes_in_use() {
  const struct mallinfo2 now = ::mallinfo2();
  return now.uordblks + now.hblkhd;
}

constexpr std::size_t levels = 16;
constexpr std::size_t chunk_levels = 4;
constexpr std::size_t side = 256;

// f[level, row, column] is the number of its sample, in four chunks of 1 MiB.
void put_levels(const ZarrStore& store) {
  store.put("f/.zarray",
            R"({"zarr_format":2,"order":"C","filters":null,"shape":[16,256,256],)"
            R"("chunks":[4,256,256],"dtype":"<f4","fill_value":null,"compressor":null})");
  std::vector<float> values(chunk_levels * side * side);
  for (std::size_t chunk = 0; chunk < levels / chunk_levels; ++chunk) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = static_cast<float>(chunk * values.size() + i);
    }
    store.put("f/" + std::to_string(chunk) + ".0.0", bytes_of_items(values));
  }
}

// Most bytes that are held besides `level` while all levels are read, last one first if `reversed`.
std::size_t held_while_reading(const zarr::Store& store, bool reversed) {
  std::vector<float> level(side * side);
  const std::size_t before = bytes_in_use();
  std::size_t most = before;
  for (std::size_t n = 0; n < levels; ++n) {
    const std::size_t at = reversed ? levels - 1 - n : n;
    const auto done = store.read(0, {at, 0, 0}, {1, side, side}, level.data());
    EXPECT_TRUE(done) << done.error().message;
    EXPECT_EQ(level.front(), static_cast<float>(at * level.size()));
    EXPECT_EQ(level.back(), static_cast<float>((at + 1) * level.size() - 1));
    most = std::max(most, bytes_in_use());
  }
  return most - before;
}

TEST(ZarrMemory, ChunksThatWereReadToTheirEndAreNotKept) {
  const ZarrStore folder;
  put_levels(folder);
  const auto location = locate(folder.path());
  ASSERT_TRUE(location);
  const auto store = zarr::Store::open(direct_files(*location));
  ASSERT_TRUE(store) << store.error().message;
  constexpr std::size_t chunk_bytes = chunk_levels * side * side * sizeof(float);
  for (const bool reversed : {false, true}) {
    EXPECT_LT(held_while_reading(**store, reversed), chunk_bytes + chunk_bytes / 2);
  }
}

}  // namespace
}  // namespace windsplat::data::test
