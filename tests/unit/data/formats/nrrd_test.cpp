// NRRD: every encoding and layout, from bytes written here; expected values follow from the
// definition of the format (teem's documentation of nrrd).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "server/data/open/open.hpp"
#include "tests/unit/data/formats/plain_maker.hpp"

namespace windsplat::data {
namespace {

using test::counted;
using test::floats;
using test::Folder;
using test::gzipped;
using test::opened;
using test::packed;
using test::refusal;
using test::values_of;
using test::write_file;
using testing::ElementsAre;
using testing::HasSubstr;

using Doubles = std::vector<double>;

std::string header(const std::string& fields) {
  return std::string("NRRD0005\n# made by a test\n") + fields;
}

const std::string plain_2x3x2 = "dimension: 3\nsizes: 2 3 2\ntype: float\nendian: little\n";

TEST(Nrrd, RawSamplesAreFastestFirst) {
  const Folder folder;
  write_file(folder / "a.nrrd", header(plain_2x3x2 + "encoding: raw\ncontent: a title\n\n") +
                                    packed<float>(counted(12)));
  const auto source = opened(folder / "a.nrrd");
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().format, "NRRD");
  EXPECT_EQ(source->info().title, "a title");
  EXPECT_EQ(source->info().grid.dims(), (std::array<int, 3>{2, 3, 2}));
  EXPECT_EQ(source->info().steps.size(), 1U);
  ASSERT_EQ(source->info().fields.size(), 1U);
  EXPECT_EQ(source->info().fields[0].name, "a");
  EXPECT_EQ(source->info().fields[0].dtype, "float32");
  EXPECT_EQ(values_of(*source, "a"), floats(counted(12)));
}

struct TypeCase {
  const char* name;
  std::string (*bytes)(const Doubles&, bool);
  double low;
  const char* shown;
};

class NrrdType : public testing::TestWithParam<TypeCase> {};

TEST_P(NrrdType, IsReadInBothByteOrders) {
  const TypeCase& type = GetParam();
  const Folder folder;
  const Doubles values{type.low, 0, 1, 100};
  for (const bool big : {false, true}) {
    write_file(folder / "t.nrrd",
               header("dimension: 2\nsizes: 2 2\nencoding: raw\ntype: " + std::string(type.name) +
                      "\nendian: " + (big ? "big" : "little") + "\n\n") +
                   type.bytes(values, big));
    const auto source = opened(folder / "t.nrrd");
    ASSERT_TRUE(source);
    EXPECT_EQ(values_of(*source, "t"), floats(values)) << type.name << big;
    EXPECT_EQ(source->info().fields[0].dtype, type.shown);
  }
}

// -32767 and similar are fill values of netCDF; here they are values.
INSTANTIATE_TEST_SUITE_P(
    All, NrrdType,
    testing::Values(TypeCase{"signed char", packed<std::int8_t>, -128, "int8"},
                    TypeCase{"uchar", packed<std::uint8_t>, 255, "uint8"},
                    TypeCase{"short", packed<std::int16_t>, -32767, "int16"},
                    TypeCase{"unsigned short int", packed<std::uint16_t>, 65535, "uint16"},
                    TypeCase{"int", packed<std::int32_t>, -2147483647, "int32"},
                    TypeCase{"uint32_t", packed<std::uint32_t>, 4294967295, "uint32"},
                    TypeCase{"long long int", packed<std::int64_t>, -9e15, "int64"},
                    TypeCase{"ulonglong", packed<std::uint64_t>, 9e15, "uint64"},
                    TypeCase{"float", packed<float>, -1.5, "float32"},
                    TypeCase{"double", packed<double>, -1e-3, "float64"}));

TEST(Nrrd, EncodingsHoldTheSameSamples) {
  const Folder folder;
  const std::string raw = packed<float>(counted(12, 0.5));
  std::string hex;
  for (const char c : raw) {
    constexpr const char* digits = "0123456789aBcDeF";
    hex += digits[(static_cast<unsigned char>(c) >> 4) & 15];
    hex += digits[static_cast<unsigned char>(c) & 15];
    if (hex.size() % 35 == 0) hex += '\n';
  }
  std::string text;
  for (const double value : counted(12, 0.5))
    text += std::to_string(value) + (text.empty() ? " " : "\n");
  const std::vector<std::pair<std::string, std::string>> cases{
      {"gzip", gzipped(raw)},
      {"gz", gzipped(raw.substr(0, 13)) + gzipped(raw.substr(13))},  // two members
      {"hex", hex},
      {"ascii", text},
      {"text", "0\t0.5,1 1.5e0 +2 2.5 3 3.5 4 45.D-1 5.0E+0 0.55d1"},
      {"raw", raw}};
  for (const auto& [encoding, data] : cases) {
    write_file(folder / "e.nrrd", header(plain_2x3x2 + "encoding: " + encoding + "\n\n") + data);
    const auto source = opened(folder / "e.nrrd");
    ASSERT_TRUE(source);
    EXPECT_EQ(values_of(*source, "e"), floats(counted(12, 0.5))) << encoding;
  }
}

// Bytes are skipped independently of their meaning; lines are skipped first.
TEST(Nrrd, LinesAndBytesBeforeEncodedDataAreSkipped) {
  const Folder folder;
  for (const auto& [encoding, data] :
       std::vector<std::pair<std::string, std::string>>{{"hex", "00010203"}, {"text", "0 1 2 3"}}) {
    write_file(folder / "e.nrrd",
               header("dimension: 2\nsizes: 2 2\ntype: uchar\nline skip: 2\nbyte skip: 3\n"
                      "encoding: " +
                      encoding + "\n\n") +
                   "7 7\n\n8 9" + data);
    const auto source = opened(folder / "e.nrrd");
    ASSERT_TRUE(source);
    EXPECT_EQ(values_of(*source, "e"), floats({0, 1, 2, 3})) << encoding;
  }
}

TEST(Nrrd, NanIsMasked) {
  const Folder folder;
  write_file(folder / "m.nrrd",
             header("dimension: 2\nsizes: 2 2\ntype: float\nencoding: ascii\n\n1 nan -inf 4\n"));
  const auto source = opened(folder / "m.nrrd");
  ASSERT_TRUE(source);
  EXPECT_EQ(test::volume_of(*source, "m").masked, 2);
}

// A long series in one gzip stream: steps read in any order have the right values.
TEST(Nrrd, StepsOfAGzipStreamAreReadInAnyOrder) {
  const Folder folder;
  constexpr std::size_t steps = 20;
  constexpr std::size_t cube = 64 * 64 * 64;  // 1 MiB of floats per step
  std::string raw;
  for (std::size_t step = 0; step < steps; ++step) {
    raw += packed<float>(counted(cube, static_cast<double>(step)));
  }
  write_file(folder / "s.nrrd",
             header("dimension: 4\nsizes: 64 64 64 20\nkinds: domain domain domain time\n"
                    "type: float\nendian: little\nencoding: gzip\n"
                    "axis mins: nan nan nan 5\nspacings: nan nan nan 2\n"
                    "centers: none none none node\n\n") +
                 gzipped(raw));
  const auto source = opened(folder / "s.nrrd");
  ASSERT_TRUE(source);
  ASSERT_EQ(source->info().steps.size(), steps);
  EXPECT_EQ(source->info().steps[3].value, 11);
  for (const std::size_t step : {19UL, 0UL, 7UL, 6UL, 7UL, 15UL, 1UL}) {
    EXPECT_EQ(values_of(*source, "s", step), floats(counted(cube, static_cast<double>(step))));
  }
}

TEST(Nrrd, SpacingsAndBoundsPlaceSamples) {
  const Folder folder;
  write_file(
      folder / "p.nrrd",
      header(plain_2x3x2 +
             "encoding: raw\nspacings: 2 nan -0.5\naxis mins: nan 10 nan\n"
             "axis maxs: nan 40 nan\ncenters: node cell node\nunits: \"mm\" \"m\" \"km\"\n\n") +
          packed<float>(counted(12)));
  const auto source = opened(folder / "p.nrrd");
  ASSERT_TRUE(source);
  const auto& [x, y, z] = source->info().grid.axes;
  EXPECT_EQ(x.coordinates, (Doubles{0, 2}));
  EXPECT_EQ(y.coordinates, (Doubles{15, 25, 35}));  // three cells between 10 and 40
  EXPECT_EQ(z.coordinates, (Doubles{-0.5, 0}));     // reversed to ascend
  EXPECT_EQ(x.units, "mm");
  EXPECT_EQ(z.units, "km");
  EXPECT_EQ(values_of(*source, "p")[0], 6);
}

// Left-posterior-superior: x and y are reversed, as are the first two components of vectors.
TEST(Nrrd, AnatomicalSpaceIsReoriented) {
  const Folder folder;
  write_file(folder / "v.nrrd",
             header("dimension: 4\nsizes: 3 2 2 2\ntype: double\nendian: big\nencoding: raw\n"
                    "kinds: 3-vector space space space\nspace: left-posterior-superior\n"
                    "space directions: none (2,0,0) (0,3,0) (0,0,4)\nspace origin: (10,20,30)\n"
                    "space units: \"mm\" \"mm\" \"cm\"\n\n") +
                 packed<double>(counted(24), true));
  const auto source = opened(folder / "v.nrrd");
  ASSERT_TRUE(source);
  const auto& [x, y, z] = source->info().grid.axes;
  EXPECT_EQ(x.coordinates, (Doubles{-12, -10}));
  EXPECT_EQ(y.coordinates, (Doubles{-23, -20}));
  EXPECT_EQ(z.coordinates, (Doubles{30, 34}));
  EXPECT_EQ(z.units, "cm");
  const FieldInfo* field = source->info().find("v");
  ASSERT_NE(field, nullptr);
  EXPECT_EQ(field->kind, FieldKind::vector);
  EXPECT_EQ(field->components.size(), 3U);
  // World (0, 0, 0) is file (1, 1, 0): samples 9, 10, 11.
  const auto values = values_of(*source, "v");
  EXPECT_EQ(values[0], -9);
  EXPECT_EQ(values[8], -10);
  EXPECT_EQ(values[16], 11);
  EXPECT_THAT(source->info().notes, testing::Contains(HasSubstr("left-posterior-superior")));
}

TEST(Nrrd, DirectionsIdentifyAxes) {
  const Folder folder;
  write_file(folder / "d.nrrd",
             header("dimension: 3\nsizes: 2 3 4\ntype: uint8\nencoding: raw\n"
                    "space: right-anterior-superior\n"
                    "space directions: (0,0,2) (5,0,0) (0,-1,0)\nspace origin: (0,9,0)\n\n") +
                 packed<std::uint8_t>(counted(24)));
  const auto source = opened(folder / "d.nrrd");
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().grid.dims(), (std::array<int, 3>{3, 4, 2}));
  EXPECT_EQ(source->info().grid.axes[1].coordinates, (Doubles{6, 7, 8, 9}));
  const auto values = values_of(*source, "d");
  EXPECT_EQ(values[0], 18);      // x 0, y 6 (the last in the file), z 0
  EXPECT_EQ(values[1], 20);      // x 5
  EXPECT_EQ(values[3 * 4], 19);  // z 2
}

