// What is listed of a folder below a data root: formats by content, groups, pages, and what is left
// out of the list.
#include "server/data/files/folder_list.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "server/data/open/content.hpp"

namespace windsplat::data {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr FormatRules rules{format_of_file, folder_marks};

class FolderListing : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "windsplat-list-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    above_ = fs::canonical(name);
    root_ = above_ / "root";
    fs::create_directories(root_ / "runs");
    write("a.txt", "CDF\x01 a classic netCDF whose name says nothing");
    write("b.nc", "no data");
    write("empty.nc", "");
    write("f2.nc", "\x89HDF\r\n");
    write("f10.nc", "\x89HDF\r\n");
    write(".hidden.nc", "CDF\x01");
    write("../secret.nc", "CDF\x01");
  }
  void TearDown() override {
    std::error_code ignored;
    fs::remove_all(above_, ignored);
  }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(root_ / name) << text;
  }
  [[nodiscard]] FolderList list(const std::string& folder = "", const std::string& after = "",
                                std::size_t count = 100) const {
    auto found = list_beneath(root_.native(), folder, after, count, rules);
    EXPECT_TRUE(found) << (found ? "" : found.error().message);
    return found ? std::move(*found) : FolderList{};
  }
  static std::vector<std::string> names(const FolderList& list) {
    std::vector<std::string> out;
    for (const FolderEntry& entry : list.entries) out.push_back(entry.name);
    return out;
  }

  fs::path above_;
  fs::path root_;
};

TEST_F(FolderListing, TellsFormatsByContentInNaturalOrder) {
  const FolderList found = list();
  EXPECT_THAT(names(found), ElementsAre("a.txt", "b.nc", "empty.nc", "f2.nc", "f10.nc", "runs"));
  EXPECT_EQ(found.entries[0].format, "netCDF");
  EXPECT_EQ(found.entries[1].format, "");
  EXPECT_EQ(found.entries[1].bytes, 7U);
  EXPECT_EQ(found.entries[2].format, "");
  EXPECT_EQ(found.entries[3].format, "netCDF-4 or HDF5");
  EXPECT_TRUE(found.entries[5].is_folder);
  EXPECT_EQ(found.entries[5].format, "");
  EXPECT_EQ(found.omitted, 0U);
  EXPECT_EQ(found.next, "");
  EXPECT_FALSE(found.cut);
  ASSERT_EQ(found.groups.size(), 1U);
  EXPECT_EQ(found.groups[0].pattern, "f*.nc");
  EXPECT_EQ(found.groups[0].files, 2U);
}

TEST_F(FolderListing, AFolderThatIsADatasetHasAFormat) {
  fs::create_directories(root_ / "store.zarr");
  write("store.zarr/.zgroup", "{}");
  fs::create_directories(root_ / "cavity/system");
  write("cavity/system/controlDict", "FoamFile {}");
  const FolderList found = list();
  ASSERT_EQ(found.entries.size(), 8U);
  EXPECT_EQ(found.entries[2].name, "cavity");
  EXPECT_EQ(found.entries[2].format, "OpenFOAM");
  EXPECT_EQ(found.entries[7].name, "store.zarr");
  EXPECT_EQ(found.entries[7].format, "Zarr");
}

TEST_F(FolderListing, LinksOutOfTheRootAndSpecialFilesAreNotListed) {
  fs::create_symlink("../secret.nc", root_ / "out.nc");
  fs::create_symlink("/etc/passwd", root_ / "absolute.nc");
  fs::create_symlink("..", root_ / "up");
  fs::create_symlink("gone.nc", root_ / "dangling.nc");
  fs::create_symlink("a.txt", root_ / "inside.nc");
  ASSERT_EQ(mkfifo((root_ / "pipe.nc").c_str(), 0600), 0);
  write("tab\t.nc", "CDF\x01");
  const FolderList found = list();
  EXPECT_THAT(names(found),
              ElementsAre("a.txt", "b.nc", "empty.nc", "f2.nc", "f10.nc", "inside.nc", "runs"));
  EXPECT_EQ(found.entries[5].format, "netCDF");
  EXPECT_EQ(found.omitted, 6U);
}

