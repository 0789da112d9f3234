// GrADS descriptors: small ones with data made here, and model.ctl of Debian's package grads, whose
// expected values come from a script that reads model.dat with Python's struct module:
//   v = struct.unpack("<596160f", open("model.dat", "rb").read()) A time consists of PS, seven
//   levels each of U V Z T, five of Q, TS and P, 46 x 72 samples each.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "server/data/open/open.hpp"
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
using test::write_file;
using testing::Contains;
using testing::HasSubstr;

using Doubles = std::vector<double>;

// 3 x 2 samples on 2 levels, 2 times.
std::string descriptor(const std::string& more, const std::string& variables,
                       const std::string& dset = "^d.dat") {
  std::string out("* a test\nDSET ");
  out += dset;
  out +=
      "\nTitle Made here\nundef -999\nxdef 3 linear 10 5\nydef 2 levels\n -30\n 40\n"
      "zdef 2 levels 1000 500\n";
  out += more;
  out += "\nvars " + variables + "\nendvars\n";
  return out;
}

const std::string two_days = "tdef 2 linear 06Z28FEB2000 1dy";
const std::string one_u = "1\nu 2 99 wind [m/s]";

TEST(Grads, RecordsAreOrderedByTimeVariableAndLevel) {
  const Folder folder;
  write_file(folder / "d.ctl", descriptor(two_days,
                                          "3\nps 0 99 pressure\nu 2 99 wind [m/s]\n"
                                          "t 1 99 temperature (K)"));
  write_file(folder / "d.dat", packed<float>(counted(48)));
  const auto source = opened(folder / "d.ctl");
  ASSERT_TRUE(source);
  const DatasetInfo& info = source->info();
  EXPECT_EQ(info.format, "GrADS");
  EXPECT_EQ(info.title, "Made here");
  EXPECT_EQ(info.grid.axes[0].kind, AxisKind::longitude);
  EXPECT_EQ(info.grid.axes[0].coordinates, (Doubles{10, 15, 20}));
  EXPECT_EQ(info.grid.axes[1].coordinates, (Doubles{-30, 40}));
  EXPECT_EQ(info.grid.axes[2].kind, AxisKind::pressure);
  EXPECT_EQ(info.grid.axes[2].units, "hPa");
  EXPECT_EQ(info.steps[0].text, "2000-02-28T06:00:00Z");
  EXPECT_EQ(info.steps[1].text, "2000-02-29T06:00:00Z");
  EXPECT_EQ(info.find("u")->units, "m/s");
  EXPECT_EQ(info.find("t")->units, "K");
  EXPECT_THAT(info.left_out,
              Contains(testing::Field(&LeftOut::name, "ps")));  // not on a level: another grid
  Doubles second = counted(12);
  for (double& value : second) value += 24 + 6;
  EXPECT_EQ(values_of(*source, "u", 1), floats(second));
  // One of two levels: the upper one is masked.
  const auto t = values_of(*source, "t", 0);
  EXPECT_EQ(t[0], 18);
  EXPECT_EQ(t[5], 23);
  for (std::size_t i = 6; i < 12; ++i) EXPECT_TRUE(std::isnan(t[i]));
}

TEST(Grads, UndefIsMasked) {
  const Folder folder;
  Doubles values = counted(24);
  values[5] = -999;
  write_file(folder / "d.ctl", descriptor(two_days, one_u));
  write_file(folder / "d.dat", packed<float>(values));
  const auto source = opened(folder / "d.ctl");
  ASSERT_TRUE(source);
  EXPECT_EQ(test::volume_of(*source, "u", 0).masked, 1);
  EXPECT_EQ(test::volume_of(*source, "u", 1).masked, 0);
}

// GrADS masks values within a hundred thousandth of undef on both sides.
TEST(Grads, RoundedUndefIsMasked) {
  const Folder folder;
  Doubles values = counted(24);
  values[4] = -999.00995;
  values[5] = -998.99005;
  values[6] = -999.0101;
  values[7] = -998.9899;
  write_file(folder / "d.ctl", descriptor(two_days, one_u));
  write_file(folder / "d.dat", packed<float>(values));
  const auto source = opened(folder / "d.ctl");
  ASSERT_TRUE(source);
  const auto u = values_of(*source, "u");
  EXPECT_TRUE(std::isnan(u[4]));
  EXPECT_TRUE(std::isnan(u[5]));
  EXPECT_EQ(u[6], -999.0101F);
  EXPECT_EQ(u[7], -998.9899F);
}