TEST(Nrrd, ObliqueAxesKeepTheirSpacingWithANote) {
  const Folder folder;
  write_file(folder / "o.nrrd",
             header("dimension: 3\nsizes: 2 2 2\ntype: uint8\nencoding: raw\nspace dimension: 3\n"
                    "space directions: (3,4,0) (-4,3,0) (0,0,1)\n\n") +
                 packed<std::uint8_t>(counted(8)));
  const auto source = opened(folder / "o.nrrd");
  ASSERT_TRUE(source);
  for (const std::size_t a : {0UL, 1UL}) {
    const auto& axis = source->info().grid.axes[a].coordinates;
    EXPECT_DOUBLE_EQ(axis[1] - axis[0], 5);
  }
  EXPECT_THAT(source->info().notes, testing::Contains(HasSubstr("obliquely")));
}

TEST(Nrrd, ComponentsMayComeLast) {
  const Folder folder;
  write_file(folder / "c.nrrd",
             header("dimension: 4\nsizes: 2 2 2 2\nkinds: domain domain domain vector\n"
                    "type: uint8\nencoding: raw\n\n") +
                 packed<std::uint8_t>(counted(16)));
  const auto source = opened(folder / "c.nrrd");
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().find("c")->components.size(), 2U);
  EXPECT_EQ(values_of(*source, "c"), floats(counted(16)));
}

