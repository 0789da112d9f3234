// Guarantees of the store: one load per field and step, one budget for all, held volumes stay
// valid.
#include "server/data/resident/store.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <new>
#include <stdexcept>
#include <thread>

#include "server/data/open/open.hpp"
#include "tests/unit/data/netcdf_maker.hpp"
#include "tests/unit/store/small_file.hpp"

namespace windsplat::data {
namespace {

using test::Folder;
using test::write_small;

constexpr std::uint64_t kVolumeBytes = 4000;  // 10 x 10 x 10 float32

// A source of 10 x 10 x 10 volumes whose samples encode field and step. It can block at a gate, and
// fail.
class FakeSource : public Source {
 public:
  FakeSource() {
    for (Axis& axis : info_.grid.axes) {
      axis.coordinates = test::counting(10);
    }
    for (const char* name : {"a", "b", "c"}) {
      FieldInfo field;
      field.name = name;
      field.components = {name};
      info_.fields.push_back(field);
    }
    FieldInfo vector;
    vector.name = "v";
    vector.kind = FieldKind::vector;
    vector.components = {"a", "b", "c"};
    info_.fields.push_back(vector);
    info_.steps.resize(100);
  }
  [[nodiscard]] const DatasetInfo& info() const override { return info_; }
  Result<Volume> read(std::size_t field, std::size_t step) override {
    const int inside = inside_.fetch_add(1) + 1;
    EXPECT_EQ(inside, 1) << "a source is not thread-safe";
    if (gate != nullptr) {
      gate->wait();
    }
    inside_.fetch_sub(1);
    if (failures > 0) {
      --failures;
      return make_error(ErrorKind::bad_data, "read failed");
    }
    if (throws_logic) {
      throw std::logic_error("a bug");
    }
    if (throws_memory) {
      throw std::bad_alloc();
    }
    Volume volume;
    volume.dims = {10, 10, 10};
    volume.components = static_cast<int>(info_.fields[field].components.size());
    volume.values =
        std::vector<float>(volume.samples() * static_cast<std::size_t>(volume.components),
                           static_cast<float>(field * 1000 + step));
    finish_volume(volume);
    return volume;
  }

  // Blocks readers until it is opened.
  class Gate {
   public:
    void wait() {
      std::unique_lock lock(mutex_);
      ++waiting_;
      changed_.notify_all();
      changed_.wait(lock, [this] { return open_; });
    }
    void open() {
      const std::lock_guard lock(mutex_);
      open_ = true;
      changed_.notify_all();
    }
    void wait_for_reader() {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return waiting_ > 0; });
    }

   private:
    std::mutex mutex_;
    std::condition_variable changed_;
    bool open_ = false;
    int waiting_ = 0;
  };

  DatasetInfo& change() { return info_; }

  std::shared_ptr<Gate> gate;
  int failures = 0;
  bool throws_logic = false;
  bool throws_memory = false;

 private:
  DatasetInfo info_;
  std::atomic<int> inside_{0};
};

std::unique_ptr<Dataset> make_dataset(std::uint64_t volumes_max) {
  return std::make_unique<Dataset>(std::make_unique<FakeSource>(), "fake",
                                   volumes_max * kVolumeBytes);
}

TEST(Dataset, LoadsOnFirstUseAndOnlyOnce) {
  const auto dataset = make_dataset(10);
  EXPECT_EQ(dataset->info().id, "fake");
  EXPECT_EQ(dataset->loads(), 0U);
  EXPECT_EQ(dataset->resident_bytes(), 0U);
  const auto first = dataset->volume("b", 7);
  ASSERT_TRUE(first);
  EXPECT_EQ((*first)->values[0], 1007.0F);
  const auto again = dataset->volume("b", 7);
  ASSERT_TRUE(again);
  EXPECT_EQ(first->get(), again->get());
  EXPECT_EQ(dataset->loads(), 1U);
  EXPECT_EQ(dataset->resident_bytes(), kVolumeBytes);
  ASSERT_TRUE(dataset->volume("v", 7));
  EXPECT_EQ(dataset->resident_bytes(), 4 * kVolumeBytes);
}

