// OPeNDAP: answers written by hand after DAP 2.0 (ESE-RFC-004.1.2, 7 and appendix A).
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/data/formats/dap/das.hpp"
#include "server/data/formats/dap/dds.hpp"
#include "server/data/formats/dap/file.hpp"
#include "server/data/open/open.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::dap {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr const char* grid_dds = R"(Dataset {
    Float64 lat[lat = 2];
    Float32 lev[lev = 2];
    Grid {
     ARRAY:
        Int16 t[lev = 2][lat = 2][lon = 3];
     MAPS:
        Float32 lev[lev = 2];
        Float64 lat[lat = 2];
        Float32 lon[lon = 3];
    } t;
    Structure { Byte a; Structure { Int32 b[4]; } inner; } other[2];
    String title;
    Sequence { Int32 n; } rows;
} air.nc;
)";
constexpr const char* grid_das = R"(Attributes {
    lat { String units "degrees_north"; }
    lon { String units "degrees_east"; }
    lev { String units "hPa"; String positive "down"; }
    # a comment
    t {
        String units "K";
        String long_name "air \"temperature\"";
        Float32 scale_factor 0.5;
        Float64 add_offset 2.5e+2;
        Int16 _FillValue -9;
        Int16 valid_range -100, 100;
        Float32 odd NaN;
        lat { String units "wrong"; }
    }
    NC_GLOBAL { String title "Air"; Alias same .t; }
    DODS_EXTRA { String Unlimited_Dimension "time"; }
}
)";

std::string big(std::uint32_t word) {
  std::string out;
  for (int shift = 24; shift >= 0; shift -= 8) out += static_cast<char>(word >> shift);
  return out;
}
std::string big(float value) {
  std::uint32_t word = 0;
  std::memcpy(&word, &value, sizeof word);
  return big(word);
}
std::string big(double value) {
  std::uint64_t word = 0;
  std::memcpy(&word, &value, sizeof word);
  return big(static_cast<std::uint32_t>(word >> 32U)) + big(static_cast<std::uint32_t>(word));
}
template <class T>
std::string array(const std::vector<T>& values) {
  const auto count = static_cast<std::uint32_t>(values.size());
  std::string out = big(count) + big(count);
  for (const T value : values) out += big(value);
  return out;
}

class Answers final : public Files {
 public:
  Answers(const test::Folder& folder, std::map<std::string, std::string> answers)
      : folder_(folder), answers_(std::move(answers)) {
    location_.fetched = true;
    location_.service = true;
    location_.stem = "air";
    location_.members = {{"air.nc", "https://h/air.nc"}};
  }
  [[nodiscard]] const Location& location() const override { return location_; }
  Result<std::shared_ptr<const InputFile>> open(const std::string& name) override {
    asked.push_back(name);
    const auto known = answers_.find(name);
    if (known == answers_.end()) return make_error(ErrorKind::not_found, name + " is not there");
    const std::string path = folder_ / "answer";
    std::ofstream(path, std::ios::binary) << known->second;
    return InputFile::adopt(::open(path.c_str(), O_RDONLY | O_CLOEXEC), name);
  }
  Result<std::vector<std::string>> list(const std::string&) override {
    return std::vector<std::string>();
  }
  bool exists(const std::string&) override { return false; }

  std::vector<std::string> asked;

 private:
  const test::Folder& folder_;
  Location location_;
  std::map<std::string, std::string> answers_;
};

class Dap : public testing::Test {
 protected:
  void SetUp() override {
    answers_ = {
        {"air.nc.dds", grid_dds},
        {"air.nc.das", grid_das},
        {"air.nc.dods?lat[0:1:1]",
         "Dataset {\n    Float64 lat[lat = 2];\n} air.nc;\n\nData:\n" + array<double>({10, 20})},
        {"air.nc.dods?lev[0:1:1]",
         "Dataset {\n    Float32 lev[lev = 2];\n} air.nc;\n\nData:\n" + array<float>({1000, 500})},
        {"air.nc.dods?t.lon[0:1:2]",
         "Dataset {\n    Structure {\n        Float32 lon[lon = 3];\n    } t;\n} air.nc;\n"
         "\nData:\r\n" +
             array<float>({0, 120, 240})},
        {block_, block_answer(array<std::uint32_t>({1, 0xFFFFFFF7, 0xFFFFFFFE, 4}))}};
  }
  // lev 0 to 1, lat 1, lon 1 to 2.
  const std::string block_ = "air.nc.dods?t.t[0:1:1][1:1:1][1:1:2]";
  static std::string block_answer(const std::string& values) {
    return "Dataset {\n  Structure {\n    Int16 t[lev = 2][lat = 1][lon = 2];\n  } t;\n} air.nc;\n"
           "\nData:\n" +
           values;
  }
  std::shared_ptr<Answers> files() { return std::make_shared<Answers>(folder_, answers_); }
  std::string refusal() {
    const auto file = open(files());
    if (!file) return file.error().message;
    std::vector<double> out(4);
    const int t = cf::variable_named((*file)->contents(), "t");
    const auto read = (*file)->read(t, {0, 1, 1}, {2, 1, 2}, out.data());
    return read ? "read" : read.error().message;
  }

