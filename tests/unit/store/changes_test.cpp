// Behaviour of the store when the files of its datasets change.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>

#include "server/data/open/open.hpp"
#include "server/data/resident/store.hpp"
#include "tests/unit/data/netcdf_maker.hpp"
#include "tests/unit/store/small_file.hpp"

namespace windsplat::data {
namespace {

using test::Folder;
using test::NetcdfMaker;
using test::write_small;

TEST(Store, ChangedFileIsReopenedUnderItsName) {
  const Folder folder;
  write_small(folder / "rain.nc", 0);
  Store store(1 << 20);
  const auto before = store.add(folder / "rain.nc").value();
  const auto held = before->volume("f", 0).value();
  EXPECT_TRUE(store.look_for_changes(0).empty()) << "nothing has changed";

  write_small(folder / "new.nc", 50);
  std::filesystem::rename(folder / "new.nc", folder / "rain.nc");
  EXPECT_TRUE(store.look_for_changes(3600).empty()) << "it may still be incomplete";
  EXPECT_EQ(store.look_for_changes(0), std::vector<std::string>{"rain"});
  const auto after = store.find("rain").value();
  EXPECT_NE(after, before);
  EXPECT_EQ(after->volume("f", 0).value()->values[3], 53.0F);
  EXPECT_EQ(held->values[3], 3.0F) << "held volumes are unchanged";

  std::ofstream(folder / "rain.nc", std::ios::trunc) << "no longer a netCDF file";
  EXPECT_TRUE(store.look_for_changes(0).empty());
  EXPECT_EQ(store.find("rain").value(), after) << "the old data are kept";
  EXPECT_NE(store.problem("rain").find("changed"), std::string::npos);
  EXPECT_EQ(after->volume("f", 0).value()->values[3], 53.0F);
}

// One step at that hour, its third value `first` + 3.
void write_hour(const std::string& path, double hour, double first) {
  NetcdfMaker file(path);
  const int t = file.axis("time", {hour}, "hours since 2001-01-01");
  const int y = file.axis("lat", {0, 1}, "degrees_north");
  const int x = file.axis("lon", {0, 1}, "degrees_east");
  file.variable("f", NC_FLOAT, {t, y, x}, test::counting(4, first));
}

TEST(Store, SeriesGrowsAndShrinksWithItsFolder) {
  const Folder folder;
  write_hour(folder / "f1.nc", 1, 10);
  write_hour(folder / "f2.nc", 2, 20);
  Store store(1 << 20);
  const std::string id = store.add(folder / "f*.nc").value()->info().id;
  EXPECT_TRUE(store.look_for_changes(0).empty());
  std::ofstream(folder / "notes.txt") << "not part of the series";
  EXPECT_TRUE(store.look_for_changes(0).empty());
  ASSERT_EQ(store.find(id).value()->info().steps.size(), 2U);

  write_hour(folder / "f3.nc", 3, 30);
  EXPECT_EQ(store.look_for_changes(0), std::vector<std::string>{id});
  const auto longer = store.find(id).value();
  ASSERT_EQ(longer->info().steps.size(), 3U);
  EXPECT_EQ(longer->volume("f", 2).value()->values[3], 33.0F);

  std::filesystem::remove(folder / "f1.nc");
  EXPECT_EQ(store.look_for_changes(0), std::vector<std::string>{id});
  EXPECT_EQ(store.find(id).value()->volume("f", 0).value()->values[3], 23.0F);
}

TEST(Store, OmittedFilesOfASeriesAreNoted) {
  const Folder folder;
  write_hour(folder / "f1.nc", 1, 10);
  std::filesystem::create_symlink("nowhere.nc", folder / "f2.nc");
  Store store(1 << 20);
  const std::string id = store.add(folder / "f*.nc").value()->info().id;
  EXPECT_EQ(store.note(id).find("1 of 2 names"), 0U) << store.note(id);
  std::filesystem::create_symlink("nowhere.nc", folder / "f3.nc");
  EXPECT_TRUE(store.look_for_changes(0).empty()) << "its files are the same";
  EXPECT_EQ(store.note(id).find("2 of 3 names"), 0U) << store.note(id);
  std::filesystem::remove(folder / "f3.nc");
  write_hour(folder / "nowhere.nc", 2, 20);
  EXPECT_EQ(store.look_for_changes(0), std::vector<std::string>{id});
  EXPECT_EQ(store.note(id), "");
}

// Like the output of a running model: the same file with the same size.
TEST(Store, FileOverwrittenInPlaceIsReopened) {
  const Folder folder;
  write_small(folder / "rain.nc", 0);
  write_small(folder / "new.nc", 50);
  const std::string bytes = test::bytes_of(folder / "new.nc");
  ASSERT_EQ(bytes.size(), std::filesystem::file_size(folder / "rain.nc"));
  Store store(1 << 20);
  ASSERT_TRUE(store.add(folder / "rain.nc"));
  const auto opened_at = std::filesystem::last_write_time(folder / "rain.nc");
  std::fstream(folder / "rain.nc", std::ios::in | std::ios::out | std::ios::binary) << bytes;
  std::filesystem::last_write_time(folder / "rain.nc", opened_at - std::chrono::seconds(5));
  EXPECT_EQ(store.look_for_changes(1), std::vector<std::string>{"rain"});
  EXPECT_EQ(store.find("rain").value()->volume("f", 0).value()->values[3], 53.0F);
}

TEST(Store, FailedReopenIsRetriedAfterAChange) {
  const Folder folder;
  write_small(folder / "rain.nc", 0);
  std::atomic<int> opened{0};
  StoreOptions options;
  options.bytes_max = 1 << 20;
  options.open = [&](const Location& location,
                     const CancelToken&) -> Result<std::unique_ptr<Source>> {
    ++opened;
    return open_file(location.members.front().path);
  };
  Store store(options);
  ASSERT_TRUE(store.add(folder / "rain.nc"));
  for (const char* text : {"no numbers", "no numbers either"}) {
    std::ofstream(folder / "rain.nc", std::ios::trunc) << text;
    for (int look = 0; look < 3; ++look) EXPECT_TRUE(store.look_for_changes(0).empty());
  }
  EXPECT_EQ(opened, 3) << "at first, and once for each of two changes";
  write_small(folder / "new.nc", 50);
  std::filesystem::rename(folder / "new.nc", folder / "rain.nc");
  EXPECT_EQ(store.look_for_changes(0), std::vector<std::string>{"rain"});
  EXPECT_EQ(store.problem("rain"), "");
}

// A first view that no longer fits would make every frame an error.
TEST(Store, DatasetThatFailsTheCheckDoesNotReplaceAValidOne) {
  const Folder folder;
  write_small(folder / "rain.nc", 0);
  std::atomic<int> opened{0};
  bool is_too_large = false;
  StoreOptions options;
  options.bytes_max = 1 << 20;
  options.open = [&](const Location& location,
                     const CancelToken&) -> Result<std::unique_ptr<Source>> {
    ++opened;
    return open_file(location.members.front().path);
  };
  options.check = [&](const Dataset& /*dataset*/, const Dataset* /*before*/) -> Result<void> {
    if (is_too_large) return make_error(ErrorKind::out_of_memory, "it needs 9 GiB");
    return {};
  };
  Store store(options);
  const auto before = store.add(folder / "rain.nc").value();
  const auto replace = [&](double first) {
    write_small(folder / "new.nc", first);
    std::filesystem::rename(folder / "new.nc", folder / "rain.nc");
  };
  is_too_large = true;
  replace(50);
  for (int look = 0; look < 3; ++look) EXPECT_TRUE(store.look_for_changes(0).empty());
  EXPECT_EQ(opened, 2) << "at first, and once for the change";
  EXPECT_EQ(store.find("rain").value(), before) << "the old data are kept";
  EXPECT_NE(store.problem("rain").find("it needs 9 GiB"), std::string::npos);
  is_too_large = false;
  replace(60);
  EXPECT_EQ(store.look_for_changes(0), std::vector<std::string>{"rain"});
  EXPECT_EQ(store.problem("rain"), "");
}

TEST(Store, FailedDatasetIsOpenedWhenItsFileIsReplaced) {
  const Folder folder;
  const std::string rain = folder / "rain.nc";
  const std::string snow = folder / "snow.nc";
  std::ofstream(rain) << "no numbers";
  std::atomic<int> opened{0};
  StoreOptions options;
  options.bytes_max = 1 << 20;
  options.open = [&](const Location& location,
                     const CancelToken&) -> Result<std::unique_ptr<Source>> {
    ++opened;
    return open_file(location.members.front().path);
  };
  Store store(options);
  for (const std::string& name : {rain, snow}) {
    store.list_failed(name, store.add(name).error());
  }
  EXPECT_TRUE(store.look_for_changes(0).empty());
  EXPECT_EQ(opened, 2) << "it may have changed while opening";
  EXPECT_TRUE(store.look_for_changes(0).empty());
  EXPECT_EQ(opened, 2);
  store.try_failed_again();
  EXPECT_TRUE(store.look_for_changes(0).empty());
  EXPECT_TRUE(store.look_for_changes(0).empty());
  EXPECT_EQ(opened, 3);

  write_small(rain, 50);
  write_small(snow, 50);
  EXPECT_TRUE(store.look_for_changes(3600).empty()) << "they may still be incomplete";
  EXPECT_EQ(store.look_for_changes(0), (std::vector<std::string>{"rain", "snow"}));
  EXPECT_TRUE(store.failed().empty());
  EXPECT_EQ(store.find("rain").value()->volume("f", 0).value()->values[3], 53.0F);
}

TEST(Store, DatasetOpenedByItsNewNameIsNoLongerFailed) {
  const Folder folder;
  const std::string late = folder / "late.nc";
  Store store(1 << 20);
  store.list_failed(late, store.add(late).error());
  write_small(late, 50);
  const auto added = store.add(late);
  ASSERT_TRUE(added);
  EXPECT_TRUE(store.look_for_changes(0).empty()) << "it was already open";
  EXPECT_TRUE(store.failed().empty());
  EXPECT_EQ(store.all().size(), 1U);
}

TEST(Store, DatasetRemovedWhileOpeningStaysRemoved) {
  const Folder folder;
  const std::string rain = folder / "rain.nc";
  std::ofstream(rain) << "no numbers";
  Store* whole = nullptr;
  bool removed = false;
  StoreOptions options;
  options.bytes_max = 1 << 20;
  options.open = [&](const Location& location,
                     const CancelToken&) -> Result<std::unique_ptr<Source>> {
    if (whole != nullptr) removed = whole->remove_failed("rain");
    return open_file(location.members.front().path);
  };
  Store store(options);
  store.list_failed(rain, store.add(rain).error());
  write_small(rain, 50);
  whole = &store;
  EXPECT_TRUE(store.look_for_changes(0).empty());
  EXPECT_TRUE(removed);
  EXPECT_TRUE(store.all().empty());
}

}  // namespace
}  // namespace windsplat::data
