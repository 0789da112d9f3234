// Default ranges of `inspect`, reports of omissions, and the override.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/integration/cli_program.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace cli_test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using windsplat::data::test::counting;
using windsplat::data::test::NetcdfMaker;

json described(const std::string& path, const std::string& ranges = "auto") {
  const Outcome told = run({"inspect", "--json", "--ranges", ranges, path});
  EXPECT_EQ(told.code, 0) << told.err;
  return json::parse(told.out);
}

bool has_note(const json& dataset, const std::string& part) {
  for (const auto& note : dataset["notes"]) {
    if (note.get<std::string>().find(part) != std::string::npos) return true;
  }
  return false;
}

// "Jet core and its speed found": a user had to draw pictures for it.
TEST(Inspect, TellsWhereFieldsAreGreatest) {
  const json wind = described("climate:32x16x6");
  EXPECT_TRUE(has_note(wind, "greatest wind: "));
  double greatest = 0;
  double longitude = 0;
  int step = -1;
  for (const auto& note : wind["notes"]) {
    const auto text = note.get<std::string>();
    if (std::sscanf(text.c_str(), "greatest wind: %lf m s-1 at lon %lf degrees_east", &greatest,
                    &longitude) != 2) {
      continue;
    }
    const std::size_t at = text.rfind("step ");
    ASSERT_NE(at, std::string::npos) << text;
    step = std::stoi(text.substr(at + 5));
  }
  double range = 0;
  for (const auto& field : wind["fields"]) {
    if (field["name"] == "wind") range = field["range"][1].get<double>();
  }
  EXPECT_NEAR(greatest, range, 1e-4 * range);
  EXPECT_GE(longitude, -180);
  EXPECT_LE(longitude, 180);
  EXPECT_GE(step, 0);
  EXPECT_LT(step, 8);
  EXPECT_FALSE(has_note(described("climate:32x16x6", "none"), "greatest wind"));
}

// Eight steps of 64 x 64, in mostly empty chunks of the given number of steps.
void write_steps(const std::string& path, std::size_t steps_of_a_chunk) {
  NetcdfMaker file(path);
  const int t = file.dimension("time", NC_UNLIMITED);
  const int y = file.dimension("y", 64);
  const int x = file.dimension("x", 64);
  const int u = file.variable("u", NC_FLOAT, {t, y, x}, counting(std::size_t{8} * 64 * 64));
  file.deflate(u);
  file.chunk(u, {steps_of_a_chunk, 64, 64});
}

// Together 34 MiB as floats, within the limit; twice as much exceeds it.
TEST(Inspect, CountsWhatIsDecodedOnce) {
  const Folder folder;
  const std::string path = folder.file("a.nc");
  {
    NetcdfMaker file(path);
    const std::vector<int> dims{file.dimension("z", 30), file.dimension("y", 300),
                                file.dimension("x", 500)};
    for (const char* name : {"f", "g"}) {
      const int v =
          file.variable(name, NC_FLOAT, dims, std::vector<double>(std::size_t{30} * 300 * 500, 2));
      file.deflate(v);
    }
  }
  const json dataset = described(path);
  for (const json& field : dataset["fields"]) {
    EXPECT_EQ(field["range"], (json{2, 2})) << field["name"];
  }
}

TEST(Inspect, ExplainsWhyRangesCoverTheFirstStepOnly) {
  const Folder folder;
  const std::string path = folder.file("a.nc");
  write_steps(path, 1024);  // chunks of 16 MiB
  const json one = described(path);
  EXPECT_EQ(one["fields"][0]["rangeOf"], "step");
  EXPECT_EQ(one["fields"][0]["range"], (json{0, 4095}));
  EXPECT_TRUE(has_note(one,
                       "ranges cover the first step only: all 8 decode to 128.0 MiB, beyond the "
                       "limit of"));
  const json all = described(path, "all");
  EXPECT_EQ(all["fields"][0]["rangeOf"], "all");
  EXPECT_EQ(all["fields"][0]["range"], (json{0, 32767}));
  EXPECT_FALSE(has_note(all, "ranges are"));
}

TEST(Inspect, ReadsRangesAboveTheLimitOnRequest) {
  const Folder folder;
  const std::string path = folder.file("a.nc");
  write_steps(path, 8192);  // chunks of 128 MiB
  const json none = described(path);
  EXPECT_TRUE(none["fields"][0]["range"].is_null());
  EXPECT_TRUE(
      has_note(none, "ranges are not read: a step decodes to 128.0 MiB, beyond the limit of"));
  EXPECT_TRUE(has_note(none, "; --ranges first or all reads them"));
  const json first = described(path, "first");
  EXPECT_EQ(first["fields"][0]["range"], (json{0, 4095}));
  EXPECT_FALSE(has_note(first, "ranges are"));
  EXPECT_TRUE(described(path, "none")["fields"][0]["range"].is_null());
  EXPECT_EQ(run({"inspect", "--ranges", "some", path}).code, 2);
}