  test::Folder folder_;
  std::map<std::string, std::string> answers_;
};

TEST_F(Dap, AGridIsAVariableAndItsMapsAreCoordinates) {
  const auto file = open(files());
  ASSERT_TRUE(file) << file.error().message;
  const FileContents& contents = (*file)->contents();
  std::vector<std::string> names;
  for (const FileVariable& variable : contents.variables) names.push_back(variable.name);
  EXPECT_THAT(names, ElementsAre("lat", "lev", "t", "title", "lon"));
  EXPECT_EQ(contents.title, "Air");
  ASSERT_EQ(contents.left_out.size(), 2U);
  EXPECT_EQ(contents.left_out[0].name, "other");
  EXPECT_EQ(contents.left_out[1].name, "rows");
  const FileVariable& t = contents.variables[2];
  EXPECT_EQ(t.units, "K");
  EXPECT_EQ(t.long_name, "air \"temperature\"");
  EXPECT_TRUE(t.packed);
  EXPECT_EQ(t.type, "int16");
  ASSERT_EQ(t.dims.size(), 3U);
  EXPECT_EQ(contents.dimensions[cf::at(t.dims[2])].name, "lon");
  EXPECT_THAT((*file)->numbers(2, "valid_range").values, ElementsAre(-100, 100));
  EXPECT_THAT((*file)->numbers(2, "add_offset").values, ElementsAre(250));
  EXPECT_TRUE((*file)->numbers(2, "add_offset").floating);
  EXPECT_FALSE((*file)->numbers(2, "_FillValue").floating);
}

TEST_F(Dap, BlocksAreAskedForAndTheirNumbersAreBigEndian) {
  const auto served = files();
  const auto file = open(served);
  ASSERT_TRUE(file) << file.error().message;
  std::vector<double> out(4);
  const auto read = (*file)->read(2, {0, 1, 1}, {2, 1, 2}, out.data());
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_THAT(out, ElementsAre(1, -9, -2, 4));
  EXPECT_EQ(served->asked.back(), block_);
  ASSERT_TRUE((*file)->read(4, {0}, {3}, out.data()));
  EXPECT_EQ(out[2], 240);
}

TEST_F(Dap, ADatasetIsOpenedWithItsAxes) {
  const auto source = open_dataset(files());
  ASSERT_TRUE(source) << source.error().message;
  const auto& grid = (*source)->info().grid;
  ASSERT_EQ(grid.axes.size(), 3U);
  EXPECT_EQ((*source)->info().fields[0].name, "t");
  EXPECT_EQ((*source)->info().fields[0].units, "K");
}

