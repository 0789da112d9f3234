// Volumes of a dataset: read once per field and step, within a budget; referenced volumes stay
// valid.
#include "server/data/resident/dataset.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "tests/unit/store/fake_source.hpp"

namespace windsplat::data {
namespace {

constexpr std::uint64_t kVolumeBytes = 4000;  // 10 x 10 x 10 float32

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

TEST(Dataset, AuxiliaryDataAreSharedAndEvictedBeforeWhatIsReadFromFiles) {
  const auto dataset = make_dataset(4);
  int made = 0;
  const auto get = [&](Dataset dataset, const std::string& variant) {
    return dataset.auxiliary(variant, kVolumeBytes,
                             [&] { return Resident(std::make_shared<const int>(++made)); });
  };
  EXPECT_EQ(get(dataset->resident_only(), "a").error().kind, ErrorKind::not_resident);
  const auto first = get(*dataset, "a").value();
  EXPECT_EQ(get(*dataset, "a").value(), first);
  EXPECT_EQ(get(dataset->resident_only(), "a").value(), first);
  ASSERT_TRUE(get(*dataset, "b"));
  EXPECT_EQ(made, 2);
  EXPECT_EQ(dataset->resident_bytes(), 2 * kVolumeBytes);
  ASSERT_TRUE(dataset->volume("a", 0));
  ASSERT_TRUE(dataset->volume("a", 1));
  ASSERT_TRUE(get(dataset->resident_only(), "b")) << "used last";
  ASSERT_TRUE(dataset->volume("a", 2));
  EXPECT_FALSE(get(dataset->resident_only(), "b")) << "`a` is referenced";
  EXPECT_TRUE(dataset->resident_only().volume("a", 0));
  const auto held = dataset->volume("a", 2);
  const auto refused = dataset->auxiliary("c", 3 * kVolumeBytes, [] { return Resident(); });
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::out_of_memory);
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
  ASSERT_TRUE(dataset->volume("c", 0));  // resident, without references
  const auto vector = dataset->volume("v", 0);
  ASSERT_FALSE(vector);
  EXPECT_EQ(vector.error().kind, ErrorKind::out_of_memory);
  EXPECT_NE(vector.error().message.find("limit"), std::string::npos);
  EXPECT_NE(vector.error().message.find("MiB"), std::string::npos);
  EXPECT_EQ(dataset->loads(), 3U);                         // refused before it was read
  EXPECT_EQ(dataset->resident_bytes(), 3 * kVolumeBytes);  // c was not evicted in vain
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
          ++refused;  // only possible if others reference everything
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
  EXPECT_EQ(refused, 0);  // four threads reference at most four of six
  EXPECT_LE(dataset->resident_bytes(), 6 * kVolumeBytes);
}

}  // namespace
}  // namespace windsplat::data