TEST(Nrrd, WithoutKindsTheOuterAxesAreInferred) {
  const Folder folder;
  write_file(folder / "g.nrrd", header("dimension: 5\nsizes: 3 2 2 2 4\ntype: uint8\n"
                                       "encoding: raw\n\n") +
                                    packed<std::uint8_t>(counted(96)));
  const auto source = opened(folder / "g.nrrd");
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().find("g")->components.size(), 3U);
  EXPECT_EQ(source->info().steps.size(), 4U);
  EXPECT_EQ(values_of(*source, "g", 2)[8], 49);  // second component of the third step
  EXPECT_EQ(source->info().notes.size(), 2U);
}

TEST(Nrrd, DetachedDataOneFilePatternAndList) {
  const Folder folder;
  const std::string raw = packed<float>(counted(12));
  const std::string fields = plain_2x3x2 + "encoding: raw\n";
  write_file(folder / "one.nhdr", header(fields + "byte skip: 5\ndata file: sub/one.raw\n"));
  write_file(folder / "sub/one.raw", std::string("12345") + raw);
  write_file(folder / "end.nhdr", header(fields + "byte skip: -1\ndatafile: end.raw\n"));
  write_file(folder / "end.raw", std::string("anything") + raw);
  write_file(folder / "many.nhdr", header(fields + "line skip: 1\ndata file: m%03d.raw 7 9 2\n"));
  write_file(folder / "list.nhdr",
             header(fields + "line skip: 1\ndata file: LIST\nm007.raw\n./m009.raw\n"));
  write_file(folder / "rows.nhdr", header(fields + "data file: r%d.raw 6 1 -1 1\n"));
  write_file(folder / "m007.raw", std::string("line\n") + raw.substr(0, 24));
  write_file(folder / "m009.raw", std::string("another\n") + raw.substr(24));
  for (std::size_t i = 0; i < 6; ++i) {
    write_file(folder / (std::string("r") + std::to_string(6 - i) + ".raw"), raw.substr(8 * i, 8));
  }
  for (const std::string name : {"one", "end", "many", "list", "rows"}) {
    const auto source = opened(folder / (name + ".nhdr"));
    ASSERT_TRUE(source) << name;
    EXPECT_EQ(values_of(*source, name), floats(counted(12))) << name;
  }
}