// Rows from the north and levels from above: the result is the same as without the options.
TEST(Grads, ReversedRowsAndLevels) {
  const Folder folder;
  write_file(folder / "d.ctl",
             descriptor(two_days + "\noptions yrev zrev", "2\nu 2 99 u\nq 1 99 lower only"));
  write_file(folder / "d.dat", packed<float>(counted(36)));
  const auto source = opened(folder / "d.ctl");
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().grid.axes[1].coordinates, (Doubles{-30, 40}));
  EXPECT_EQ(source->info().grid.axes[2].coordinates, (Doubles{1000, 500}));
  EXPECT_EQ(values_of(*source, "u"), floats({9, 10, 11, 6, 7, 8, 3, 4, 5, 0, 1, 2}));
  const auto q = values_of(*source, "q");
  EXPECT_EQ(q[0], 15);
  EXPECT_TRUE(std::isnan(q[6]));
}

TEST(Grads, ByteOrdersAndHeaders) {
  const Folder folder;
  const Doubles values = counted(24);
  const auto part = [&](std::size_t from, bool big) {
    return packed<float>({values.begin() + static_cast<std::ptrdiff_t>(from),
                          values.begin() + static_cast<std::ptrdiff_t>(from) + 6},
                         big);
  };
  // Fortran records of 24 bytes.
  std::string sequential;
  std::string records;  // the header of a time is a record, that of a grid is within its record
  std::string headed = "file";
  for (std::size_t r = 0; r < 4; ++r) {
    const std::string count = packed<std::int32_t>({24}, true);
    sequential += count + part(6 * r, true) + count;
    if (r % 2 == 0) {
      headed += "time-";
      const std::string five = packed<std::int32_t>({5}, true);
      records += five + "time-" + five;
    }
    const std::string longer = packed<std::int32_t>({26}, true);
    records += longer + "xy" + part(6 * r, true) + longer;
    headed += std::string("xy") + part(6 * r, false);
    headed += "t";
    if (r % 2 == 1) headed += "end";
  }
  const std::vector<std::pair<std::string, std::string>> cases{
      {"options little_endian", packed<float>(values)},
      {"options BIG_ENDIAN", packed<float>(values, true)},
      {"options byteswapped", packed<float>(values, true)},
      {"options sequential big_endian", sequential},
      {"theader 5\nxyheader 2\noptions sequential big_endian", records},
      {"fileheader 4\ntheader 5\nxyheader 2\nxytrailer 1\ntrailerbytes 3", headed}};
  for (const auto& [options, data] : cases) {
    write_file(folder / "d.ctl", descriptor(two_days + "\n" + options, one_u));
    write_file(folder / "d.dat", data);
    const auto source = opened(folder / "d.ctl");
    ASSERT_TRUE(source) << options;
    EXPECT_EQ(values_of(*source, "u", 1), floats({values.begin() + 12, values.end()})) << options;
  }
}

TEST(Grads, ExtraBytesAreWholeStepsOrRefused) {
  const Folder folder;
  write_file(folder / "d.ctl", descriptor(two_days, one_u));
  write_file(folder / "d.dat", packed<float>(counted(24)));
  const std::size_t notes = opened(folder / "d.ctl")->info().notes.size();
  write_file(folder / "d.dat", packed<float>(counted(36)));
  auto source = opened(folder / "d.ctl");
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().notes.size(), notes + 1);
  EXPECT_THAT(source->info().notes, Contains("'d.dat' has 1 more step than described"));
  write_file(folder / "d.dat", packed<float>(counted(26)));
  EXPECT_THAT(refusal(folder / "d.ctl"), HasSubstr("has 104 bytes, 'd.ctl' describes 96"));

  // Files of a template may differ in length.
  write_file(folder / "t.ctl", descriptor(two_days + "\noptions template", one_u, "^t%d2.dat"));
  write_file(folder / "t28.dat", packed<float>(counted(12)));
  write_file(folder / "t29.dat", packed<float>(counted(13)));
  source = opened(folder / "t.ctl");
  ASSERT_TRUE(source);
  EXPECT_THAT(source->info().notes, Contains(HasSubstr("4 bytes after the last steps")));
}

