// OpenDX: small files made here, and the storm of Debian's package dxsamples (25 x 14 x 8), whose
// expected values come from a script that reads the tail of each file with Python's struct module:
//   v = struct.unpack(">8400f", open("wind.dx", "rb").read()[-33600:])
//   v[((i * 14 + j) * 8 + k) * 3 + c] i runs along x, j along z, k along y, which is up: the
//   updraft (c = 1) vanishes at k = 0.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/unit/data/formats/plain_maker.hpp"

namespace windsplat::data {
namespace {

using test::counted;
using test::floats;
using test::Folder;
using test::opened;
using test::packed;
using test::refusal;
using test::values_of;
using test::volume_of;
using test::write_file;
using testing::Contains;
using testing::HasSubstr;

using Doubles = std::vector<double>;

// 2 x 3 x 2 positions, slowest along x.
const std::string grid =
    "object 1 class gridpositions counts 2 3 2\norigin 10 20 30\ndelta 1 0 0\ndelta 0 2 0\n"
    "delta 0 0 4\nobject 2 class gridconnections counts 2 3 2\n";

std::string field(const std::string& name, const std::string& data) {
  std::string out("object ");
  out +=
      name + " class field\ncomponent \"positions\" value 1\ncomponent \"connections\" value 2\n";
  out += "component \"data\" " + data + "\n";
  return out;
}

std::string text_of(const Doubles& values) {
  std::string out;
  for (const double value : values)
    out += std::to_string(value) + (out.size() % 7 == 0 ? "\n" : " ");
  return out + "\n";
}

// Reorders from z fastest to x fastest.
Doubles turned(const Doubles& values) {
  Doubles out;
  for (std::size_t z = 0; z < 2; ++z) {
    for (std::size_t y = 0; y < 3; ++y) {
      for (std::size_t x = 0; x < 2; ++x) out.push_back(values[(x * 3 + y) * 2 + z]);
    }
  }
  return out;
}

TEST(Dx, DataAreReadFromTheSameOrAnotherFile) {
  const Folder folder;
  const Doubles values = counted(12, 0.5);
  const std::string array = "object 3 class array type float rank 0 items 12 ";
  const std::string tail = field("\"heat\"", "value 3");
  write_file(folder / "text.dx", std::string("# a comment \"\n") + grid + array + "data follows\n" +
                                     text_of(values) + "attribute \"dep\" string \"positions\"\n" +
                                     tail + "end\n");
  write_file(folder / "msb.dx",
             grid + array + "msb ieee data 3\n" + tail + "end\nxyz" + packed<float>(values, true));
  write_file(folder / "lsb.dx", grid + array + "lsb ieee data follows\n" + packed<float>(values) +
                                    "\n" + tail + "end\n");
  write_file(folder / "file.dx",
             grid + array + "lsb binary data file \"in/h.bin\",5\n" + tail + "end\n");
  write_file(folder / "in/h.bin", std::string("12345") + packed<float>(values));
  write_file(folder / "later.dx", grid + array + "data 0\n" + tail + "end\n" + text_of(values));
  for (const char* name : {"text.dx", "msb.dx", "lsb.dx", "file.dx", "later.dx"}) {
    const auto source = opened(folder / name);
    ASSERT_TRUE(source) << name;
    EXPECT_EQ(source->info().format, "OpenDX");
    EXPECT_EQ(source->info().grid.axes[0].coordinates, (Doubles{10, 11}));
    EXPECT_EQ(source->info().grid.axes[1].coordinates, (Doubles{20, 22, 24}));
    EXPECT_EQ(source->info().grid.axes[2].coordinates, (Doubles{30, 34}));
    EXPECT_EQ(source->info().find("heat")->dtype, "float32");
    EXPECT_EQ(values_of(*source, "heat"), floats(turned(values))) << name;
  }
}

// The second index runs south from y 20: its first row is the last of the volume.
TEST(Dx, NegativeDeltaReversesItsAxis) {
  const Folder folder;
  std::string southward = grid;
  southward.replace(southward.find("0 2 0\n"), 6, "0 -2 0\n");
  const Doubles values = counted(12);
  write_file(folder / "s.dx", southward + "object 3 class array items 12 data follows\n" +
                                  text_of(values) + field("4", "3") + "end\n");
  const auto source = opened(folder / "s.dx");
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().grid.axes[1].coordinates, (Doubles{16, 18, 20}));
  Doubles expected;
  for (std::size_t z = 0; z < 2; ++z) {
    for (const std::size_t from_north : {2U, 1U, 0U}) {
      for (std::size_t x = 0; x < 2; ++x) expected.push_back(values[(x * 3 + from_north) * 2 + z]);
    }
  }
  EXPECT_EQ(values_of(*source, "s"), floats(expected));
}

TEST(Dx, SeriesAreStepsAndGroupsAreFields) {
  const Folder folder;
  std::string text = grid;
  for (int i = 0; i < 3; ++i) {
    const std::string number = std::to_string(i);
    text += std::string("object \"d").append(number);
    text += "\" array type double rank 1 shape 3 items 12 data follows\n";
    text += text_of(counted(36, i + 1));
    text +=
        field(std::string("\"f").append(number) + "\"", std::string("\"d").append(number) + "\"");
  }
  text +=
      "object \"s\" class series\nmember 0 position 5 value \"f0\"\nmember 1 position 7.5 value "
      "\"f1\"\nmember 2 value \"f2\" position 9\n";
  write_file(folder / "s.dx", text + "end\n");
  auto source = opened(folder / "s.dx");
  ASSERT_TRUE(source);
  ASSERT_EQ(source->info().steps.size(), 3U);
  EXPECT_EQ(source->info().steps[1].value, 7.5);
  EXPECT_EQ(source->info().steps[2].value, 9);  // after the value
  const Volume v = volume_of(*source, "s", 2);
  EXPECT_EQ(v.components, 3);
  EXPECT_EQ(v.component(1)[1], 3 * (3 * 6 + 1));  // x 1: the seventh item
  write_file(folder / "g.dx",
             text +
                 "object 9 class group\nmember \"a\" value \"f0\"\nmember \"b\" value "
                 "file \"o.dx\",\"other\"\nmember \"c\" value file \"none.dx\",\"c\"\n");
  write_file(folder / "o.dx", grid + "object 7 class array items 12 data follows\n" +
                                  text_of(counted(12)) + field("other", "7"));
  source = opened(folder / "g.dx");
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().steps.size(), 1U);
  EXPECT_NE(source->info().find("a"), nullptr);
  EXPECT_EQ(values_of(*source, "b"), floats(turned(counted(12))));
  EXPECT_THAT(source->info().notes, Contains(HasSubstr("'c' is omitted")));
}