TEST(Nrrd, FilesOfAPatternAreSteps) {
  const Folder folder;
  for (const int n : {1, 2, 3}) {
    write_file(folder / ("smoke_00" + std::to_string(n) + ".nrrd"),
               header(plain_2x3x2 + "encoding: raw\n\n") + packed<float>(counted(12, n)));
  }
  const auto source = opened(folder / "smoke_*.nrrd");
  ASSERT_TRUE(source);
  ASSERT_EQ(source->info().steps.size(), 3U);
  EXPECT_EQ(values_of(*source, "smoke", 2), floats(counted(12, 3)));
}

TEST(Nrrd, DataFilesOutsideTheFolderAreRefused) {
  const Folder folder;
  const std::string fields = plain_2x3x2 + "encoding: raw\ndata file: ";
  write_file(folder / "secret.raw", packed<float>(counted(12)));
  std::filesystem::create_directories(folder / "in");
  std::filesystem::create_symlink("../secret.raw", folder / "in/link.raw");
  for (const std::string& name :
       {std::string("../secret.raw"), folder / "secret.raw", std::string("link.raw")}) {
    write_file(folder / "in/out.nhdr", header(fields + name + "\n"));
    EXPECT_THAT(refusal(folder / "in/out.nhdr"), HasSubstr("outside the dataset's folder")) << name;
  }
}