TEST_F(Dap, AnswersToAnotherRequestAreRefused) {
  EXPECT_EQ(refusal(), "read");
  const auto four = array<std::uint32_t>({1, 2, 3, 4});
  answers_[block_] = block_answer(array<std::uint32_t>({1, 2, 3}));
  EXPECT_THAT(refusal(), HasSubstr("another number of values of 't'"));
  answers_[block_] = block_answer(big(4U) + big(5U) + four.substr(8));
  EXPECT_THAT(refusal(), HasSubstr("another number of values of 't'"));
  answers_[block_] = block_answer(four.substr(0, 20));
  EXPECT_THAT(refusal(), HasSubstr("is truncated"));
  const auto with = [&](const std::string& declaration) {
    answers_[block_] = "Dataset { " + declaration + " } x;\nData:\n" + four;
    return refusal();
  };
  EXPECT_EQ(with("Int16 t[2][1][2];"), "read");
  EXPECT_EQ(with("Grid { Array: Int16 t[2][1][2]; Maps: Float32 lev[2]; } t;"), "read");
  EXPECT_THAT(with("Int32 t[2][1][2];"), HasSubstr("other values of 't'"));
  EXPECT_THAT(with("Int16 t[1][2][2];"), HasSubstr("other values of 't'"));
  EXPECT_THAT(with("Int16 t[4];"), HasSubstr("other values of 't'"));
  EXPECT_THAT(with("Int16 t[2][1][2]; Int16 u[4];"), HasSubstr("other variables"));
  answers_[block_] = four;
  EXPECT_THAT(refusal(), HasSubstr("no 'Data:'"));
  answers_[block_] = "Error {\n    code = 5;\n    message = \"no such variable\";\n};\n";
  EXPECT_THAT(refusal(), HasSubstr("no such variable"));
}

