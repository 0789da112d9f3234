// GRIB files made from the samples of ecCodes, whose values are a function of position, level and
// time written in the order of WMO flag table 3.4; and broken files.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "server/data/cf/array_file.hpp"
#include "server/data/files/input_file.hpp"
#include "server/data/formats/grib/open.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/data/model/source.hpp"
#include "server/data/open/open.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

#ifdef WINDSPLAT_GRIB
#include "tests/unit/data/formats/grib_maker.hpp"
#endif

namespace windsplat::data::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

#ifndef WINDSPLAT_GRIB

TEST(Grib, IsRefusedByNameWithoutTheLibrary) {
  const Folder folder;
  write_bytes(folder / "a.grib", std::string("GRIB\0\0\x30\x01", 8) + std::string(40, '\0'));
  auto source = open_file(folder / "a.grib");
  ASSERT_FALSE(source);
  EXPECT_THAT(source.error().message, HasSubstr("built without GRIB"));
}

#else

struct Scan {
  bool west = false;        // iScansNegatively
  bool north = false;       // jScansPositively
  bool by_columns = false;  // jPointsAreConsecutive
  bool alternating = false;
};

// 4 columns from 10 to 40 E, 3 rows from 60 to 20 N.
constexpr long columns = 4;
constexpr long rows = 3;

double value_at(double lon, double lat, double level, double hour) {
  return lon + 100 * lat + level + 10000 * hour;
}

void fill_grid(Maker& maker, const Scan& scan, long level, long hour, double missing_lon = -1) {
  maker.set("Ni", columns);
  maker.set("Nj", rows);
  maker.set("iScansNegatively", long{scan.west});
  maker.set("jScansPositively", long{scan.north});
  maker.set("jPointsAreConsecutive", long{scan.by_columns});
  if (scan.alternating) maker.set("alternativeRowScanning", 1L);
  maker.set("longitudeOfFirstGridPointInDegrees", scan.west ? 40.0 : 10.0);
  maker.set("longitudeOfLastGridPointInDegrees", scan.west ? 10.0 : 40.0);
  maker.set("latitudeOfFirstGridPointInDegrees", scan.north ? 20.0 : 60.0);
  maker.set("latitudeOfLastGridPointInDegrees", scan.north ? 60.0 : 20.0);
  maker.set("iDirectionIncrementInDegrees", 10.0);
  maker.set("jDirectionIncrementInDegrees", 20.0);
  maker.set("bitsPerValue", 24L);
  maker.set("missingValue", 9999999.0);
  maker.set("bitmapPresent", long{missing_lon > 0});
  std::vector<double> list;
  const long outer = scan.by_columns ? columns : rows;
  const long inner = scan.by_columns ? rows : columns;
  for (long a = 0; a < outer; ++a) {
    for (long b = 0; b < inner; ++b) {
      const long turned = scan.alternating && a % 2 == 1 ? inner - 1 - b : b;
      const auto i = static_cast<double>(scan.by_columns ? a : turned);
      const auto j = static_cast<double>(scan.by_columns ? turned : a);
      const double lon = scan.west ? 40 - 10 * i : 10 + 10 * i;
      const double lat = scan.north ? 20 + 20 * j : 60 - 20 * j;
      list.push_back(lon == missing_lon ? 9999999.0
                                        : value_at(lon, lat, static_cast<double>(level),
                                                   static_cast<double>(hour)));
    }
  }
  maker.values(list);
}

std::string message(int edition, const std::string& quantity, long level, long hour,
                    const Scan& scan = {}, double missing_lon = -1) {
  Maker maker(edition == 1 ? "regular_ll_pl_grib1" : "regular_ll_pl_grib2");
  maker.set("dataDate", 20200229L);
  maker.set("dataTime", 1200L);
  maker.set("stepRange", std::to_string(hour));
  maker.set("typeOfLevel", std::string("isobaricInhPa"));
  maker.set("level", level);
  maker.set("shortName", quantity);
  fill_grid(maker, scan, level, hour, missing_lon);
  return maker.bytes();
}

