// Paths below a data root that can be opened, and rejection of all others.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "server/data/files/files.hpp"
#include "server/data/files/locate_parts.hpp"

namespace windsplat::data {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

class LocateBeneath : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "windsplat-root-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    above_ = fs::canonical(name);
    root_ = above_ / "root";
    fs::create_directories(root_ / "runs/may");
    for (const char* file :
         {"a.nc", "odd[1].nc", "runs/f10.nc", "runs/f2.nc", "runs/x.pvd", "runs/p1.pvtu"}) {
      std::ofstream(root_ / file) << "data";
    }
    std::ofstream(above_ / "secret.nc") << "secret";
    fs::create_symlink("a.nc", root_ / "inside.nc");
    fs::create_symlink("../../a.nc", root_ / "runs/may/up.nc");
    fs::create_symlink("../secret.nc", root_ / "out.nc");
    fs::create_symlink(above_ / "secret.nc", root_ / "absolute.nc");
    fs::create_symlink("..", root_ / "outfolder");
    fs::create_symlink("round.nc", root_ / "round.nc");
    ASSERT_EQ(mkfifo((root_ / "pipe.nc").c_str(), 0600), 0);
  }
  void TearDown() override {
    std::error_code ignored;
    fs::remove_all(above_, ignored);
  }

  Location located(const std::string& path) {
    auto found = locate_beneath(root_.native(), path);
    EXPECT_TRUE(found) << path << ": " << (found ? "" : found.error().message);
    return found ? *found : Location{};
  }
  ErrorKind refusal(const std::string& path) {
    const auto found = locate_beneath(root_.native(), path);
    EXPECT_FALSE(found) << path;
    if (found) return ErrorKind::internal;
    EXPECT_THAT(found.error().message, Not(HasSubstr(root_.native()))) << "reveals the data root";
    EXPECT_THAT(found.error().message, Not(HasSubstr(above_.filename().native())));
    return found.error().kind;
  }

  fs::path above_;
  fs::path root_;
};

TEST_F(LocateBeneath, FindsAFileLikeLocate) {
  for (const char* path : {"a.nc", "./a.nc", "runs//f2.nc", "runs/x.pvd", "odd[1].nc"}) {
    const Location found = located(path);
    const auto same = locate((root_ / path).native());
    ASSERT_TRUE(same) << path;
    EXPECT_EQ(found.kind, Location::Kind::file);
    ASSERT_EQ(found.members.size(), 1U);
    EXPECT_EQ(found.members[0].path, same->members[0].path);
    EXPECT_EQ(found.members[0].name, same->members[0].name);
    EXPECT_EQ(found.folder, same->folder);
    EXPECT_EQ(found.stem, same->stem);
    EXPECT_EQ(found.companions, same->companions) << path;
  }
  EXPECT_TRUE(located("runs/x.pvd").companions);
  EXPECT_FALSE(located("a.nc").companions);
}

TEST_F(LocateBeneath, LinksInsideTheRootAreResolved) {
  EXPECT_EQ(located("inside.nc").members[0].path, (root_ / "a.nc").native());
  EXPECT_EQ(located("inside.nc").stem, "inside");
  EXPECT_EQ(located("runs/may/up.nc").members[0].path, (root_ / "a.nc").native());
}

TEST_F(LocateBeneath, FolderIsAFolder) {
  const Location found = located("runs/may/");
  EXPECT_EQ(found.kind, Location::Kind::folder);
  EXPECT_EQ(found.folder, (root_ / "runs/may").native());
  EXPECT_EQ(found.stem, "may");
  EXPECT_TRUE(found.members.empty());
}