TEST(Grads, MissingFileIsReportedWithItsReference) {
  const Folder folder;
  write_file(folder / "d.ctl", descriptor(two_days, one_u));
  write_file(folder / "t.ctl", descriptor(two_days + "\noptions template", one_u, "^t%d2.dat"));
  const auto plain = open_file(folder / "d.ctl");
  const auto counted_on = open_file(folder / "t.ctl");
  ASSERT_FALSE(plain);
  ASSERT_FALSE(counted_on);
  EXPECT_EQ(plain.error().kind, ErrorKind::not_found);
  EXPECT_THAT(plain.error().message, HasSubstr("'d.dat', referred to by 'd.ctl', is missing"));
  EXPECT_THAT(counted_on.error().message,
              HasSubstr("'t28.dat', referred to by 't.ctl', is missing"));
}

TEST(Grads, OtherByteOrdersAndIntegers) {
  const Folder folder;
  // All times of u, then of v.
  write_file(folder / "d.ctl", descriptor(two_days, "2\nu 2 -1,20 u\nv 2 -1,20 v"));
  write_file(folder / "d.dat", packed<float>(counted(48)));
  auto source = opened(folder / "d.ctl");
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().first(FieldKind::vector)->name, "wind");
  EXPECT_EQ(values_of(*source, "wind", 1)[0], 12);
  EXPECT_EQ(values_of(*source, "wind", 1)[12], 36);
  // y fastest: the sample (x 1, y 0) is the third.
  write_file(folder / "d.ctl", descriptor(two_days, "1\nu 2 -1,30 u"));
  source = opened(folder / "d.ctl");
  ASSERT_TRUE(source);
  EXPECT_EQ(values_of(*source, "u")[1], 2);
  EXPECT_EQ(values_of(*source, "u")[3], 1);
  // Numbers of 1, 2 and 4 bytes in sequence.
  const auto values = [](double first) {
    Doubles out = counted(12);
    for (double& value : out) value += first;
    return out;
  };
  write_file(folder / "d.ctl",
             descriptor("tdef 1 linear 1jan90 1mo",
                        "4\na 2 -1,40,1 a\nb 2 -1,40,2,-1 b\nc 2 -1,40,2 c\nd 2 -1,40,4 d"));
  write_file(folder / "d.dat",
             packed<std::uint8_t>(values(240)) + packed<std::int16_t>(values(-32767)) +
                 packed<std::uint16_t>(values(65000)) + packed<std::int32_t>(values(-100000)));
  source = opened(folder / "d.ctl");
  ASSERT_TRUE(source);
  EXPECT_EQ(values_of(*source, "a"), floats(values(240)));
  EXPECT_EQ(values_of(*source, "b"), floats(values(-32767)));
  EXPECT_EQ(values_of(*source, "c"), floats(values(65000)));
  EXPECT_EQ(values_of(*source, "d"), floats(values(-100000)));
}

// One file of daily steps per month: steps every 28 days from the 31st of January, so one day in
// the first file, then two.
TEST(Grads, TemplatesJoinFilesOfUnequalLength) {
  const Folder folder;
  write_file(folder / "d.ctl", descriptor("tdef 4 linear 31jan1999 1dy\noptions template", one_u,
                                          "^in/%y4/u_%mc%m2_%iy2.dat"));
  write_file(folder / "in/1999/u_jan01_99.dat", packed<float>(counted(12, 1)));
  Doubles rest = counted(36, 2);
  write_file(folder / "in/1999/u_feb02_99.dat", packed<float>(rest));
  const auto source = opened(folder / "d.ctl");
  ASSERT_TRUE(source);
  EXPECT_EQ(values_of(*source, "u", 3), floats({rest.begin() + 24, rest.end()}));
  EXPECT_EQ(values_of(*source, "u", 0), floats(counted(12, 1)));
  EXPECT_EQ(source->info().steps[1].text, "1999-02-01T00:00:00Z");
}

TEST(Grads, FileOfATemplateMayBeMissing) {
  const Folder folder;
  write_file(folder / "d.ctl", descriptor("tdef 3 linear 21Z31dec1999 90mn\noptions template",
                                          one_u, "^%y4%m2%d2%h2%n2_%t2_%f3.dat"));
  write_file(folder / "199912312100_01_000.dat", packed<float>(counted(12, 1)));
  write_file(folder / "200001010000_03_003.dat", packed<float>(counted(12, 3)));
  const auto source = opened(folder / "d.ctl");
  ASSERT_TRUE(source);
  EXPECT_EQ(test::volume_of(*source, "u", 1).masked, 12);
  EXPECT_EQ(values_of(*source, "u", 2), floats(counted(12, 3)));
  EXPECT_THAT(source->info().notes, Contains(HasSubstr("1 of 3 files")));
}