class Grib : public GribFiles {};

// Every sample of a field equals the closed form, within a few packing steps.
void expect_form(Source& source, const std::string& field, std::size_t step, double hour) {
  const DatasetInfo& info = source.info();
  const FieldInfo* found = info.find(field);
  ASSERT_NE(found, nullptr) << field;
  auto volume = source.read(static_cast<std::size_t>(found - info.fields.data()), step);
  ASSERT_TRUE(volume) << volume.error().message;
  const auto& axes = info.grid.axes;
  std::size_t n = 0;
  for (const double level : axes[2].coordinates) {
    for (const double lat : axes[1].coordinates) {
      for (const double lon : axes[0].coordinates) {
        EXPECT_NEAR(volume->values[n], value_at(lon, lat, level, hour), 0.02)
            << lon << ' ' << lat << ' ' << level;
        ++n;
      }
    }
  }
  EXPECT_EQ(n, volume->values.size());
}

TEST_F(Grib, MessagesOfBothEditionsBecomeAVolumeOverTimeAndLevel) {
  std::string bytes;
  for (const long hour : {6, 0}) {
    for (const long level : {500, 1000, 850}) {
      for (const char* quantity : {"t", "u", "v"}) {
        bytes += message(level == 850 ? 1 : 2, quantity, level, hour);
      }
    }
  }
  const auto source = open(bytes);
  ASSERT_NE(source, nullptr);
  const DatasetInfo& info = source->info();
  EXPECT_EQ(info.format, "GRIB 1 and 2");
  EXPECT_EQ(info.grid.axes[2].kind, AxisKind::pressure);
  EXPECT_EQ(info.grid.axes[2].units, "hPa");
  ASSERT_EQ(info.steps.size(), 2U);
  EXPECT_EQ(info.steps[0].text, "2020-02-29T12:00:00Z");
  EXPECT_EQ(info.steps[1].text, "2020-02-29T18:00:00Z");
  EXPECT_EQ(info.fields.at(0).kind, FieldKind::vector);
  EXPECT_THAT(info.fields.at(0).components, ElementsAre("u", "v"));
  EXPECT_THAT(info.grid.axes[2].coordinates, ElementsAre(1000, 850, 500));
  expect_form(*source, "t", 0, 0);
  expect_form(*source, "t", 1, 6);
}

TEST_F(Grib, ValuesKeepTheirPositionsInEveryScanningMode) {
  for (const int edition : {1, 2}) {
    for (int flags = 0; flags < (edition == 1 ? 8 : 16); ++flags) {
      SCOPED_TRACE(std::to_string(edition) + " " + std::to_string(flags));
      const Scan scan{(flags & 1) != 0, (flags & 2) != 0, (flags & 4) != 0, (flags & 8) != 0};
      const auto source =
          open(message(edition, "t", 1000, 0, scan) + message(edition, "t", 500, 0, scan) +
               message(edition, "t", 1000, 6, scan) + message(edition, "t", 500, 6, scan));
      ASSERT_NE(source, nullptr);
      EXPECT_THAT(source->info().grid.axes[0].coordinates, ElementsAre(10, 20, 30, 40));
      EXPECT_THAT(source->info().grid.axes[1].coordinates, ElementsAre(20, 40, 60));
      EXPECT_THAT(source->info().grid.axes[2].coordinates, ElementsAre(1000, 500));
      expect_form(*source, "t", 0, 0);
      expect_form(*source, "t", 1, 6);
    }
  }
}

// P_64 (x) by Bonnet's recursion.
double legendre_64(double x) {
  double before = 1;
  double now = x;
  for (int n = 1; n < 64; ++n) {
    const double next = ((2 * n + 1) * x * now - n * before) / (n + 1);
    before = now;
    now = next;
  }
  return now;
}