TEST_F(LocateBeneath, PatternInTheLastPartIsASeriesInNaturalOrder) {
  const Location found = located("runs/f*.nc");
  EXPECT_EQ(found.kind, Location::Kind::series);
  EXPECT_EQ(found.stem, "f");
  ASSERT_EQ(found.members.size(), 2U);
  EXPECT_EQ(found.members[0].name, "f2.nc");
  EXPECT_EQ(found.members[1].path, (root_ / "runs/f10.nc").native());
  EXPECT_EQ(refusal("runs/g*.nc"), ErrorKind::not_found);
  EXPECT_EQ(refusal("r*/f2.nc"), ErrorKind::not_found) << "a pattern before the last part";
  EXPECT_EQ(located("[a].nc").members.size(), 1U);
  EXPECT_FALSE(found.companions);
  EXPECT_TRUE(located("runs/p*.pvtu").companions) << "headers of VTK name their pieces";
  EXPECT_FALSE(located("runs/x*.pvd").companions) << "a collection is a series itself";
}

TEST_F(LocateBeneath, AListIsNamedAfterWhatItsFilesHaveInCommonOrTheFirst) {
  for (const auto& [pattern, stem] :
       {std::pair("{ua,va}_hist.nc", "hist"), std::pair("{run_1,run_2}.nc", "run"),
        std::pair("{wrf_a.nc,wrf_b.nc}", "wrf"), std::pair("{ua,va}.nc", "ua"),
        std::pair("{ua_*.nc,va_*.nc}", "ua"), std::pair("*.nc", "series")}) {
    EXPECT_EQ(stem_of_pattern(pattern), stem) << pattern;
  }
}

TEST_F(LocateBeneath, GroupIsNamedAfterTheFile) {
  const Location found = located("a.nc#/sub/deep");
  EXPECT_EQ(found.inside, "sub/deep");
  EXPECT_EQ(found.members[0].path, (root_ / "a.nc").native());
  EXPECT_EQ(found.stem, "a");
  EXPECT_EQ(located("runs/f*.nc#/g").inside, "g");
  EXPECT_EQ(located("runs/f*.nc#/g").members.size(), 2U);
  // A folder with that name is a folder.
  fs::create_directory(root_ / "odd#");
  std::ofstream(root_ / "odd#/b.nc") << "data";
  EXPECT_EQ(located("odd#/b.nc").inside, "");
  EXPECT_EQ(located("odd#/b.nc#/g").members[0].path, (root_ / "odd#/b.nc").native());
  EXPECT_EQ(located("odd#/b.nc#/g").inside, "g");

  EXPECT_EQ(refusal("b.nc#/g"), ErrorKind::not_found);
  EXPECT_THAT(locate_beneath(root_.native(), "b.nc#/g").error().message, HasSubstr("'b.nc': no"));
  EXPECT_EQ(refusal("a.nc#/g#/h"), ErrorKind::not_found);
  EXPECT_EQ(refusal("runs/may#/g"), ErrorKind::invalid);
  EXPECT_EQ(refusal("out.nc#/g"), ErrorKind::invalid);
  EXPECT_EQ(refusal("#/g"), ErrorKind::not_found);
}

TEST_F(LocateBeneath, PathsOutsideTheRootAreRefused) {
  for (const std::string path :
       {"..", "../secret.nc", "runs/../../secret.nc", "runs/..", "a.nc/..", "out.nc", "absolute.nc",
        "outfolder", "outfolder/secret.nc", "outfolder/*.nc", "../*.nc", "ou*.nc", "round.nc"}) {
    EXPECT_EQ(refusal(path), ErrorKind::invalid) << path;
  }
  const auto inside = locate_beneath(root_.native(), (root_ / "a.nc").native());
  ASSERT_FALSE(inside);
  EXPECT_EQ(inside.error().kind, ErrorKind::invalid) << "absolute, although inside";
}

