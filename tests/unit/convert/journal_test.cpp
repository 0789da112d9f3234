// Which units a later run takes as done.
#include "server/convert/journal.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "tests/unit/convert/made_source.hpp"
#include "tests/unit/disk.hpp"

namespace windsplat::convert {
namespace {

namespace fs = std::filesystem;

Plan plan_of(const std::string& compression = "lz4") {
  Options options;
  options.compression = compression;
  return make_plan(test::made_info({900, 600, 600}), {data::Coarsening{}}, options).value();
}

void write(const fs::path& path, const std::string& text) {
  fs::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << text;
}

std::string read(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// Three units whose files exist.
void add_units(const fs::path& store, const Plan& plan) {
  auto journal = Journal::open(store, plan, false);
  ASSERT_TRUE(journal) << journal.error().message;
  for (const std::size_t unit : {4U, 0U, 2U}) {
    const std::string path = "0/q/c/" + std::to_string(unit);
    write(store / path, "some bytes");
    write(kept_path(store, unit), "more");
    ASSERT_TRUE((*journal)->add(unit, {{{path, 10, 77}}, 4}));
  }
}

std::vector<std::size_t> done_in(const fs::path& store, const Plan& plan) {
  auto journal = Journal::open(store, plan, false);
  EXPECT_TRUE(journal) << journal.error().message;
  std::vector<std::size_t> out;
  if (journal) {
    for (const auto& [unit, files] : (*journal)->done()) out.push_back(unit);
  }
  return out;
}

TEST(ConvertJournal, UnitsAreThereAgain) {
  const test::Folder folder;
  const Plan plan = plan_of();
  add_units(folder.path(), plan);
  auto journal = Journal::open(folder.path(), plan, false);
  ASSERT_TRUE(journal);
  const auto done = (*journal)->done();
  ASSERT_EQ(done.size(), 3U);
  EXPECT_EQ(done.at(4).files, (std::vector<data::zarr::WrittenFile>{{"0/q/c/4", 10, 77}}));
  EXPECT_EQ(done.at(4).kept_bytes, 4U);
}

TEST(ConvertJournal, ATornLastLineIsDroppedAndLaterOnesAreAppendedAfterTheRest) {
  const test::Folder folder;
  const Plan plan = plan_of();
  add_units(folder.path(), plan);
  const std::string text = read(journal_path(folder.path()));
  for (const std::size_t lost : {1U, 2U, 20U}) {
    write(journal_path(folder.path()), text.substr(0, text.size() - lost));
    EXPECT_EQ(done_in(folder.path(), plan), (std::vector<std::size_t>{0, 4}));
    auto journal = Journal::open(folder.path(), plan, false);
    ASSERT_TRUE((*journal)->add(2, {{{"0/q/c/2", 10, 77}}, 4}));
    journal->reset();
    EXPECT_EQ(read(journal_path(folder.path())), text);
  }
}

TEST(ConvertJournal, ADamagedLineEndsWhatIsTaken) {
  const test::Folder folder;
  const Plan plan = plan_of();
  add_units(folder.path(), plan);
  std::string text = read(journal_path(folder.path()));
  text[text.find("\"unit\":0") + 7] = '3';
  write(journal_path(folder.path()), text);
  EXPECT_EQ(done_in(folder.path(), plan), (std::vector<std::size_t>{4}));
}

TEST(ConvertJournal, UnitsWithoutTheirFilesAreNotDone) {
  const test::Folder folder;
  const Plan plan = plan_of();
  add_units(folder.path(), plan);
  write(folder / "0/q/c/4", "some byte");
  fs::remove(kept_path(folder.path(), 2));
  EXPECT_EQ(done_in(folder.path(), plan), (std::vector<std::size_t>{0}));
}

TEST(ConvertJournal, OneOfAnotherPlanIsRefusedWithTheDifference) {
  const test::Folder folder;
  add_units(folder.path(), plan_of());
  const auto other = Journal::open(folder.path(), plan_of("zstd:3"), false);
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().kind, ErrorKind::conflict);
  EXPECT_NE(other.error().message.find("(compression: \"lz4\", now \"zstd:3\")"), std::string::npos)
      << other.error().message;
  EXPECT_EQ(done_in(folder.path(), plan_of()).size(), 3U);  // and it is as before
}

TEST(ConvertJournal, TwoRunsDoNotWriteOneStore) {
  const test::Folder folder;
  const Plan plan = plan_of();
  const auto first = Journal::open(folder.path(), plan, false);
  ASSERT_TRUE(first);
  const auto second = Journal::open(folder.path(), plan, false);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().kind, ErrorKind::conflict);
}

TEST(ConvertJournal, BegunAnewItEmptiesTheFolderUnlessAnotherRunHoldsIt) {
  const test::Folder folder;
  const Plan plan = plan_of();
  add_units(folder.path(), plan);
  auto first = Journal::open(folder.path(), plan, false);
  ASSERT_TRUE(first);
  EXPECT_FALSE(Journal::open(folder.path(), plan, true));
  EXPECT_TRUE(fs::exists(folder / "0/q/c/4"));
  first->reset();
  EXPECT_EQ(done_in(folder.path(), plan).size(), 3U);
  // Also one of another plan.
  auto anew = Journal::open(folder.path(), plan_of("none"), true);
  ASSERT_TRUE(anew) << anew.error().message;
  EXPECT_TRUE((*anew)->done().empty());
  EXPECT_FALSE(fs::exists(folder / "0"));
  EXPECT_FALSE(fs::exists(folder / ".coarse"));
}

TEST(ConvertJournal, AFullDiskIsAnError) {
  const test::Folder folder;
  const auto journal = Journal::open(folder.path(), plan_of(), false);
  ASSERT_TRUE(journal);
  const test::FullDisk full(fs::file_size(journal_path(folder.path())) + 9);
  const auto added = (*journal)->add(0, {{{"0/q/c/0", 10, 77}}, 4});
  ASSERT_FALSE(added);
  EXPECT_EQ(added.error().kind, ErrorKind::out_of_memory);
}

}  // namespace
}  // namespace windsplat::convert