TEST_F(Dap, MalformedDescriptionsAreRefused) {
  for (const char* text :
       {"", "Dataset", "Dataset {", "Dataset { Float32 u[2]; }", "Dataset { Float32 u[2] } x;",
        "Dataset { Float32 u[x = ]; } x;", "Dataset { Float32 u[-1]; } x;",
        "Dataset { Float32 u[99999999999]; } x;", "Dataset { Grid { } g; } x;",
        "Dataset { Grid { Array: Float32 u[2]; Maps: } x;", "Dataset { Structure { ",
        "Dataset { Float32 u[n = 2]; Float32 v[n = 3]; } x;", "Dataset { { { { } x;",
        "Dataset { } \"x\";"}) {
    EXPECT_FALSE(parse_dds(text)) << text;
  }
  EXPECT_FALSE(parse_dds("Dataset { Structure " + std::string(100'000, '{')));
  for (const char* text : {"", "Attributes", "Attributes {", "Attributes { u {", "Attributes { u",
                           "Attributes { u { Float32 x a; } }", "Attributes { u { Int32 x 1 } }",
                           "Attributes { u { String x \"open; } }", "Attributes { u { v { } } "}) {
    EXPECT_FALSE(parse_das(text)) << text;
  }
  answers_["air.nc.das"] = "Error { code = 404; message = \"gone\"; };";
  EXPECT_THAT(refusal(), HasSubstr("gone"));
}

TEST_F(Dap, BytesAreSignedOnlyIfTheServiceSaysSo) {
  answers_["air.nc.dds"] = "Dataset { Byte b[n = 3]; Byte one; } air.nc;";
  answers_["air.nc.das"] = "Attributes { }";
  answers_["air.nc.dods?b[0:1:2]"] = "Dataset { Byte b[n = 3]; } air.nc;\nData:\n" + big(3U) +
                                     big(3U) + std::string("\x01\xFF\x80\0", 4);
  answers_["air.nc.dods?one"] = "Dataset { Byte one; } air.nc;\nData:\n" + big(200U);
  std::vector<double> out(3);
  const auto plain = open(files());
  ASSERT_TRUE(plain && (*plain)->read(0, {0}, {3}, out.data()));
  EXPECT_THAT(out, ElementsAre(1, 255, 128));
  ASSERT_TRUE((*plain)->read(1, {}, {}, out.data()));
  EXPECT_EQ(out[0], 200);
  answers_["air.nc.das"] = "Attributes { b { String _Unsigned \"false\"; } }";
  ASSERT_TRUE((*open(files()))->read(0, {0}, {3}, out.data()));
  EXPECT_THAT(out, ElementsAre(1, -1, -128));
}

// netcdf-c issue 1614: THREDDS serves int16 with _Unsigned as UInt16, but its _FillValue as Int16.
TEST_F(Dap, FillValuesOfUnsignedVariablesAreTheValuesThatAreStored) {
  answers_["air.nc.dds"] = "Dataset { UInt16 a[n = 3]; UInt32 b[n = 3]; Int16 c[n = 3]; } air.nc;";
  answers_["air.nc.das"] =
      "Attributes { a { Int16 _FillValue -1; Int16 valid_range 0, -6; Int16 add_offset -3; String "
      "_Unsigned \"true\"; } b { Int32 missing_value -2; } c { Int16 _FillValue -1; } }";
  const auto file = open(files());
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_THAT((*file)->numbers(0, "_FillValue").values, ElementsAre(65535));
  EXPECT_THAT((*file)->numbers(0, "valid_range").values, ElementsAre(0, 65530));
  EXPECT_THAT((*file)->numbers(0, "add_offset").values, ElementsAre(-3));
  EXPECT_THAT((*file)->numbers(1, "missing_value").values, ElementsAre(4294967294.0));
  EXPECT_THAT((*file)->numbers(2, "_FillValue").values, ElementsAre(-1));
}

// netcdf-c pull request 1317, tds issue 277: bytes of netCDF are signed; older services of THREDDS
// leave out _Unsigned, others write the fill value as an unsigned byte.
TEST_F(Dap, SignedBytesHaveTheirFillValue) {
  answers_["air.nc.dds"] = "Dataset { Byte b[n = 3]; } air.nc;";
  answers_["air.nc.dods?b[0:1:2]"] = "Dataset { Byte b[n = 3]; } air.nc;\nData:\n" + big(3U) +
                                     big(3U) + std::string("\x01\xFF\x80\0", 4);
  for (const char* attributes :
       {"Int16 _FillValue -128;", "Byte _FillValue 128; String _Unsigned \"false\";"}) {
    answers_["air.nc.das"] = std::string("Attributes { b { ") + attributes + " } }";
    const auto file = open(files());
    ASSERT_TRUE(file) << file.error().message;
    std::vector<double> out(3);
    ASSERT_TRUE((*file)->read(0, {0}, {3}, out.data()));
    EXPECT_THAT(out, ElementsAre(1, -1, -128)) << attributes;
    EXPECT_THAT((*file)->numbers(0, "_FillValue").values, ElementsAre(-128)) << attributes;
    EXPECT_EQ((*file)->contents().variables[0].type, "int8");
  }
}

TEST_F(Dap, NamesAreShownWithoutEscapesAndAskedForOnceEscaped) {
  answers_["air.nc.dds"] = "Dataset { Float32 air%20t%5B2%5D[n%2em = 2]; } air%2enc;";
  answers_["air.nc.das"] = "Attributes { air%20t%5B2%5D { String units \"K\"; } }";
  const auto served = files();
  const auto file = open(served);
  ASSERT_TRUE(file) << file.error().message;
  const FileContents& contents = (*file)->contents();
  ASSERT_EQ(contents.variables.size(), 1U);
  EXPECT_EQ(contents.variables[0].name, "air t[2]");
  EXPECT_EQ(contents.variables[0].units, "K");
  EXPECT_EQ(contents.dimensions[0].name, "n.m");
  std::vector<double> out(2);
  EXPECT_FALSE((*file)->read(0, {0}, {2}, out.data()));
  EXPECT_EQ(served->asked.back(), "air.nc.dods?air t[2][0:1:1]");  // Files escape it
}

TEST_F(Dap, PagesInPlaceOfDescriptionsAreToldApart) {
  for (const char* page : {"<!DOCTYPE html>\n<html>Log in</html>", "\n<?xml version=\"1.0\"?>"}) {
    answers_["air.nc.dds"] = page;
    EXPECT_THAT(refusal(), HasSubstr("may need a login"));
  }
}

TEST_F(Dap, AttributesOfTypesOfHyraxAreText) {
  answers_["air.nc.das"] =
      "Attributes { t { OtherXML note \"<a>1</a>\"; String units \"K\"; } HDF5_GLOBAL { String "
      "title \"Air of HDF5\"; } }";
  const auto file = open(files());
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ((*file)->contents().title, "Air of HDF5");
  EXPECT_EQ((*file)->contents().variables[2].units, "K");
}

TEST_F(Dap, LargeBlocksAreAskedForInParts) {
  answers_["air.nc.dds"] = "Dataset { Float64 u[t = 1][z = 3][y = 2000][x = 2000]; } air.nc;";
  answers_["air.nc.das"] = "Attributes { }";
  const auto served = files();
  const auto file = open(served);
  ASSERT_TRUE(file) << file.error().message;
  std::vector<double> out;
  EXPECT_FALSE((*file)->read(0, {0, 0, 0, 0}, {1, 3, 2000, 2000}, out.data()));
  EXPECT_EQ(served->asked.back(), "air.nc.dods?u[0:1:0][0:1:0][0:1:1999][0:1:1999]");
}

}  // namespace
}  // namespace windsplat::data::dap
