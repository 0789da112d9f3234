// Volumes that pass through a window in parts: the same values as read in this process, and loaders
// that describe parts wrongly.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/data/files/files.hpp"
#include "server/data/loader/arriving_volume.hpp"
#include "server/data/loader/loader.hpp"
#include "server/data/open/open.hpp"
#include "server/data/resident/budget.hpp"
#include "tests/unit/data/loader/faulty_loader.hpp"
#include "tests/unit/data/loader/loader_fixture.hpp"

namespace windsplat::data::loader {
namespace {

constexpr std::size_t side = 256;
constexpr std::size_t layer = side * side;
constexpr std::size_t layers_of_half = 8;  // of 256 x 256 samples, 2 MiB

// Fields of 20 layers, more than the 16 that a window holds: a wind whose components are masked in
// different places, of 64 bits and infinite in one and zero in another, and a scalar of 16 bits.
struct LargeFile {
  int mode = NC_NETCDF4;
  std::vector<double> levels;
  std::vector<std::size_t> chunk;  // empty: not chunked

  void write(const std::string& path) const {
    test::NetcdfMaker file(path, mode);
    const int z = file.axis("lev", levels, "hPa");
    const int y = file.dimension("y", side);
    const int x = file.dimension("x", side);
    std::vector<double> values(levels.size() * layer);
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = 1000 * std::sin(0.37 * static_cast<double>(i));
    }
    for (const char* name : {"u", "v", "w", "T"}) {
      std::vector<double> own = values;
      own[static_cast<std::size_t>(*name) * layer / 8] = 9e36;
      if (*name == 'v') own[3 * layer + 7] = std::numeric_limits<double>::infinity();
      if (*name == 'w') own.assign(own.size(), 0);
      if (*name == 'T') {
        for (double& value : own) value = std::floor(value > 1e30 ? 0 : value);
      }
      const nc_type type = *name == 'T' ? NC_SHORT : *name == 'v' ? NC_DOUBLE : NC_FLOAT;
      const int v = file.variable(name, type, {z, y, x}, own);
      if (*name == 'T') {
        file.number(v, "scale_factor", NC_DOUBLE, {0.01});
      } else {
        file.number(v, "_FillValue", type, {9e36});
      }
      file.text(v, "units", *name == 'T' ? "K" : "m s-1");
      if (!chunk.empty()) {
        file.chunk(v, chunk);
        file.deflate(v);
      }
    }
  }
};

std::vector<double> falling(std::size_t count) {
  std::vector<double> out;
  for (std::size_t i = 0; i < count; ++i) out.push_back(1000 - 10 * static_cast<double>(i));
  return out;
}

class Window : public Loader {
 protected:
  // Reads all fields twice through a loader, and once in this process.
  void expect_same_as_here(const LargeFile& file) {
    const std::string path = folder_ / "large.nc";
    file.write(path);
    expect_same_as_here(path);
  }

