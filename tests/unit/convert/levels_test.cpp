// Stores of sources in memory: every level has the bits of the level that is computed of the whole.
#include <gtest/gtest.h>

#include <cstring>

#include "server/convert/convert.hpp"
#include "server/convert/pencil.hpp"
#include "server/convert/plan.hpp"
#include "server/data/files/files.hpp"
#include "server/data/formats/zarr/store.hpp"
#include "tests/unit/convert/made_source.hpp"
#include "tests/unit/disk.hpp"

namespace windsplat::convert {
namespace {

using test::made_info;
using test::MadeSource;

// All values of an array of a group.
std::vector<float> read_array(const std::filesystem::path& group, const std::string& name) {
  auto location = data::locate(group.native());
  EXPECT_TRUE(location) << location.error().message;
  auto store = data::zarr::Store::open(data::direct_files(*location));
  EXPECT_TRUE(store) << store.error().message;
  const auto& file = (*store)->contents();
  for (std::size_t v = 0; v < file.variables.size(); ++v) {
    if (file.variables[v].name != name) continue;
    std::vector<std::size_t> count;
    std::size_t items = 1;
    for (const int d : file.variables[v].dims) {
      count.push_back(file.dimensions[static_cast<std::size_t>(d)].length);
      items *= count.back();
    }
    std::vector<float> out(items);
    const auto read = (*store)->read(static_cast<int>(v), std::vector<std::size_t>(count.size(), 0),
                                     count, out.data());
    EXPECT_TRUE(read) << read.error().message;
    return out;
  }
  ADD_FAILURE() << group << " has no " << name;
  return {};
}

struct Grid {
  Three dims;
  std::vector<Three> halvings;
  std::size_t uneven = 3;  // axis
  std::size_t steps = 1;
};

class ConvertLevels : public testing::TestWithParam<Grid> {};

TEST_P(ConvertLevels, AreThoseComputedOfTheWholeBitForBit) {
  const Grid& grid = GetParam();
  const auto info = made_info(grid.dims, grid.steps);
  std::vector<data::Coarsening> chain;
  for (const Three& h : grid.halvings) {
    data::Coarsening how;
    how.halvings = h;
    for (std::size_t a = 0; a < 3; ++a) {
      if (h[a] == 0) continue;
      for (int i = 0; i < grid.dims[a]; ++i) {
        how.widths.at(a).push_back(a == grid.uneven ? 1 + 0.01 * (i % 37) : 0.25);
      }
    }
    chain.push_back(std::move(how));
  }
  Options options;
  options.memory_bytes = std::uint64_t{2} << 30;
  options.memory_text = [](std::uint64_t) { return ""; };
  options.threads = 2;
  const test::Folder folder;
  const Open open = [&](std::uint64_t) -> Result<std::unique_ptr<data::Source>> {
    return std::unique_ptr<data::Source>(std::make_unique<MadeSource>(info));
  };
  const auto report = convert(info, chain, options, open, folder / "out.zarr", {}, [](double) {});
  ASSERT_TRUE(report) << report.error().message;

  const Plan plan = make_plan(info, chain, options).value();
  std::size_t compared = 0;
  for (const PlannedField& field : plan.fields) {
    for (std::size_t step = 0; step < grid.steps; ++step) {
      const data::Volume whole = MadeSource::whole(info, field.index, step);
      for (const Product& product : field.products) {
        const data::Volume wanted =
            product.level == 0 ? whole : reduce(plan, product, whole, data::whole_box(grid.dims));
        for (std::size_t n = 0; n < product.arrays.size(); ++n) {
          const std::string& path = plan.arrays[product.arrays[n]].path;
          const auto found = read_array(folder / "out.zarr" / path.substr(0, 1), path.substr(2));
          ASSERT_EQ(found.size(), grid.steps * wanted.samples()) << path;
          EXPECT_EQ(0, std::memcmp(found.data() + step * wanted.samples(),
                                   wanted.component(static_cast<int>(n)),
                                   wanted.samples() * sizeof(float)))
              << path << " at step " << step;
          ++compared;
        }
      }
    }
  }
  EXPECT_GT(compared, 7U);
}

// Axes of several units with levels beyond three halvings, whole axes, edges and uneven widths.
// The last is just long enough for two bricks at its coarsest level.
INSTANTIATE_TEST_SUITE_P(
    OfGrids, ConvertLevels,
    testing::Values(
        Grid{{530, 129, 5}, {{0, 0, 0}, {1, 0, 0}, {2, 1, 0}, {3, 2, 1}, {4, 3, 2}}, 0},
        Grid{{140, 131, 13}, {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}}, 2, 2},
        Grid{{70, 30, 20}, {{0, 0, 0}}, 3, 2},
        Grid{{131, 1, 1100}, {{0, 0, 0}, {0, 0, 1}, {1, 0, 2}, {2, 0, 4}, {3, 0, 5}}, 2},
        Grid{{4200, 130, 1}, {{0, 0, 0}, {1, 0, 0}, {3, 0, 0}, {5, 1, 0}, {6, 2, 0}}, 1}));

}  // namespace
}  // namespace windsplat::convert
