// JSON lists of the files of one dataset: parts joined by variables, series along time, groups and
// entries of dimensions; names never lead out of the folder.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "server/data/files/files.hpp"
#include "server/data/open/open.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

// One variable of 2 x 2 x 2 samples for two members at one time, of value 10 * hour + member.
void write_part(const fs::path& path, const std::string& variable, int hour) {
  NetcdfMaker file(path.native());
  const int n = file.axis("number", {3, 5}, "1", "realization");
  const int t = file.axis("time", {static_cast<double>(hour)}, "hours since 2001-01-01", "time");
  const int z = file.axis("lev", {1000, 500}, "hPa", "air_pressure");
  const int y = file.axis("lat", {0, 10}, "degrees_north", "latitude");
  const int x = file.axis("lon", {0, 10}, "degrees_east", "longitude");
  std::vector<double> values;
  for (std::size_t i = 0; i < 16; ++i) values.push_back(10 * hour + (i < 8 ? 3 : 5));
  file.variable(variable, NC_FLOAT, {n, t, z, y, x}, values);
}

class FileList : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directory(root() / "run");
    for (int hour = 0; hour < 2; ++hour) {
      const std::string ending = '_' + std::to_string(9 + hour) + ".nc";
      write_part(root() / "run" / ("ta" + ending), "ta", hour);
      write_part(root() / "run" / ("hus" + ending), "hus", hour);
    }
    write_part(root() / "outside.nc", "ta", 0);
  }
  [[nodiscard]] fs::path root() const { return fs::path(folder_ / ""); }
  void write(const std::string& text) const { std::ofstream(root() / "run/list.json") << text; }
  [[nodiscard]] std::unique_ptr<Source> open_list(const std::string& text,
                                                  const std::string& after = "") const {
    write(text);
    return opened((root() / "run/list.json").native() + after);
  }
  [[nodiscard]] std::string why_not(const std::string& text) const {
    write(text);
    const auto source = open_file((root() / "run/list.json").native());
    EXPECT_FALSE(source) << text << " was opened";
    return source ? "" : source.error().message;
  }

  const Folder folder_;
};

TEST_F(FileList, PatternsAreSeriesThatAreJoinedByVariables) {
  const auto source =
      open_list(R"({"windsplat": "files", "title": "Two", "files": ["ta_*.nc", "hus_*.nc"]})");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().title, "Two");
  EXPECT_EQ(source->info().source, "list.json");
  ASSERT_EQ(source->info().steps.size(), 2U);
  EXPECT_EQ(source->info().steps[1].text, "2001-01-01T01:00:00Z") << "9 precedes 10";
  for (const char* name : {"ta", "hus"}) {
    EXPECT_EQ(volume_of(*source, name, 0).values[0], 3) << name;
    EXPECT_EQ(volume_of(*source, name, 1).values[0], 13) << name;
  }
  ASSERT_EQ(source->info().choices.size(), 1U);
  EXPECT_THAT(source->info().choices[0].values, ElementsAre("3", "5"));
}

TEST_F(FileList, AListChoosesEntriesUnlessItsNameDoes) {
  const std::string text =
      R"({"windsplat": "files", "title": "Two", "files": ["ta_10.nc"],
          "selection": {"number": 5}})";
  const auto source = open_list(text);
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(volume_of(*source, "ta", 0).values[0], 15);
  EXPECT_EQ(source->info().title, "Two (number=5)");
  const auto other = open_list(text, "?number=3");
  ASSERT_NE(other, nullptr);
  EXPECT_EQ(volume_of(*other, "ta", 0).values[0], 13);
  EXPECT_THAT(why_not(R"({"windsplat": "files", "files": ["ta_10.nc"], "selection": {"n": 5}})"),
              HasSubstr("there is no dimension 'n'"));
}

TEST_F(FileList, BracesAreAlternativesAsOnTheCommandLine) {
  const auto listed = open_list(R"({"windsplat": "files", "files": ["{ta,hus}_9.nc"]})");
  ASSERT_NE(listed, nullptr);
  const auto braces = opened((root() / "run/{ta,hus}_9.nc").native());
  ASSERT_NE(braces, nullptr);
  ASSERT_EQ(listed->info().fields.size(), braces->info().fields.size());
  EXPECT_EQ(volume_of(*listed, "hus").values[7], volume_of(*braces, "hus").values[7]);
  EXPECT_EQ(listed->info().digest, braces->info().digest);
}