  static void expect_same_as_here(const std::string& path) {
    const auto apart = opened(path);
    auto here = open_file(path);
    ASSERT_TRUE(apart && here);
    ASSERT_EQ((*here)->info().fields.size(), apart->info().fields.size());
    std::vector<Volume> expected;
    for (std::size_t f = 0; f < apart->info().fields.size(); ++f) {
      auto volume = (*here)->read(f, 0);
      ASSERT_TRUE(volume);
      expected.push_back(std::move(*volume));
    }
    for (int round = 0; round < 2; ++round) {
      for (std::size_t f = 0; f < expected.size(); ++f) {
        const auto volume = apart->read(f, 0);
        ASSERT_TRUE(volume);
        EXPECT_GT(volume->bytes(), 2 * layers_of_half * layer * sizeof(float));
        expect_same(*volume, expected[f]);
      }
    }
  }
};

TEST_F(Window, ClassicFileReadsAsInThisProcess) {
  expect_same_as_here({NC_64BIT_DATA, falling(20), {}});
}

TEST_F(Window, ReversedLevelsReadAsInThisProcess) {
  std::vector<double> rising = falling(19);
  std::reverse(rising.begin(), rising.end());
  expect_same_as_here({NC_64BIT_DATA, rising, {}});
  expect_same_as_here({NC_NETCDF4, rising, {16, 64, 256}});
}

TEST_F(Window, ChunksSmallerAndLargerThanTheWindowReadAsInThisProcess) {
  expect_same_as_here({NC_NETCDF4, falling(20), {3, 100, 256}});
  expect_same_as_here({NC_NETCDF4, falling(20), {20, 128, 256}});
}

// The components of a tuple are neighbours in the file.
TEST_F(Window, ImageOfVtkReadsAsInThisProcess) {
  const std::string path = folder_ / "image.vtk";
  std::ofstream file(path, std::ios::binary);
  const std::size_t samples = 20 * layer;
  file << "# vtk DataFile Version 3.0\nimage\nBINARY\nDATASET STRUCTURED_POINTS\n"
       << "DIMENSIONS 256 256 20\nORIGIN 0 0 0\nSPACING 1 1 1\nPOINT_DATA " << samples << '\n';
  const auto numbers = [&](std::size_t count) {
    std::string bytes;
    for (std::size_t i = 0; i < count; ++i) {
      const auto bits = std::bit_cast<std::uint32_t>(0.5F * static_cast<float>(i % 70001));
      for (const unsigned shift : {24U, 16U, 8U, 0U}) bytes += static_cast<char>(bits >> shift);
    }
    file << bytes << '\n';
  };
  file << "VECTORS wind float\n";
  numbers(3 * samples);
  file << "SCALARS T float 1\nLOOKUP_TABLE default\n";
  numbers(samples);
  file.close();
  expect_same_as_here(path);
}

// Chunks of all layers exceed what is kept of them.
TEST_F(Window, ChunksTooLargeToBeKeptAreReadTogether) {
  const std::string path = folder_ / "deep.nc";
  LargeFile{NC_NETCDF4, falling(130), {130, 256, 256}}.write(path);
  const auto apart = opened(path);
  auto here = open_file(path);
  ASSERT_TRUE(apart && here);
  const auto a = apart->read(0, 0);
  const auto b = (*here)->read(0, 0);
  ASSERT_TRUE(a && b);
  expect_same(*a, *b);
}

TEST_F(Window, ProgressRisesToOne) {
  const std::string path = folder_ / "large.nc";
  LargeFile{NC_64BIT_DATA, falling(20), {}}.write(path);
  const auto source = opened(path);
  ASSERT_TRUE(source);
  std::vector<double> told;
  source->on_progress([&](double done) { told.push_back(done); });
  ASSERT_TRUE(source->read(0, 0));
  EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
  for (const double done : told) EXPECT_LE(done, 1);
}

TEST(WindowSize, VolumesBeyondTwoHalvesHaveAWindow) {
  const auto layers = [](std::array<int, 3> dims, int components) {
    Volume volume;
    volume.dims = dims;
    volume.components = components;
    return window_size(volume).layers;
  };
  EXPECT_EQ(layers({256, 256, 16}, 1), 0U);
  EXPECT_EQ(layers({256, 256, 17}, 1), layers_of_half);
  EXPECT_EQ(layers({256, 256, 8}, 2), 0U);
  EXPECT_EQ(layers({256, 256, 9}, 2), layers_of_half);
  // A layer that is larger than 2 MiB.
  EXPECT_EQ(layers({1024, 1024, 2}, 1), 0U);
  EXPECT_EQ(layers({1024, 1024, 3}, 1), 1U);
  EXPECT_EQ(layers({2048, 2048, 3}, 1), 1U);
  EXPECT_EQ(layers({2048, 2049, 3}, 1), 0U);
}

TEST_F(Window, OneLayerBeyondTheWindowReadsAsInThisProcess) {
  expect_same_as_here({NC_64BIT_DATA, falling(17), {}});
}

// Scripts that are asked for a field of 20 layers of 256 x 256 samples.
class FaultyParts : public FaultyLoader {
 protected:
  void SetUp() override {
    FaultyLoader::SetUp();
    describe({"T"});
  }