// The numbers of q are damaged, those of the wind are not.
TEST(Inspect, DescribesAFileOfWhichAFieldCannotBeRead) {
  const Folder folder;
  const std::string path = folder.file("a.nc");
  {
    NetcdfMaker file(path);
    const std::vector<int> dims{file.dimension("z", 2), file.dimension("y", 40),
                                file.dimension("x", 50)};
    for (const char* name : {"u", "v", "q"}) {
      std::vector<double> values = counting(4000);
      for (double& value : values) value = std::sin(value * value);
      file.deflate(file.variable(name, NC_FLOAT, dims, values));
    }
  }
  std::string bytes = windsplat::data::test::bytes_of(path);
  std::size_t chunk = 0;  // zlib's header at level 1; the last is that of q
  for (std::size_t at = bytes.find("\x78\x01"); at != std::string::npos;
       at = bytes.find("\x78\x01", at + 1)) {
    if (at + 8000 < bytes.size()) chunk = at;
  }
  ASSERT_GT(chunk, 0U);
  for (std::size_t n = chunk + 4000; n < chunk + 4200; ++n) bytes[n] = static_cast<char>(~bytes[n]);
  windsplat::data::test::write_bytes(path, bytes);
  const json dataset = described(path);
  EXPECT_TRUE(has_note(dataset, "the range of 'q' is not known: ")) << dataset["notes"];
  EXPECT_TRUE(has_note(dataset, "'q' cannot be read"));
  for (const json& field : dataset["fields"]) {
    const bool is_read = field["name"] == "u" || field["name"] == "v" || field["kind"] == "vector";
    if (field["dtype"] == "derived") continue;
    EXPECT_EQ(field["range"].is_null(), !is_read) << field;
  }
  EXPECT_EQ(run({"inspect", path}).code, 0);
}

// Of levels that follow the terrain the vertical axis has mean heights, among which the ground is a
// rectangle: the field of heights places it.
TEST(Inspect, NamesTheKeysThatDrawTheGround) {
  const Folder folder;
  for (const bool heights : {true, false}) {
    const std::string path = folder.file(heights ? "terrain.nc" : "level.nc");
    {
      NetcdfMaker file(path);
      const int z = file.axis("z", {100, 200}, "m", "altitude");
      const int y = file.axis("lat", {40, 41, 42}, "degrees_north", "latitude");
      const int x = file.axis("lon", {1, 2, 3}, "degrees_east", "longitude");
      file.variable("t", NC_FLOAT, {z, y, x}, counting(std::size_t{18}));
      const int orog = file.variable("orog", NC_FLOAT, {y, x}, counting(std::size_t{9}));
      file.text(orog, "standard_name", "surface_altitude");
      file.text(orog, "units", "m");
      if (heights) {
        const int levels = file.variable("zz", NC_FLOAT, {z, y, x}, counting(std::size_t{18}));
        file.text(levels, "standard_name", "altitude");
        file.text(levels, "units", "m");
      }
    }
    const std::string keys =
        heights ? "(/geometry/heightField=zz with /ground/show=on)\n" : "(/ground/show=on)\n";
    EXPECT_THAT(run({"inspect", path}).out, HasSubstr("m above sea level " + keys));
  }
}

TEST(Inspect, ShowsNotesInFull) {
  const Folder folder;
  const std::string path = folder.file("a.nc");
  {
    NetcdfMaker file(path);
    const std::vector<int> dims{file.dimension("y", 4), file.dimension("x", 4)};
    for (const char letter : {'a', 'b', 'c', 'd', 'e', 'f'}) {
      const int v =
          file.variable(std::string(40, letter), NC_FLOAT, dims, counting(std::size_t{16}));
      file.number(v, "valid_range", NC_FLOAT, {0, 12});
    }
  }
  const Outcome told = run({"inspect", path});
  ASSERT_EQ(told.code, 0) << told.err;
  std::istringstream lines(told.out);
  std::string text;
  for (std::string word; lines >> word;) text += word + ' ';
  std::size_t longest = 0;
  const json dataset = described(path);
  for (const auto& note : dataset["notes"]) {
    EXPECT_THAT(text, HasSubstr(note.get<std::string>() + ' '));
    longest = std::max(longest, note.get<std::string>().size());
  }
  EXPECT_GT(longest, 200U);
  lines = std::istringstream(told.out.substr(told.out.find("\nnotes\n")));
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80U) << line;
}

}  // namespace
}  // namespace cli_test
