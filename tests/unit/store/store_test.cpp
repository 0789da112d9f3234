// Guarantees of the store: one load per field and step, one budget for all, referenced volumes stay
// valid.

#include "server/data/resident/store.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <new>
#include <stdexcept>
#include <thread>

#include "server/data/open/open.hpp"
#include "tests/unit/data/netcdf_maker.hpp"
#include "tests/unit/store/fake_source.hpp"
#include "tests/unit/store/small_file.hpp"

namespace windsplat::data {
namespace {

using test::Folder;
using test::write_small;

std::string numbered(int i) {
  std::string name("f");
  name += std::to_string(i);
  return name;
}

TEST(Store, IdsAreUniqueFileNames) {
  const Folder folder;
  std::filesystem::create_directory(folder / "sub");
  write_small(folder / "rain.nc", 0);
  write_small(folder / "sub/rain.cdf", 10);
  write_small(folder / "tornado.nc", 20);
  Store store(1 << 20);
  for (const char* name : {"rain.nc", "sub/rain.cdf", "tornado.nc"}) {
    auto added = store.add(folder / name);
    ASSERT_TRUE(added) << added.error().message;
  }
  ASSERT_TRUE(store.add("tornado"));
  std::vector<std::string> ids;
  for (const auto& dataset : store.all()) {
    ids.push_back(dataset->info().id);
  }
  EXPECT_EQ(ids, (std::vector<std::string>{"rain", "rain-2", "tornado", "tornado-2"}));
  EXPECT_EQ((*(*store.find("rain-2"))->volume("f", 0))->values[3], 13.0F);
  EXPECT_EQ((*store.find("tornado"))->info().format, "netCDF-4");
  EXPECT_EQ((*store.find("tornado-2"))->info().format, "sample");
}

TEST(Store, MissingDatasetIsNamed) {
  Store store(1 << 20);
  const auto found = store.find("nothing");
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().kind, ErrorKind::not_found);
  const auto added = store.add("hurricane");
  ASSERT_FALSE(added);
  EXPECT_EQ(added.error().kind, ErrorKind::not_found);
  EXPECT_NE(added.error().message.find("tornado"), std::string::npos) << added.error().message;
  EXPECT_TRUE(store.all().empty());
}

TEST(Store, DatasetsShareOneBudget) {
  const Folder folder;
  write_small(folder / "a.nc", 0);
  write_small(folder / "b.nc", 0);
  Store store(20);  // one volume of 16 bytes
  auto a = store.add(folder / "a.nc");
  auto b = store.add(folder / "b.nc");
  ASSERT_TRUE(a);
  ASSERT_TRUE(b);
  auto held = (*a)->volume("f", 0);
  ASSERT_TRUE(held);
  EXPECT_EQ((*b)->volume("f", 0).error().kind, ErrorKind::out_of_memory);
  *held = nullptr;
  EXPECT_TRUE((*b)->volume("f", 0));
  EXPECT_EQ((*a)->resident_bytes(), 0U);
  EXPECT_EQ((*b)->resident_bytes(), 16U);
}

TEST(Store, FileReadByManyThreadsGivesCorrectValues) {
  const Folder folder;
  Store store(1 << 24);
  for (int i = 0; i < 4; ++i) {
    write_small((folder / numbered(i)) + ".nc", 100.0 * i);
    ASSERT_TRUE(store.add((folder / numbered(i)) + ".nc"));
  }
  std::atomic<int> wrong{0};
  std::vector<std::thread> threads;
  threads.reserve(8);
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (int round = 0; round < 20; ++round) {
        const auto source = open_file((folder / numbered(t)) + ".nc");
        const auto own = source ? (*source)->read(0, 0) : Result<Volume>(source.error());
        const auto shared = (*store.find(numbered(3 - t)))->volume("f", 0);
        wrong += !own || own->values[2] != 100.0F * static_cast<float>(t) + 2 ? 1 : 0;
        wrong += !shared || (*shared)->values[1] != 100.0F * static_cast<float>(3 - t) + 1 ? 1 : 0;
      }
    });
  }
  for (std::thread& thread : threads) {
    thread.join();
  }
  EXPECT_EQ(wrong, 0);
}