TEST(Dx, ProductsOfLinesAndValuesOfCells) {
  const Folder folder;
  write_file(folder / "p.dx",
             "object 4 class array type float rank 1 shape 3 items 3 data follows\n"
             "1 0 5  1 1 5  1 4 5\n"
             "object 5 class regulararray count 2 origin 2 0 0 delta 3 0 0\n"
             "object 6 class regulararray count 2 origin 0 0 0 delta 0 0 1\n"
             "object 1 class productarray term 5 term 4 term 6\n"
             "object 2 class gridconnections counts 2 3 2\n"
             "object 3 class array type int rank 0 items 2 data follows 7 8\n"
             "attribute \"dep\" string \"connections\"\n" +
                 field("8", "3"));
  const auto source = opened(folder / "p.dx");
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().grid.axes[0].coordinates, (Doubles{4.5}));
  EXPECT_EQ(source->info().grid.axes[1].coordinates, (Doubles{0.5, 2.5}));
  EXPECT_EQ(source->info().grid.axes[2].coordinates, (Doubles{5.5}));
  EXPECT_EQ(values_of(*source, "p"), floats({7, 8}));
}

struct BadDxCase {
  const char* name;
  std::string text;
  const char* reason;
};

class DxRefusal : public testing::TestWithParam<BadDxCase> {};