TEST(Grads, CalendarsAndMonths) {
  const Folder folder;
  write_file(folder / "d.dat", packed<float>(counted(24)));
  write_file(folder / "d.ctl",
             descriptor("tdef 2 linear 28feb2000 1dy\noptions 365_day_calendar", one_u));
  auto source = opened(folder / "d.ctl");
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().steps[1].text, "2000-03-01T00:00:00Z");
  EXPECT_EQ(source->info().time_calendar, "noleap");
  write_file(folder / "d.ctl", descriptor("tdef 2 linear 12:30z31jan49 1mo", one_u));
  source = opened(folder / "d.ctl");
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().steps[1].text, "2049-02-28T12:30:00Z");
  write_file(folder / "d.ctl", descriptor("tdef 2 linear 31dec1999 2mo", one_u));
  source = opened(folder / "d.ctl");
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().steps[1].text, "2000-02-29T00:00:00Z") << "a leap year";
}

// The largest latitude of 94 is 88.542 degrees (T62); the sum of all is 0.
TEST(Grads, GaussianLatitudes) {
  const Folder folder;
  write_file(folder / "d.dat", packed<float>(counted(94 * 2)));
  write_file(folder / "d.ctl",
             "dset ^d.dat\nundef 1e20\nxdef 2 linear 0 1\nydef 94 gaust62 1\n"
             "zdef 1 linear 1 1\ntdef 1 linear jan2000 1mo\nvars 1\nt 0 99 t\n"
             "endvars\n");
  const auto source = opened(folder / "d.ctl");
  ASSERT_TRUE(source);
  const auto& y = source->info().grid.axes[1].coordinates;
  EXPECT_NEAR(y.front(), -88.541950, 1e-6);
  EXPECT_NEAR(y.back(), 88.541950, 1e-6);
  EXPECT_NEAR(y[47], 0.952368, 1e-6);
}

struct BadGradsCase {
  const char* name;
  std::string more;
  std::string variables;
  const char* reason;
};

class GradsRefusal : public testing::TestWithParam<BadGradsCase> {};

TEST_P(GradsRefusal, NamesItsReason) {
  const Folder folder;
  write_file(folder / "d.ctl", descriptor(GetParam().more, GetParam().variables));
  write_file(folder / "d.dat", packed<float>(counted(24)));
  EXPECT_THAT(refusal(folder / "d.ctl"), HasSubstr(GetParam().reason));
}