// N 32: the sines of its 64 latitudes are the roots of P_64. The value of a row is its latitude, in
// either order.
TEST_F(Grib, GaussianLatitudesFromEitherPole) {
  for (const bool north : {false, true}) {
    SCOPED_TRACE(north);
    Maker maker("regular_gg_pl_grib2");
    maker.set("jScansPositively", long{north});
    maker.set("latitudeOfFirstGridPointInDegrees", north ? -87.8638 : 87.8638);
    maker.set("latitudeOfLastGridPointInDegrees", north ? 87.8638 : -87.8638);
    maker.set("bitsPerValue", 24L);
    std::vector<double> list;
    for (int row = 0; row < 64; ++row) {
      // Latitudes are nearly evenly spaced, 180 / 64.5 degrees apart.
      const double about = (north ? 1 : -1) * (row - 31.5) * 180 / 64.5;
      list.insert(list.end(), 128, about);
    }
    maker.values(list);
    const auto source = open(maker.bytes());
    ASSERT_NE(source, nullptr);
    ASSERT_EQ(source->info().grid.dims(), (std::array<int, 3>{128, 64, 1}));
    const auto& latitude = source->info().grid.axes[1].coordinates;
    const auto volume = source->read(0, 0);
    ASSERT_TRUE(volume);
    for (std::size_t row = 0; row < 64; ++row) {
      EXPECT_NEAR(legendre_64(std::sin(latitude[row] * M_PI / 180)), 0, 1e-9) << latitude[row];
      EXPECT_NEAR(volume->values[row * 128], latitude[row], 0.1);
    }
    EXPECT_LT(latitude.front(), -87);
  }
}

TEST_F(Grib, BitmapsAndAbsentMessagesAreMasked) {
  const auto source =
      open(message(2, "t", 1000, 0, {}, 20) + message(1, "t", 500, 0) + message(2, "t", 1000, 6));
  ASSERT_NE(source, nullptr);
  auto first = source->read(0, 0);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->masked, rows);
  EXPECT_TRUE(std::isnan(first->values[1]));
  auto second = source->read(0, 1);
  ASSERT_TRUE(second);
  EXPECT_EQ(second->masked, rows * columns);
}

// Sections 1 to 7 of a message of edition 2.
std::vector<std::string> sections_of(const std::string& bytes) {
  std::vector<std::string> out(8);
  for (std::size_t at = 16; at + 5 < bytes.size();) {
    std::size_t length = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      length = length << 8U | static_cast<unsigned char>(bytes[at + i]);
    }
    out.at(static_cast<unsigned char>(bytes[at + 4])) = bytes.substr(at, length);
    at += length;
  }
  return out;
}

std::string message_of(const std::string& sections) {
  std::string out("GRIB\xff\xff\0\2", 8);
  const std::size_t length = 16 + sections.size() + 4;
  for (int shift = 56; shift >= 0; shift -= 8) out += static_cast<char>(length >> shift);
  return out + sections + "7777";
}

// Code table 6.0: 254 is the last bitmap defined in the message, not that of the field before.
TEST_F(Grib, FieldsShareTheLastBitmapOfTheirMessage) {
  const auto t = sections_of(message(2, "t", 500, 0, {}, 20));
  const auto q = sections_of(message(2, "q", 500, 0, {}, 20));
  const auto whole = sections_of(message(2, "u", 500, 0));
  const std::string same("\0\0\0\6\6\xfe", 6);
  const std::string begin = t[1] + t[3];
  const std::string masked = t[4] + t[5] + t[6] + t[7];
  const std::string unmasked = whole[4] + whole[5] + whole[6] + whole[7];
  const auto source = open(message_of(begin + masked + unmasked + q[4] + q[5] + same + q[7]));
  ASSERT_NE(source, nullptr);
  const DatasetInfo& info = source->info();
  for (const auto& [name, count] : {std::pair("t", rows), {"q", rows}, {"u", 0L}}) {
    SCOPED_TRACE(name);
    ASSERT_NE(info.find(name), nullptr);
    const auto volume =
        source->read(static_cast<std::size_t>(info.find(name) - info.fields.data()), 0);
    ASSERT_TRUE(volume) << volume.error().message;
    EXPECT_EQ(volume->masked, count);
    EXPECT_NEAR(volume->values[0], value_at(10, 20, 500, 0), 0.02);
  }
  EXPECT_THAT(fault(message_of(begin + q[4] + q[5] + same + q[7])), HasSubstr("bitmap before"));
}