TEST_F(FolderListing, FoldersOutsideTheRootAreRefused) {
  fs::create_symlink("..", root_ / "up");
  fs::create_symlink("/etc", root_ / "absolute");
  for (const std::string folder :
       {"..", "runs/../..", "/etc", "up", "up/root", "absolute", ".", "http://host/a"}) {
    SCOPED_TRACE(folder);
    const auto found = list_beneath(root_.native(), folder, "", 10, rules);
    ASSERT_FALSE(found);
    EXPECT_EQ(found.error().kind, ErrorKind::invalid);
    EXPECT_THAT(found.error().message, Not(HasSubstr(above_.native())));
  }
  for (const std::string folder : {"nothing", "a.txt", "runs/may"}) {
    SCOPED_TRACE(folder);
    const auto found = list_beneath(root_.native(), folder, "", 10, rules);
    ASSERT_FALSE(found);
    EXPECT_EQ(found.error().kind, ErrorKind::not_found);
  }
}

TEST_F(FolderListing, PagesContinueAfterTheLastName) {
  std::vector<std::string> seen;
  std::string after;
  int pages = 0;
  do {
    const FolderList page = list("", after, 4);
    EXPECT_LE(page.entries.size(), 4U);
    EXPECT_EQ(page.groups.empty(), pages > 0);
    for (const std::string& name : names(page)) seen.push_back(name);
    after = page.next;
    ++pages;
  } while (!after.empty());
  EXPECT_EQ(pages, 2);
  EXPECT_EQ(seen, names(list()));
  EXPECT_THAT(list("", "runs").entries, IsEmpty());
}

TEST_F(FolderListing, ALargeFolderIsCut) {
  for (std::size_t n = 0; n <= folder_names_max; ++n) write("runs/" + std::to_string(n), "");
  const FolderList found = list("runs", "", 3);
  EXPECT_TRUE(found.cut);
  EXPECT_EQ(found.entries.size(), 3U);
}

std::vector<std::string> patterns(const std::vector<std::string>& names) {
  std::vector<std::string> out;
  for (const NameGroup& group : groups_of(names)) out.push_back(group.pattern);
  return out;
}

TEST(NameGroups, OnlyNumbersThatDifferBecomeWildcards) {
  EXPECT_THAT(patterns({"wrfout_d01_2001-01-01_00:00", "wrfout_d01_2001-01-02_06:00"}),
              ElementsAre("wrfout_d01_2001-01-*_*:00"));
  EXPECT_THAT(patterns({"a.nc", "b.nc", "f1.nc"}), IsEmpty());
  EXPECT_THAT(patterns({"s1.nc", "s2.nc", "t1.nc", "t2.nc", "t3.nc"}),
              ElementsAre("t*.nc", "s*.nc"));
}

// "a*.nc" would open a_b3.nc with a1.nc and a2.nc.
TEST(NameGroups, APatternThatMatchesOtherNamesIsNoGroup) {
  EXPECT_THAT(patterns({"a1.nc", "a2.nc", "a_b.nc"}), IsEmpty());
  EXPECT_THAT(patterns({"a[1].nc", "a[2].nc"}), IsEmpty());
}

TEST(NameGroups, AreLimited) {
  std::vector<std::string> names;
  for (int n = 0; n < 500; ++n) {
    const std::string stem(1, static_cast<char>('a' + n % 26));
    const std::string rest(static_cast<std::size_t>(n / 26) + 1, 'x');
    names.push_back(stem + rest + "_1.nc");
    names.push_back(stem + rest + "_2.nc");
  }
  EXPECT_EQ(groups_of(names).size(), name_groups_max);
}

}  // namespace
}  // namespace windsplat::data