TEST_P(DxRefusal, NamesItsReason) {
  const Folder folder;
  write_file(folder / "bad.dx", GetParam().text);
  EXPECT_THAT(refusal(folder / "bad.dx"), HasSubstr(GetParam().reason));
}

std::string with_array(const std::string& array) {
  return grid + "object 3 class array " + array + "\n" + field("4", "3") + "end\n";
}

INSTANTIATE_TEST_SUITE_P(
    All, DxRefusal,
    testing::Values(
        BadDxCase{"short", with_array("items 12 lsb ieee data 0"), "does not fit"},
        BadDxCase{"follows", with_array("items 12 data follows 1 2 3"), "is not a number"},
        BadDxCase{"huge", with_array("items 4294967295 lsb ieee data follows 1 2 3"), "truncated"},
        BadDxCase{"overflow",
                  with_array("rank 2 shape 9223372036854775807 9223372036854775807 items "
                             "9223372036854775807 lsb ieee data 0"),
                  "does not fit"},
        BadDxCase{"offset", with_array("items 12 lsb ieee data 9223372036854775807"),
                  "does not fit"},
        BadDxCase{"negative", with_array("items -12 lsb ieee data 0"), "negative"},
        BadDxCase{"count", with_array("items 2 data follows 1 2"), "with 2 values on 12 positions"},
        BadDxCase{"tensor",
                  with_array("rank 1 shape 9 items 12 data follows " + text_of(counted(108))),
                  "of an unsupported shape"},
        BadDxCase{"strings", with_array("type string items 12 data follows \"a\""),
                  "not supported"},
        BadDxCase{"outside", with_array("items 12 data file \"../x\",0"),
                  "outside the dataset's folder"},
        BadDxCase{"no_object", grid + field("4", "99"), "has no object '99'"},
        BadDxCase{"big_grid",
                  "object 1 class gridpositions counts 4294967295 4294967295 4294967295\n"
                  "origin 0 0 0\ndelta 1 0 0\ndelta 0 1 0\ndelta 0 0 1\n"
                  "object 2 class gridconnections counts 2 2 2\nobject 3 class array items 1 "
                  "data follows 1\n" +
                      field("4", "3"),
                  "a dimension of 4294967295"},
        BadDxCase{"listed",
                  "object 1 class array rank 1 shape 3 items 1 data follows 1 2 3\n"
                  "object 2 class gridconnections counts 1 1 1\nobject 3 class array items 1 "
                  "data follows 1\n" +
                      field("4", "3"),
                  "listed one by one"},
        BadDxCase{"word", grid + "surprise 4\n", "'surprise' is not understood"}),
    [](const auto& test) { return std::string(test.param.name); });

// Parsing a product or series that contains itself must end.
TEST(DxRefusal, CyclesAreRefused) {
  const Folder folder;
  write_file(folder / "c.dx",
             "object 1 class productarray term 1 term 1\n"
             "object 2 class gridconnections counts 1 1\nobject 3 class array "
             "items 1 data follows 1\n" +
                 field("4", "3"));
  EXPECT_THAT(refusal(folder / "c.dx"), HasSubstr("a product of products"));
  write_file(folder / "c.dx", "object 1 class series member 0 value 1\n");
  EXPECT_THAT(refusal(folder / "c.dx"), HasSubstr("is not a field"));
  write_file(folder / "c.dx", "object 1 class group member \"a\" value file \"c.dx\",1\n");
  EXPECT_THAT(refusal(folder / "c.dx"), HasSubstr("neither a field nor a series"));
}

std::string dx_sample(const std::string& name) {
  const char* folder = std::getenv("WINDSPLAT_TEST_DATA");
  std::string path = folder != nullptr ? std::string(folder)
                                       : std::string(WINDSPLAT_SOURCE_DIR) + "/build/test-data";
  path += "/" + name;
  EXPECT_TRUE(std::filesystem::exists(path)) << path << ": run scripts/fetch-test-data";
  return path;
}