INSTANTIATE_TEST_SUITE_P(
    All, GradsRefusal,
    testing::Values(
        BadGradsCase{"short", "tdef 3 linear jan2000 1mo", one_u,
                     "has 96 bytes, but 'd.ctl' requires 144"},
        BadGradsCase{"huge",
                     "tdef 10000000 linear jan2000 1mn\nxdef 16777216 linear 0 1\n"
                     "ydef 16777216 linear 0 1",
                     one_u, "2^60"},
        BadGradsCase{"times", "tdef 99999999999 linear jan2000 1mn", one_u, "1 to 10000000"},
        BadGradsCase{"negative", two_days + "\nxdef -3 linear 0 1", one_u, "line 11 (xdef)"},
        BadGradsCase{"late", "tdef 2 linear jan9999 1yr", one_u, "year 9999"},
        BadGradsCase{"date", "tdef 2 linear 31feb2000 1yr", one_u, "is not a time"},
        BadGradsCase{"increment", "tdef 2 linear jan2000 1xx", one_u, "is not an increment"},
        BadGradsCase{"netcdf", two_days + "\ndtype netcdf", one_u, "data of type 'netcdf'"},
        BadGradsCase{"pdef", two_days + "\npdef 9 9 lcc 1 2 3", one_u, "map projection"},
        BadGradsCase{"ensemble", two_days + "\nedef 4 names 1 2 3 4", one_u, "ensemble"},
        BadGradsCase{"gauss", two_days + "\nydef 2 mom32 1", one_u, "'mom32' is none of"},
        BadGradsCase{"levels", two_days, "1\nu 3 99 u", "has 3 levels, but zdef has 2"},
        BadGradsCase{"count", two_days, "3\nu 2 99 u", "1 of 3 variables"},
        BadGradsCase{"sequential", two_days + "\noptions sequential\ntdef 1 linear jan2000 1mo",
                     one_u, "is not sequential"},
        BadGradsCase{"few", two_days + "\nzdef 5 levels 1 2 3", one_u, "is not one of 5 levels"},
        BadGradsCase{"order", two_days, "1\nu 2 -1,10,1 u", "'-1,10,1' is not supported"},
        BadGradsCase{"template", two_days + "\noptions template\ndset ^d%q.dat", one_u, "'%q.da'"}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(GradsRefusal, DataOutsideTheFolder) {
  const Folder folder;
  write_file(folder / "d.dat", packed<float>(counted(24)));
  for (const std::string& name : {std::string("^../d.dat"), folder / "d.dat"}) {
    write_file(folder / "in/d.ctl", descriptor(two_days, one_u, name));
    EXPECT_THAT(refusal(folder / "in/d.ctl"), HasSubstr("outside the dataset's folder")) << name;
  }
}

class GradsModel : public testing::Test {
 protected:
  void SetUp() override {
    const char* folder = std::getenv("WINDSPLAT_TEST_DATA");
    const std::string path =
        (folder != nullptr ? std::string(folder)
                           : std::string(WINDSPLAT_SOURCE_DIR) + "/build/test-data") +
        "/model.ctl";
    ASSERT_TRUE(std::filesystem::exists(path)) << path << ": run scripts/fetch-test-data";
    source_ = opened(path);
    ASSERT_TRUE(source_);
  }
  std::unique_ptr<Source> source_;
};

TEST_F(GradsModel, AxesAndFields) {
  const DatasetInfo& info = source_->info();
  EXPECT_EQ(info.grid.dims(), (std::array<int, 3>{72, 46, 7}));
  EXPECT_EQ(info.grid.axes[0].coordinates.back(), 355);
  EXPECT_EQ(info.grid.axes[1].coordinates.front(), -90);
  EXPECT_EQ(info.grid.axes[2].coordinates, (Doubles{1000, 850, 700, 500, 300, 200, 100}));
  EXPECT_EQ(info.steps.size(), 5U);
  EXPECT_EQ(info.steps[4].text, "1987-01-06T00:00:00Z");
  EXPECT_EQ(info.find("wind")->components, (std::vector<std::string>{"U", "V"}));
  EXPECT_THAT(info.notes, Contains(HasSubstr("'Q' has 5 of 7 levels")));
}

TEST_F(GradsModel, RangesAndMaskedCountsOfTheFirstAndLastTime) {
  struct Expected {
    const char* field;
    std::size_t step;
    float low;
    float high;
    std::int64_t masked;  // of 23184; Q lacks 6624
  };
  for (const auto& e : {Expected{"U", 0, -30.244873046875F, 80.94676208496094F, 2406},
                        Expected{"V", 0, -33.263427734375F, 39.35206604003906F, 2406},
                        Expected{"Z", 0, -137.55970764160156F, 16663.181640625F, 2406},
                        Expected{"T", 0, 197.32357788085938F, 302.8184509277344F, 2406},
                        Expected{"Q", 0, 1.0677832506189588e-05F, 0.020463909953832626F, 9030},
                        Expected{"U", 4, -26.32524299621582F, 80.45121765136719F, 2471},
                        Expected{"T", 4, 191.594970703125F, 303.6835021972656F, 2471}}) {
    const Volume volume = test::volume_of(*source_, e.field, e.step);
    EXPECT_EQ(volume.range, (std::array<float, 2>{e.low, e.high})) << e.field << e.step;
    EXPECT_EQ(volume.masked, e.masked) << e.field << e.step;
  }
}

// The strongest wind is at 200 hPa, 38 N, 135 E, eastward over Japan; levels below mountains are
// masked.
TEST_F(GradsModel, SamplesHaveTheirExpectedPositions) {
  const auto u = values_of(*source_, "U", 0);
  const auto index = [](std::size_t x, std::size_t y, std::size_t z) {
    return x + 72 * (y + 46 * z);
  };
  EXPECT_EQ(u[index(27, 32, 5)], 80.94676208496094F);
  const auto t = values_of(*source_, "T", 4);
  EXPECT_EQ(t[index(28, 29, 3)], 266.2748718261719F);
  EXPECT_EQ(values_of(*source_, "V", 4)[index(71, 45, 6)], 0.25756072998046875F);
  EXPECT_EQ(std::count_if(u.begin(), u.begin() + 3312, [](float v) { return std::isnan(v); }),
            1738);
}

}  // namespace
}  // namespace windsplat::data