TEST(Dataset, ReportsUnknownFieldsAndSteps) {
  const auto dataset = make_dataset(10);
  const auto field = dataset->volume("nothing", 0);
  ASSERT_FALSE(field);
  EXPECT_EQ(field.error().kind, ErrorKind::not_found);
  EXPECT_NE(field.error().message.find("'nothing'"), std::string::npos);
  const auto step = dataset->volume("a", 100);
  ASSERT_FALSE(step);
  EXPECT_EQ(step.error().kind, ErrorKind::not_found);
  EXPECT_NE(step.error().message.find("99"), std::string::npos);
  EXPECT_EQ(dataset->loads(), 0U);
}

TEST(Dataset, ConcurrentThreadsShareOneLoad) {
  auto source = std::make_unique<FakeSource>();
  auto gate = std::make_shared<FakeSource::Gate>();
  source->gate = gate;
  Dataset dataset(std::move(source), "fake", 10 * kVolumeBytes);
  std::vector<std::shared_ptr<const Volume>> got(8);
  std::vector<std::thread> threads;
  threads.reserve(8);
  for (std::size_t t = 0; t < got.size(); ++t) {
    threads.emplace_back([&, t] {
      auto volume = dataset.volume("a", 3);
      if (volume) {
        got[t] = *volume;
      }
    });
  }
  gate->wait_for_reader();
  gate->open();
  for (std::thread& thread : threads) {
    thread.join();
  }
  EXPECT_EQ(dataset.loads(), 1U);
  ASSERT_NE(got[0], nullptr);
  for (const auto& volume : got) {
    EXPECT_EQ(volume, got[0]);
  }
}

TEST(Dataset, LeastRecentlyUsedIsEvictedFirst) {
  const auto dataset = make_dataset(3);
  for (const std::size_t step : {0, 1, 2}) {
    ASSERT_TRUE(dataset->volume("a", step));
  }
  ASSERT_TRUE(dataset->volume("a", 0));  // used again: 1 is now the oldest
  ASSERT_TRUE(dataset->volume("a", 3));
  EXPECT_EQ(dataset->loads(), 4U);
  EXPECT_EQ(dataset->resident_bytes(), 3 * kVolumeBytes);
  ASSERT_TRUE(dataset->volume("a", 0));
  ASSERT_TRUE(dataset->volume("a", 2));
  EXPECT_EQ(dataset->loads(), 4U);
  ASSERT_TRUE(dataset->volume("a", 1));
  EXPECT_EQ(dataset->loads(), 5U);
}

TEST(Dataset, HeldVolumeIsNotEvictedAndStaysValid) {
  const auto dataset = make_dataset(3);
  auto held = dataset->volume("a", 0);
  ASSERT_TRUE(held);
  for (std::size_t step = 1; step < 20; ++step) {
    ASSERT_TRUE(dataset->volume("a", step));
    EXPECT_LE(dataset->resident_bytes(), 3 * kVolumeBytes);
  }
  EXPECT_EQ(dataset->volume("a", 0)->get(), held->get());
  EXPECT_EQ((*held)->values[999], 0.0F);
  EXPECT_EQ(dataset->loads(), 20U);
}