TEST(Nrrd, BytesAfterTheSamplesAreReported) {
  const Folder folder;
  const std::string raw = packed<float>(counted(12));
  const std::string fields = plain_2x3x2 + "encoding: raw\n";
  write_file(folder / "a.nrrd", header(fields + "\n") + raw + "12345");
  EXPECT_THAT(opened(folder / "a.nrrd")->info().notes,
              testing::Contains("5 bytes after the last step are not described"));
  // Two files, one of them too long; data that extend to the end of the file have no trailing
  // bytes.
  write_file(folder / "b.nhdr", header(fields + "data file: LIST\nb0\nb1\n"));
  write_file(folder / "b0", raw.substr(0, 24));
  write_file(folder / "b1", raw.substr(24) + "123");
  EXPECT_THAT(opened(folder / "b.nhdr")->info().notes,
              testing::Contains("3 bytes after the last step are not described"));
  write_file(folder / "c.nhdr", header(fields + "byte skip: -1\ndata file: c\n"));
  write_file(folder / "c", "in front" + raw);
  EXPECT_TRUE(opened(folder / "c.nhdr")->info().notes.empty());
  std::filesystem::remove(folder / "c");
  const auto absent = open_file(folder / "c.nhdr");
  ASSERT_FALSE(absent);
  EXPECT_EQ(absent.error().kind, ErrorKind::not_found);
  EXPECT_THAT(absent.error().message, HasSubstr("'c', referred to by 'c.nhdr', is missing"));
}

TEST(Nrrd, ChangedDataFilesAreDetected) {
  const Folder folder;
  write_file(folder / "c.nhdr", header("dimension: 2\nsizes: 2 6\ntype: uint8\nencoding: raw\n"
                                       "data file: c%d.raw 0 5 1\n"));
  for (int i = 0; i < 6; ++i)
    write_file(folder / (std::string("c") + std::to_string(i) + ".raw"), "ab");
  const auto source = opened(folder / "c.nhdr");
  ASSERT_TRUE(source);
  write_file(folder / "c3.raw", "abc");
  const auto volume = source->read(0, 0);
  ASSERT_FALSE(volume);
  EXPECT_THAT(volume.error().message, HasSubstr("has changed"));
}

struct BadNrrdCase {
  const char* name;
  std::string fields;
  std::string data;
  const char* reason;
};

class NrrdRefusal : public testing::TestWithParam<BadNrrdCase> {};

TEST_P(NrrdRefusal, NamesItsReason) {
  const Folder folder;
  write_file(folder / "bad.nrrd", header(GetParam().fields + "\n") + GetParam().data);
  EXPECT_THAT(refusal(folder / "bad.nrrd"), HasSubstr(GetParam().reason));
}

const std::string small = "dimension: 2\nsizes: 2 2\ntype: uint8\n";
const std::string huge_sizes =
    "dimension: 3\nsizes: 4294967295 4294967295 4294967295\ntype: float\n";