TEST_F(LocateBeneath, InvalidFileNamesAreRefused) {
  for (const std::string path : {"", ".", "./", "./.", "/", "/etc/passwd", "http://x/a.nc",
                                 "file:///etc/passwd", "s3://b/a.nc"}) {
    EXPECT_EQ(refusal(path), ErrorKind::invalid) << path;
  }
  EXPECT_EQ(refusal(std::string("a.nc\0.png", 9)), ErrorKind::invalid);
  EXPECT_EQ(refusal("a.nc#mode=zarr"), ErrorKind::not_found);
  EXPECT_EQ(refusal("b.nc"), ErrorKind::not_found);
  EXPECT_EQ(refusal("a.nc/b.nc"), ErrorKind::not_found);
  EXPECT_EQ(refusal(std::string(300, 'x')), ErrorKind::invalid) << "longer than any name";
}

TEST_F(LocateBeneath, PipeIsRefusedWithoutBlocking) {
  EXPECT_EQ(refusal("pipe.nc"), ErrorKind::invalid);
  EXPECT_EQ(refusal("pipe*"), ErrorKind::not_found) << "a series consists of files";
}

// A folder is accessed whenever its files are read, long after it was located.
TEST_F(LocateBeneath, FolderReplacedByALinkIsRefused) {
  fs::create_directories(above_ / "elsewhere");
  std::ofstream(above_ / "elsewhere/f2.nc") << "secret";
  const auto before = direct_files(located("runs"));
  ASSERT_TRUE(before->open("f2.nc"));
  fs::rename(root_ / "runs", root_ / "moved");
  fs::create_symlink(above_ / "elsewhere", root_ / "runs");
  Location runs = located("moved");
  runs.folder = (root_ / "runs").native();
  const auto after = direct_files(runs);
  EXPECT_FALSE(after->open("f2.nc"));
  EXPECT_FALSE(after->list(""));
  EXPECT_FALSE(after->exists("f2.nc"));
}

TEST_F(LocateBeneath, PatternIsMatchedAgainWithinTheSameRoot) {
  const Location series = located("runs/f*.nc");
  std::ofstream(root_ / "runs/f3.nc") << "data";
  const auto again = locate_again(series);
  ASSERT_TRUE(again) << again.error().message;
  ASSERT_EQ(again->members.size(), 3U);
  EXPECT_EQ(again->members[1].name, "f3.nc");
  fs::create_symlink(above_ / "secret.nc", root_ / "runs/f4.nc");
  fs::create_symlink("nowhere.nc", root_ / "runs/f5.nc");
  fs::create_symlink("f6.nc", root_ / "runs/f6.nc");
  const auto beside_links = locate_again(series);
  ASSERT_TRUE(beside_links)
      << "dangling links and links out of the root are not part of the series";
  EXPECT_EQ(beside_links->members.size(), 3U);
}

TEST_F(LocateBeneath, LinksOmittedFromASeriesAreReported) {
  fs::create_symlink("f2.nc", root_ / "runs/f1.nc");
  EXPECT_EQ(links_left_out(located("runs/f*.nc")), "") << "a link to a file is that file";
  EXPECT_EQ(links_left_out(located("runs/f2.nc")), "");
  fs::create_symlink("../../secret.nc", root_ / "runs/f3.nc");
  EXPECT_EQ(
      links_left_out(located("runs/f*.nc")),
      "1 of 4 names that match the pattern is omitted: links that are dangling or lead out of "
      "the data root");
  fs::create_symlink("nowhere.nc", root_ / "runs/f4.nc");
  fs::create_symlink("nowhere.nc", root_ / "runs/g4.nc");
  EXPECT_THAT(links_left_out(located("runs/f*.nc")), HasSubstr("2 of 5 names"));
  EXPECT_EQ(links_left_out(locate((root_ / "runs/f*.nc").native()).value()),
            "1 of 5 names that match the pattern is omitted: links that are dangling");
}

TEST_F(LocateBeneath, LookupReadsNothing) {
  const fs::path locked = root_ / "runs/f2.nc";
  fs::permissions(locked, fs::perms::none);
  EXPECT_EQ(located("runs/f2.nc").members.size(), 1U);
}

}  // namespace
}  // namespace windsplat::data