TEST(Dataset, LoadAboveTheLimitIsRefusedWithFigures) {
  const auto dataset = make_dataset(3);
  auto a = dataset->volume("a", 0);
  auto b = dataset->volume("b", 0);
  ASSERT_TRUE(dataset->volume("c", 0));  // resident, not held
  const auto vector = dataset->volume("v", 0);
  ASSERT_FALSE(vector);
  EXPECT_EQ(vector.error().kind, ErrorKind::out_of_memory);
  EXPECT_NE(vector.error().message.find("limit"), std::string::npos);
  EXPECT_NE(vector.error().message.find("MiB"), std::string::npos);
  EXPECT_EQ(dataset->loads(), 3U);                         // refused before it was read
  EXPECT_EQ(dataset->resident_bytes(), 3 * kVolumeBytes);  // c was not given up in vain
  *a = nullptr;
  *b = nullptr;
  EXPECT_TRUE(dataset->volume("v", 0));
  EXPECT_EQ(dataset->resident_bytes(), 3 * kVolumeBytes);
}

TEST(Dataset, VolumeLargerThanTheLimitIsRefused) {
  const auto dataset = make_dataset(2);
  EXPECT_EQ(dataset->volume("v", 0).error().kind, ErrorKind::out_of_memory);
  EXPECT_TRUE(dataset->volume("a", 0));
}

TEST(Dataset, FailureReachesAllWaitersAndIsRetriedLater) {
  auto source = std::make_unique<FakeSource>();
  source->failures = 1;
  Dataset dataset(std::move(source), "fake", kVolumeBytes);
  const auto first = dataset.volume("a", 0);
  ASSERT_FALSE(first);
  EXPECT_EQ(first.error().message, "read failed");
  EXPECT_EQ(dataset.resident_bytes(), 0U);
  EXPECT_TRUE(dataset.volume("a", 0));  // its reservation was released
  EXPECT_EQ(dataset.loads(), 2U);
}

TEST(Dataset, ExceptionsOfASourceBecomeErrors) {
  auto buggy = std::make_unique<FakeSource>();
  buggy->throws_logic = true;
  EXPECT_EQ(Dataset(std::move(buggy), "x", kVolumeBytes).volume("a", 0).error().kind,
            ErrorKind::internal);
  auto starved = std::make_unique<FakeSource>();
  starved->throws_memory = true;
  EXPECT_EQ(Dataset(std::move(starved), "x", kVolumeBytes).volume("a", 0).error().kind,
            ErrorKind::out_of_memory);
}

TEST(Dataset, ManyThreadsWithASmallBudget) {
  const auto dataset = make_dataset(6);
  std::atomic<int> wrong{0};
  std::atomic<int> refused{0};
  std::vector<std::thread> threads;
  threads.reserve(8);
  for (unsigned t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      unsigned state = t + 1;
      for (int i = 0; i < 2000; ++i) {
        state = state * 1664525U + 1013904223U;
        const std::size_t step = (state >> 16) % 20;
        const auto volume = dataset->volume("b", step);
        if (!volume) {
          ++refused;  // only if others hold everything
        } else if ((*volume)->values[500] != static_cast<float>(1000 + step)) {
          ++wrong;
        }
      }
    });
  }
  for (std::thread& thread : threads) {
    thread.join();
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(refused, 0);  // four threads hold at most four of six
  EXPECT_LE(dataset->resident_bytes(), 6 * kVolumeBytes);
}

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
  options.open = [&](const Location& location) -> Result<std::unique_ptr<Source>> {
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
  options.check = [&](const Dataset& /*dataset*/) -> Result<void> {
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
  Store store({1 << 20, Storage::float32, [&](const Location&) -> Result<std::unique_ptr<Source>> {
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
  Store store({4 << 20, Storage::float32, [](const Location&) -> Result<std::unique_ptr<Source>> {
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

// A model writes its newest file.
TEST(Store, ChangeOfTheLastFileOfALongSeriesIsDetected) {
  const Folder folder;
  for (int i = 100; i < 200; ++i) std::ofstream(folder / numbered(i)) << "a step";
  StoreOptions options;
  options.bytes_max = 1 << 20;
  options.open = [](const Location&) -> Result<std::unique_ptr<Source>> {
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
  options.open = [&](const Location&) -> Result<std::unique_ptr<Source>> {
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