INSTANTIATE_TEST_SUITE_P(
    All, NrrdRefusal,
    testing::Values(
        BadNrrdCase{"short", small + "encoding: raw\n", "abc",
                    "has 3 bytes of data; its header requires 4"},
        BadNrrdCase{"huge", huge_sizes + "endian: big\nencoding: raw\n", "abcd", "2^62"},
        BadNrrdCase{
            "overflow",
            "dimension: 5\nsizes: 16777216 16777216 16777216 3 1\nkinds: domain domain domain "
            "vector time\ntype: double\nendian: big\nencoding: raw\n",
            "abcd", "2^62"},
        BadNrrdCase{
            "many",
            "dimension: 3\nsizes: 100000 100000 1000\ntype: float\nendian: big\nencoding: gzip\n",
            "abcd", "cannot hold"},
        BadNrrdCase{"negative", "dimension: 2\nsizes: -2 2\ntype: uint8\nencoding: raw\n", "abcd",
                    "line 4 (sizes): '-2' is not a size"},
        BadNrrdCase{"zero", "dimension: 2\nsizes: 0 2\ntype: uint8\nencoding: raw\n", "abcd",
                    "is not a size"},
        BadNrrdCase{"counts", "dimension: 2\nsizes: 2 2 2\ntype: uint8\nencoding: raw\n",
                    "abcdefgh", "3 entries for 2 axes"},
        BadNrrdCase{"dimension", "dimension: 99999999999\nsizes: 2 2\n", "abcd", "must be 1 to 16"},
        BadNrrdCase{"no_sizes", "dimension: 2\ntype: uint8\nencoding: raw\n", "abcd",
                    "no field 'sizes'"},
        BadNrrdCase{"no_endian", "dimension: 2\nsizes: 2 2\ntype: short\nencoding: raw\n",
                    "abcdefgh", "no field 'endian'"},
        BadNrrdCase{"block",
                    "dimension: 2\nsizes: 2 2\ntype: block\nblock size: 3\nencoding: raw\n", "abcd",
                    "type block"},
        BadNrrdCase{"bzip2", small + "encoding: bzip2\n", "abcd", "bzip2 is not supported"},
        BadNrrdCase{"colors",
                    "dimension: 3\nsizes: 3 2 2\nkinds: RGB-color domain domain\ntype: uint8\n"
                    "encoding: raw\n",
                    "abcdefghijkl", "'rgb-color'"},
        BadNrrdCase{"tensor",
                    "dimension: 4\nsizes: 6 2 2 2\nkinds: 3D-symmetric-matrix space space space\n"
                    "type: uint8\nencoding: raw\n",
                    std::string(48, 't'), "neither space, time nor"},
        BadNrrdCase{"byte_skip", small + "byte skip: 9223372036854775807\nencoding: raw\n", "abcd",
                    "truncated"},
        BadNrrdCase{"line_skip", small + "line skip: 9223372036854775807\nencoding: raw\n",
                    "ab\ncd", "fewer lines"},
        BadNrrdCase{"no_direction",
                    "dimension: 2\nsizes: 2 2\ntype: uint8\nencoding: raw\n"
                    "space directions: (1,0) (nan,1)\n",
                    "abcd", "finite"},
        BadNrrdCase{"no_line", small + "encoding raw\n", "abcd", "neither a field nor a comment"}),
    [](const auto& test) { return std::string(test.param.name); });

// Truncated or overwritten data yield an error, without an invalid read.
TEST(NrrdRefusal, BrokenDataAreDetectedWhenRead) {
  const Folder folder;
  const std::string good = gzipped(packed<float>(counted(12)));
  std::string damaged = good;
  damaged[good.size() / 2] = static_cast<char>(~damaged[good.size() / 2]);
  for (const auto& [encoding, data] : std::vector<std::pair<std::string, std::string>>{
           {"gzip", good.substr(0, good.size() / 2)},
           {"gzip", damaged},
           {"ascii", "0 1 2 3 4 five 6 7 8 9 10 11 12 13"},
           {"ascii", "0 1 2 3 4 5 6 7 8 9 10                 "},
           {"hex", std::string(95, '0') + " "},
           {"hex", std::string(95, '0') + "g"}}) {
    write_file(folder / "b.nrrd", header(plain_2x3x2 + "encoding: " + encoding + "\n\n") + data);
    auto source = open_file(folder / "b.nrrd");
    if (!source) continue;  // fewer bytes than required
    const auto volume = (*source)->read(0, 0);
    ASSERT_FALSE(volume) << encoding << ' ' << data;
    EXPECT_EQ(volume.error().kind, ErrorKind::bad_data);
    EXPECT_THAT(volume.error().message,
                testing::AnyOf(HasSubstr("truncated"), HasSubstr("damaged")));
  }
}

}  // namespace
}  // namespace windsplat::data