TEST_F(FileList, AHeaderInAFolderNamesTheDataBesideIt) {
  fs::create_directory(root() / "run/sub");
  std::ofstream(root() / "run/sub/h.nhdr")
      << "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\ndata file: d.raw\n";
  std::ofstream(root() / "run/sub/d.raw") << std::string(8, '\7');
  std::ofstream(root() / "run/d.raw") << std::string(8, '\x63');
  const auto source = open_list(R"({"windsplat": "files", "files": ["sub/h.nhdr"]})");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(volume_of(*source, source->info().fields.at(0).name).values[0], 7);
}

TEST_F(FileList, AGroupIsThatOfEveryFile) {
  EXPECT_THAT(why_not(R"({"windsplat": "files", "files": ["ta_9.nc"], "group": "/none"})"),
              HasSubstr("none"));
}

TEST_F(FileList, NamesDoNotLeadOutOfTheFolder) {
  std::ofstream(root() / "run/v.vtk") << "# vtk DataFile Version 3.0\nx\nASCII\n";
  fs::create_symlink(root() / "outside.nc", root() / "run/link.nc");
  for (const auto& [name, why] : std::vector<std::pair<std::string, std::string>>{
           {"../outside.nc", "/files/0: leads out of the folder of the list"},
           {"a/../../outside.nc", "/files/0: leads out of the folder of the list"},
           {(root() / "outside.nc").native(), "/files/0: must be a name relative to"},
           {"", "/files/0: must be a name relative to"},
           {"link.nc", "lies outside the dataset's folder"},
           {"l*.nc", "lies outside the dataset's folder"},
           {"none_*.nc", "'none_*.nc': no file matches"},
           {"v.vtk", "'v.vtk' is a VTK file: only files of arrays"},
           {"list.json", "'list.json' is a list of files, which cannot be a part of a list"},
           {"none.nc", "'none.nc': no such file"}}) {
    EXPECT_THAT(why_not(R"({"windsplat": "files", "files": [")" + name + "\"]}"), HasSubstr(why));
  }
}

TEST_F(FileList, FaultsNameTheKeyAndTheLimit) {
  std::string many = "\"ta_9.nc\"";
  std::string alternatives = "ta_9.nc";
  for (int n = 0; n < 64; ++n) {
    many += ", \"ta_9.nc\"";
    alternatives += ",ta_9.nc";
  }
  for (const auto& [rest, why] : std::vector<std::pair<std::string, std::string>>{
           {"", "'list.json' is invalid: /files: is required"},
           {R"(, "files": [])", "/files: must list 1 to 64 names or patterns"},
           {", \"files\": [" + many + "]", "/files: must list 1 to 64 names or patterns"},
           {R"(, "files": ["{)" + alternatives + "}\"]",
            "'list.json' has more than 64 parts, counting alternatives in braces"},
           {R"(, "files": [7])", "/files/0: must be a string"},
           {R"(, "files": ["ta_9.nc"], "file": 1)", "/file: unknown key"},
           {R"(, "files": ["ta_9.nc"], "selection": 3)",
            "/selection: must be an object of at most"},
           {R"(, "files": ["ta_9.nc"], "selection": {"n": []})", "/selection/n: must be a string"},
           {R"(, "files": ["ta_9.nc"], "files": ["ta_9.nc"])", "the key 'files' occurs twice"},
           {R"(, "files": ["ta_9.nc")", "'list.json' is not valid JSON"}}) {
    EXPECT_THAT(why_not(R"({"windsplat": "files")" + rest + "}"), HasSubstr(why)) << rest;
  }
  EXPECT_THAT(why_not(R"({"windsplat": "files", "title": ")" + std::string(65536, 'a') + "\"}"),
              HasSubstr("a list of files has at most 65536 bytes"));
}

TEST_F(FileList, FilesMayBeListedWithoutAFile) {
  Location location;
  location.folder = fs::canonical(root()).native();
  location.companions = true;
  location.stem = "posted";
  location.list = R"({"files": ["run/ta_*.nc", "run/hus_*.nc"], "selection": {"number": 5}})";
  const auto source = open_dataset(direct_files(location));
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ(volume_of(**source, "hus", 1).values[0], 15);
  location.list = R"({"files": ["../ta.nc"]})";
  const auto refused = open_dataset(direct_files(location));
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message,
              HasSubstr("the list of files is invalid: /files/0: leads out of the folder"));
}

}  // namespace
}  // namespace windsplat::data::test