TEST_F(Grib, MessagesBehindALargeGapAreRead) {
  for (const std::size_t gap : {15U, 65536U, 65549U, 200000U}) {
    const auto source =
        open(message(2, "t", 1000, 0) + std::string(gap, '\0') + message(2, "t", 500, 0));
    ASSERT_NE(source, nullptr);
    EXPECT_THAT(source->info().grid.axes[2].coordinates, ElementsAre(1000, 500)) << gap;
  }
}

TEST_F(Grib, SeveralFieldsInOneMessageAreAllRead) {
  codes_multi_handle* all = codes_grib_multi_handle_new(nullptr);
  for (const char* quantity : {"u", "v"}) {
    Maker maker("regular_ll_pl_grib2");
    maker.set("shortName", std::string(quantity));
    fill_grid(maker, {}, quantity[0], 0);
    ASSERT_EQ(codes_grib_multi_handle_append(maker.handle(), 4, all), CODES_SUCCESS);
  }
  FILE* out = std::fopen((folder_ / "m").c_str(), "wb");
  ASSERT_EQ(codes_grib_multi_handle_write(all, out), CODES_SUCCESS);
  std::fclose(out);
  codes_grib_multi_handle_delete(all);
  const std::string bytes = bytes_of(folder_ / "m");
  ASSERT_EQ(bytes.find("GRIB", 4), std::string::npos);
  const auto source = open(bytes);
  ASSERT_NE(source, nullptr);
  auto wind = source->read(0, 0);
  ASSERT_TRUE(wind);
  EXPECT_EQ(wind->values.size(), 2U * rows * columns);
  EXPECT_NEAR(wind->values[0], value_at(10, 20, 'u', 0), 0.02);
  EXPECT_NEAR(wind->values[rows * columns], value_at(10, 20, 'v', 0), 0.02);
}

// A wind of (10, 0) on a Lambert grid whose first point is 35 degrees west of the central meridian:
// there east is rotated by 35 sin(25) degrees relative to the rows.
std::string lambert_wind(const std::string& component, bool along_rows) {
  Maker maker("GRIB2");
  maker.set("gridType", std::string("lambert"));
  maker.set("Nx", 4L);
  maker.set("Ny", 3L);
  maker.set("latitudeOfFirstGridPointInDegrees", 30.0);
  maker.set("longitudeOfFirstGridPointInDegrees", 230.0);
  maker.set("LaDInDegrees", 25.0);
  maker.set("LoVInDegrees", 265.0);
  maker.set("Latin1InDegrees", 25.0);
  maker.set("Latin2InDegrees", 25.0);
  maker.set("DxInMetres", 20000.0);
  maker.set("DyInMetres", 20000.0);
  maker.set("jScansPositively", 1L);
  maker.set("uvRelativeToGrid", long{along_rows});
  maker.set("typeOfLevel", std::string("isobaricInhPa"));
  maker.set("level", 500L);
  maker.set("shortName", component);
  maker.set("bitsPerValue", 16L);
  maker.values(std::vector<double>(12, component.starts_with("u") ? 10 : 0));
  return maker.bytes();
}