// y is up: world x, y, z are z, x, y of the file, and the wind is rotated with them.
TEST(DxStorm, WindIsRotatedUpright) {
  const auto source = opened(dx_sample("wind.dx"));
  ASSERT_TRUE(source);
  const DatasetInfo& info = source->info();
  EXPECT_EQ(info.grid.dims(), (std::array<int, 3>{14, 25, 8}));
  EXPECT_DOUBLE_EQ(info.grid.axes[0].coordinates[13], 13 * 4153.846);
  EXPECT_DOUBLE_EQ(info.grid.axes[1].coordinates[24], 24 * 4166.667);
  EXPECT_DOUBLE_EQ(info.grid.axes[2].coordinates[7], 7 * 2214.286);
  EXPECT_THAT(info.notes, Contains(HasSubstr("y is interpreted as vertical")));
  const Volume wind = volume_of(*source, "wind");
  ASSERT_EQ(wind.components, 3);
  EXPECT_EQ(wind.masked, 0);
  const std::size_t at = 5 + 14 * (3 + 25 * 2);  // i 3, j 5, k 2
  EXPECT_EQ(wind.component(0)[at], 10.208183288574219F);
  EXPECT_EQ(wind.component(1)[at], 8.771589279174805F);
  EXPECT_EQ(wind.component(2)[at], -0.9240704774856567F);
  EXPECT_FLOAT_EQ(wind.range[0], 0.9411481467108312F);
  EXPECT_FLOAT_EQ(wind.range[1], 53.89473851781615F);
}

TEST(DxStorm, ScalarsOfTheSameFile) {
  struct Expected {
    const char* name;
    float low;
    float high;
    float here;
    std::size_t highest;  // index in the file
  };
  for (const auto& e : {Expected{"cloudwater", -9.733548012036408e-08F, 4.17122220993042F,
                                 0.009073959663510323F, 954},
                        Expected{"rainwater", -2.0129787117184605e-06F, 11.510653495788574F,
                                 1.7056794376912876e-07F, 956},
                        Expected{"temperature", -17.251976013183594F, 13.991945266723633F,
                                 2.2322998046875F, 1078}}) {
    const auto source = opened(dx_sample(std::string(e.name) + ".dx"));
    ASSERT_TRUE(source);
    const Volume volume = volume_of(*source, e.name);
    EXPECT_EQ(volume.range, (std::array<float, 2>{e.low, e.high})) << e.name;
    EXPECT_EQ(volume.values.data()[5 + 14 * (3 + 25 * 2)], e.here) << e.name;
    const std::size_t i = e.highest / (14 * 8);
    const std::size_t j = e.highest / 8 % 14;
    const std::size_t k = e.highest % 8;
    EXPECT_EQ(volume.values.data()[j + 14 * (i + 25 * k)], e.high) << e.name;
    EXPECT_EQ(volume.masked, 0);
  }
}

TEST(DxStorm, OtherSamplesOfThePackage) {
  auto source = opened(dx_sample("watermolecule.dx"));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().grid.dims(), (std::array<int, 3>{40, 60, 20}));
  const Volume density = volume_of(*source, "electron density");
  EXPECT_EQ(density.range[1], 9.63576F);
  EXPECT_EQ(density.values.data()[7 + 40 * (11 + 60 * 5)], 0.000188F);
  source = opened(dx_sample("series.dx"));
  ASSERT_TRUE(source);
  ASSERT_EQ(source->info().steps.size(), 3U);
  EXPECT_EQ(source->info().steps[2].value, 30);
  EXPECT_EQ(values_of(*source, "series", 1)[0], 1.7F);
  EXPECT_EQ(values_of(*source, "series", 1)[1], 4.2F);  // the innermost index runs along x
}

}  // namespace
}  // namespace windsplat::data