TEST(Store, SameFilesAreOneDatasetWhenAddedAgain) {
  const Folder folder;
  write_small(folder / "rain.nc", 0);
  std::filesystem::create_symlink(folder / "rain.nc", folder / "link.nc");
  std::atomic<int> opened{0};
  StoreOptions options;
  options.bytes_max = 1 << 20;
  options.open = [&](const Location& location,
                     const CancelToken&) -> Result<std::unique_ptr<Source>> {
    ++opened;
    return open_file(location.members.front().path);
  };
  Store store(options);
  std::vector<std::shared_ptr<Dataset>> got(6);
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < got.size(); ++t) {
    threads.emplace_back([&, t] {
      auto added = store.add(folder / (t % 2 == 0 ? "rain.nc" : "link.nc"));
      if (added) got[t] = *added;
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(opened, 1);
  for (const auto& dataset : got) EXPECT_EQ(dataset, got[0]);
  EXPECT_EQ(store.all().size(), 1U);
  EXPECT_EQ(store.add("tornado").value(), store.add("tornado").value());
  ASSERT_TRUE(store.remove(got[0]->info().id));
  EXPECT_FALSE(store.find(got[0]->info().id));
  ASSERT_TRUE(store.add(folder / "rain.nc"));
  EXPECT_EQ(opened, 2) << "a removed dataset is reopened";
}

TEST(Store, RefusedDatasetStaysFailedUntilItPasses) {
  const Folder folder;
  const std::string file = folder / "rain.nc";
  write_small(file, 0);
  bool refuses = true;
  StoreOptions options;
  options.bytes_max = 1 << 20;
  options.check = [&](const Dataset& /*dataset*/, const Dataset* /*before*/) -> Result<void> {
    if (refuses) return make_error(ErrorKind::out_of_memory, "too large");
    return {};
  };
  Store store(options);
  const auto refused = store.add(file);
  ASSERT_FALSE(refused);
  EXPECT_TRUE(store.all().empty());
  store.list_failed(file, refused.error());
  EXPECT_FALSE(store.add(file));
  ASSERT_EQ(store.failed().size(), 1U);
  refuses = false;
  const auto added = store.add(file);
  ASSERT_TRUE(added) << added.error().message;
  EXPECT_EQ((*added)->info().id, "rain") << "under its listed id";
  EXPECT_TRUE(store.failed().empty());
}

// Other waiters for the same volume must not wait forever.
TEST(Budget, ExceptionIsAnErrorAndTheLoadCanBeRetried) {
  Budget budget(1000);
  const ResidentKey key{budget.next_owner(), 0, 0, ""};
  const auto fails =
      budget.get(key, 600, Urgency::demand, []() -> Result<Resident> { throw std::bad_alloc(); });
  ASSERT_FALSE(fails);
  EXPECT_EQ(fails.error().kind, ErrorKind::out_of_memory);
  EXPECT_EQ(budget.counts().bytes, 0U);
  const auto works = budget.get(key, 600, Urgency::demand,
                                [] { return Result<Resident>(std::make_shared<const int>(7)); });
  EXPECT_TRUE(works);
}

TEST(Store, ExceptionWhileOpeningIsAnErrorAndCanBeRetried) {
  const Folder folder;
  write_small(folder / "rain.nc", 0);
  int asked = 0;
  Store store({1 << 20, Storage::float32,
               [&](const Location&, const CancelToken&) -> Result<std::unique_ptr<Source>> {
                 if (++asked == 1) throw std::runtime_error("a bug");
                 return std::unique_ptr<Source>(std::make_unique<FakeSource>());
               }});
  const auto failed = store.add(folder / "rain.nc");
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().kind, ErrorKind::internal);
  EXPECT_TRUE(store.add(folder / "rain.nc"));
}

// Steps and positions can take more memory than the shown data.
TEST(Store, MetadataOfADatasetCountsInTheLimit) {
  const Folder folder;
  write_small(folder / "rain.nc", 0);
  Store store({4 << 20, Storage::float32,
               [](const Location&, const CancelToken&) -> Result<std::unique_ptr<Source>> {
                 auto source = std::make_unique<FakeSource>();
                 source->change().steps.resize(100'000, {0, std::string(40, 't')});
                 return std::unique_ptr<Source>(std::move(source));
               }});
  const auto added = store.add(folder / "rain.nc");
  ASSERT_FALSE(added);
  EXPECT_EQ(added.error().kind, ErrorKind::out_of_memory);
  EXPECT_TRUE(store.all().empty());
  EXPECT_EQ(store.counts().bytes, 0U);
}

// A model is writing its newest file.
TEST(Store, ChangeOfTheLastFileOfALongSeriesIsDetected) {
  const Folder folder;
  for (int i = 100; i < 200; ++i) std::ofstream(folder / numbered(i)) << "a step";
  StoreOptions options;
  options.bytes_max = 1 << 20;
  options.open = [](const Location&, const CancelToken&) -> Result<std::unique_ptr<Source>> {
    return std::unique_ptr<Source>(std::make_unique<FakeSource>());
  };
  Store store(options);
  ASSERT_TRUE(store.add(folder / "f1*"));
  EXPECT_TRUE(store.look_for_changes(0).empty());
  std::ofstream(folder / numbered(199), std::ios::app) << " and more of it";
  EXPECT_EQ(store.look_for_changes(0).size(), 1U);
}

TEST(Store, DatasetRemovedWhileReopeningStaysRemoved) {
  const Folder folder;
  std::ofstream(folder / "rain") << "a";
  Store* whole = nullptr;
  StoreOptions options;
  options.bytes_max = 1 << 20;
  options.open = [&](const Location&, const CancelToken&) -> Result<std::unique_ptr<Source>> {
    if (whole != nullptr) static_cast<void>(whole->remove("rain"));
    return std::unique_ptr<Source>(std::make_unique<FakeSource>());
  };
  Store store(options);
  ASSERT_TRUE(store.add(folder / "rain"));
  whole = &store;
  std::ofstream(folder / "rain") << "more";
  store.look_for_changes(0);
  EXPECT_TRUE(store.all().empty());
}

}  // namespace
}  // namespace windsplat::data