// Gusts and the motion of storms have no standard name.
TEST_F(Grib, WindsAlongRowsStayAndOthersAreRotated) {
  const double angle = 35 * std::sin(25 * M_PI / 180) * M_PI / 180;
  for (const char* name : {"u", "ugust", "ust"}) {
    for (const bool along_rows : {true, false}) {
      SCOPED_TRACE(name);
      const std::string x = name;
      const auto source =
          open(lambert_wind(x, along_rows) + lambert_wind("v" + x.substr(1), along_rows));
      ASSERT_NE(source, nullptr);
      ASSERT_EQ(source->info().fields.front().kind, FieldKind::vector);
      const auto wind = source->read(0, 0);
      ASSERT_TRUE(wind);
      const double turned = along_rows ? 0 : angle;
      EXPECT_NEAR(wind->component(0)[0], 10 * std::cos(turned), 0.02);
      EXPECT_NEAR(wind->component(1)[0], -10 * std::sin(turned), 0.02);
    }
  }
}

// A wind of (10, 0) on a polar stereographic grid whose first point is 40 degrees west of the
// central meridian: there north is rotated 40 degrees clockwise from the columns.
std::string polar_wind(int edition, const std::string& component, bool along_rows) {
  Maker maker(edition == 1 ? "polar_stereographic_pl_grib1" : "polar_stereographic_pl_grib2");
  maker.set("Nx", 4L);
  maker.set("Ny", 3L);
  if (edition == 2) maker.set("numberOfDataPoints", 12L);
  maker.set("latitudeOfFirstGridPointInDegrees", 60.0);
  maker.set("longitudeOfFirstGridPointInDegrees", 225.0);
  maker.set("orientationOfTheGridInDegrees", 265.0);
  maker.set("DxInMetres", 20000.0);
  maker.set("DyInMetres", 20000.0);
  maker.set("iScansNegatively", 0L);
  maker.set("jScansPositively", 1L);
  // Flag table 3.3, bit 5; the same position in table 7 of edition 1.
  maker.set("resolutionAndComponentFlags", along_rows ? 8L : 0L);
  maker.set("level", 500L);
  maker.set("shortName", component);
  maker.set("bitsPerValue", 16L);
  maker.values(std::vector<double>(12, component == "u" ? 10 : 0));
  return maker.bytes();
}

TEST_F(Grib, WindsOnPolarStereographicGridsFollowTheFlagOfTheirEdition) {
  const double angle = 40 * M_PI / 180;
  for (const int edition : {1, 2}) {
    for (const bool along_rows : {true, false}) {
      SCOPED_TRACE(std::to_string(edition) + (along_rows ? " along rows" : " by east and north"));
      const auto source =
          open(polar_wind(edition, "u", along_rows) + polar_wind(edition, "v", along_rows));
      ASSERT_NE(source, nullptr);
      ASSERT_EQ(source->info().fields.front().kind, FieldKind::vector);
      const auto wind = source->read(0, 0);
      ASSERT_TRUE(wind);
      const double turned = along_rows ? 0 : angle;
      EXPECT_NEAR(wind->component(0)[0], 10 * std::cos(turned), 0.02);
      EXPECT_NEAR(wind->component(1)[0], -10 * std::sin(turned), 0.02);
    }
  }
}

TEST_F(Grib, RepeatedMessagesAreReportedAndOmitted) {
  const auto source = open(message(1, "t", 500, 0) + message(1, "t", 500, 0, {}, 20));
  ASSERT_NE(source, nullptr);
  EXPECT_THAT(source->info().notes, ElementsAre(HasSubstr("1 more messages")));
  EXPECT_EQ(source->read(0, 0)->masked, 0);
}

// A member whose values are those of the control and 1e5 times its number.
std::string member(int edition, long number, long level, long hour) {
  Maker maker(edition == 1 ? "regular_ll_pl_grib1" : "regular_ll_pl_grib2");
  if (edition == 1) {
    maker.set("setLocalDefinition", 1L);
    maker.set("stream", std::string("enfo"));
    maker.set("type", std::string("pf"));
  } else {
    maker.set("productDefinitionTemplateNumber", 1L);
  }
  maker.set("number", number);
  maker.set("stepRange", std::to_string(hour));
  maker.set("typeOfLevel", std::string("isobaricInhPa"));
  maker.set("level", level);
  maker.set("shortName", std::string("t"));
  fill_grid(maker, {}, level, hour + 10 * number);
  return maker.bytes();
}