  void describe(const std::vector<std::string>& components) {
    DatasetInfo info = sample_info();
    for (const std::size_t a : {0U, 1U, 2U}) {
      info.grid.axes[a].coordinates.resize(a == 2 ? 20 : side);
      std::iota(info.grid.axes[a].coordinates.begin(), info.grid.axes[a].coordinates.end(), 0);
    }
    FieldInfo& field = info.fields.front();
    field.kind = components.size() == 1 ? FieldKind::scalar : FieldKind::vector;
    field.components = components;
    field.component_units.assign(components.size(), "");
    std::ofstream(folder_ / "info", std::ios::binary) << encode_info(info);
  }

  // A script that has the memory `m` and sends parts by part(component, first, layers, half).
  void send_parts(const std::string& what) {
    respond_with(
        "fd = send_info()\nm = mmap.mmap(fd, 0)\n"
        "def part(*about):\n"
        "    send('part', struct.pack('<4Q', *about))\n"
        "    if receive()[0] != 'taken': os._exit(1)\n"
        "def fill(half, value):\n"
        "    m[half << 21:(half + 1) << 21] = struct.pack('<f', value) * (1 << 19)\n" +
        what + "send('filled')\nreceive()\n");
  }

  void expect_violation() {
    expect_not_read(
        "the loader of 'some.nc' violated the protocol and was terminated while reading 'wind'");
  }
};

TEST_F(FaultyParts, PartsInAnyOrderMakeTheVolume) {
  send_parts(
      "fill(0, 2)\npart(0, 12, 8, 0)\nfill(1, 3)\npart(0, 0, 4, 1)\n"
      "fill(0, 5)\npart(0, 4, 8, 0)\n");
  const auto volume = read();
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->values[0], 3.0F);
  EXPECT_EQ(volume->values[4 * layer - 1], 3.0F);
  EXPECT_EQ(volume->values[4 * layer], 5.0F);
  EXPECT_EQ(volume->values[12 * layer], 2.0F);
  EXPECT_EQ(volume->range, (std::array{2.0F, 5.0F}));
}

TEST_F(FaultyParts, PartsThatDoNotFitAreRefused) {
  for (const char* about :
       {"0, 0, 9, 0", "0, 0, 0, 0", "0, 0, 8, 2", "1, 0, 8, 0", "0, 13, 8, 0", "0, 20, 1, 0",
        "0, 2**64 - 4, 8, 0", "0, 0, 2**63, 0", "2**64 - 1, 0, 8, 0"}) {
    send_parts(std::string("part(") + about + ")\n");
    expect_violation();
  }
  send_parts("send('part', b'x' * 31)\n");
  expect_violation();
}

TEST_F(FaultyParts, PartsThatCameBeforeAreRefused) {
  send_parts("part(0, 0, 8, 0)\npart(0, 7, 1, 1)\n");
  expect_violation();
}

TEST_F(FaultyParts, MissingPartsAreRefused) {
  send_parts("part(0, 0, 8, 0)\npart(0, 8, 8, 1)\n");
  expect_not_read("the loader of 'sample.nc' sent an incomplete volume while reading 'wind'");
}

TEST_F(FaultyParts, InfinitiesOfScalarsAreRefused) {
  send_parts("fill(0, inf)\npart(0, 0, 8, 0)\npart(0, 8, 8, 1)\npart(0, 16, 4, 1)\n");
  expect_not_read(
      "the loader of 'sample.nc' did not mask all invalid numbers while reading 'wind'");
}

TEST_F(FaultyParts, InvalidNumbersOfAComponentMaskTheVector) {
  describe({"u", "v"});
  send_parts(
      "fill(0, inf)\nfill(1, 4)\n"
      "for at in ((0, 8), (8, 8), (16, 4)): part(0, *at, 1)\n"
      "for at in ((0, 8), (8, 8), (16, 4)): part(1, *at, int(at[0] > 0))\n");
  const auto volume = read();
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->masked, static_cast<std::int64_t>(8 * layer));
  EXPECT_TRUE(std::isnan(volume->component(0)[0]) && std::isnan(volume->component(1)[0]));
  EXPECT_FLOAT_EQ(volume->range[0], std::hypot(4.0F, 4.0F));
}