TEST_F(Grib, MembersOfAnEnsembleAreADimension) {
  for (const int edition : {1, 2}) {
    std::string bytes = member(edition, 7, 500, 0);  // has fewer messages than the others
    for (const long hour : {0, 6}) {
      for (const long number : {3, 0, 4}) {
        for (const long level : {500, 850}) bytes += member(edition, number, level, hour);
      }
    }
    write_bytes(folder_ / "a.grib", bytes);
    auto input = InputFile::adopt(::open((folder_ / "a.grib").c_str(), O_RDONLY), "a.grib");
    ASSERT_TRUE(input);
    const auto file = grib::open(*input);
    ASSERT_TRUE(file) << file.error().message;
    const FileContents& contents = (*file)->contents();
    EXPECT_THAT(contents.notes, ElementsAre(testing::EndsWith("omitted: 7")));
    const int t = cf::variable_named(contents, "t");
    ASSERT_GE(t, 0);
    std::vector<std::size_t> lengths;
    for (const int d : contents.variables[cf::at(t)].dims) {
      lengths.push_back(contents.dimensions[cf::at(d)].length);
    }
    EXPECT_THAT(lengths, ElementsAre(3, 2, 2, rows, columns));
    const int number = cf::variable_named(contents, "number");
    ASSERT_GE(number, 0);
    EXPECT_EQ(contents.variables[cf::at(number)].standard_name, "realization");
    std::vector<double> numbers(3);
    ASSERT_TRUE((*file)->read(number, {0}, {3}, numbers.data()));
    EXPECT_THAT(numbers, ElementsAre(0, 3, 4));
    // The second row, 40 N, from the second column, 20 E.
    std::vector<double> read(3 * 2 * 2 * 2);
    ASSERT_TRUE((*file)->read(t, {0, 0, 0, 1, 1}, {3, 2, 2, 1, 2}, read.data()));
    std::size_t n = 0;
    for (const double one : {0, 3, 4}) {
      for (const double hour : {0, 6}) {
        for (const double level : {500, 850}) {
          EXPECT_NEAR(read[n++], value_at(20, 40, level, hour + 10 * one), 0.05);
          EXPECT_NEAR(read[n++], value_at(30, 40, level, hour + 10 * one), 0.05);
        }
      }
    }
  }
}

TEST_F(Grib, HeadingBeforeTheMessageIsSkipped) {
  EXPECT_EQ(fault("\x01\r\r\n001\r\r\nHTXX50 EGRR 291200\r\r\n" + message(1, "t", 500, 0)), "");
}

TEST_F(Grib, BrokenMessagesAreErrors) {
  const std::string good = message(2, "t", 500, 0);
  EXPECT_EQ(fault(good), "");
  EXPECT_THAT(fault(good.substr(0, good.size() - 1)), HasSubstr("truncated"));
  EXPECT_THAT(fault(good.substr(0, 12)), HasSubstr("truncated"));
  std::string without_end = good;
  without_end.back() = '8';
  EXPECT_THAT(fault(without_end), HasSubstr("end marker"));
  std::string huge = good;
  huge[8] = '\x7f';
  EXPECT_THAT(fault(huge), HasSubstr("1073741824"));
  std::string section = good;
  section[16] = '\x7f';
  EXPECT_THAT(fault(section), HasSubstr("malformed section"));
  std::string edition = good;
  edition += good;
  edition[good.size() + 7] = 9;
  EXPECT_THAT(fault(edition), HasSubstr("edition 9"));
  std::string unit = message(1, "t", 500, 6);  // octet 18 of section 1, which follows 8 bytes
  unit[8 + 17] = 68;
  EXPECT_THAT(fault(unit), HasSubstr("no date of validity"));
}

#endif

}  // namespace
}  // namespace windsplat::data::test