TEST_F(FaultyParts, PartsOfAWholeVolumeAreRefused) {
  send_parts("send('whole')\nreceive()\npart(0, 0, 8, 0)\n");
  expect_violation();
}

TEST_F(FaultyParts, WholeVolumesAfterPartsAreRefused) {
  send_parts("part(0, 0, 8, 0)\nsend('whole')\nreceive()\nsend('filled')\n");
  expect_violation();
}

// Local files that call `on_answer` when the loader has answered, before its memory is counted.
class WatchedFiles final : public Files {
 public:
  WatchedFiles(Location location, std::function<void()> on_answer)
      : files_(direct_files(std::move(location))), on_answer_(std::move(on_answer)) {}
  [[nodiscard]] const Location& location() const override { return files_->location(); }
  Result<std::shared_ptr<const InputFile>> open(const std::string& name) override {
    return files_->open(name);
  }
  Result<std::vector<std::string>> list(const std::string& folder) override {
    return files_->list(folder);
  }
  bool exists(const std::string& name) override { return files_->exists(name); }
  std::optional<Error> take_fault() override {
    on_answer_();
    return files_->take_fault();
  }

 private:
  std::shared_ptr<Files> files_;
  std::function<void()> on_answer_;
};

// The memory limit ends the loader once it has answered that it needs the memory of a whole volume.
TEST_F(FaultyParts, EndedLoaderIsStartedAgainForAWholeVolume) {
  const std::string asked = folder_ / "asked";
  const std::string full = folder_ / "full";
  const std::string grown = folder_ / "grown";
  const std::string again = folder_ / "again";
  send_parts("if not os.path.exists('" + asked + "'):\n    open('" + asked +
             "', 'w').close()\n"
             "    send('whole')\n"
             "    for _ in range(2000):\n"
             "        if os.path.exists('" +
             full +
             "'): break\n"
             "        time.sleep(0.01)\n"
             "    more = b'x' * (16 << 20)\n"
             "    open('" +
             grown +
             "', 'w').close()\n"
             "    receive()\n"
             "else:\n    open('" +
             again + "', 'w').close()\n");
  limits_.budget = std::make_shared<Budget>(std::uint64_t{256} << 20);
  Reservation others(limits_.budget);
  // The loader grows once the rest of the memory is taken, so that no earlier count sees it.
  const auto fill_memory = [&] {
    if (!std::filesystem::exists(asked) || others.bytes() > 0) return;
    constexpr std::uint64_t left = std::uint64_t{4} << 20;
    EXPECT_TRUE(others.resize(limits_.budget->room() - left));
    std::ofstream(full).put('x');
    for (int ms = 0; ms < 20'000 && !std::filesystem::exists(grown); ++ms) ::usleep(1000);
    EXPECT_TRUE(std::filesystem::exists(grown));
  };
  limits_.files = [&](const Location& location, const std::function<bool()>&) {
    return std::make_shared<WatchedFiles>(location, fill_memory);
  };
  const auto source = opened();
  ASSERT_TRUE(source) << source.error().message;
  const auto volume = (*source)->read(0, 0);
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->values.size(), 20 * layer);
  EXPECT_GT(others.bytes(), 0U);
  EXPECT_TRUE(std::filesystem::exists(again));
}

TEST_F(FaultyParts, LaterChangesOfTheWindowHaveNoEffect) {
  send_parts(
      "fill(0, 1)\npart(0, 0, 8, 0)\npart(0, 8, 8, 0)\npart(0, 16, 4, 0)\n"
      "send('filled')\nfill(0, inf)\nreceive()\n");
  auto source = opened();
  ASSERT_TRUE(source) << source.error().message;
  const auto volume = (*source)->read(0, 0);
  ASSERT_TRUE(volume) << volume.error().message;
  ::usleep(200'000);
  EXPECT_EQ(volume->range, (std::array{1.0F, 1.0F}));
  EXPECT_EQ(volume->values[0], 1.0F);
}

}  // namespace
}  // namespace windsplat::data::loader
