// Loading of volumes: handles that never load, prefetch, packed storage.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <future>
#include <limits>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include "server/data/model/packed.hpp"
#include "server/data/resident/store.hpp"
#include "tests/unit/store/recorded_series.hpp"

namespace windsplat::data {
namespace {

using recorded::edge;
using recorded::Fixture;
using recorded::last_step;
using recorded::Series;
using recorded::volume_bytes;

TEST(Resident, ResidentVolumeIsNeverLoadedAgain) {
  Fixture f(10);
  Dataset resident = f.dataset->resident_only();
  const auto absent = resident.volume("f", 3);
  ASSERT_FALSE(absent);
  EXPECT_EQ(absent.error().kind, ErrorKind::not_resident);
  EXPECT_TRUE(f.log->read().empty());
  const auto loaded = f.dataset->volume("f", 3);
  ASSERT_TRUE(loaded);
  EXPECT_EQ(resident.volume("f", 3).value(), *loaded);
  Coarsening half;
  half.halvings = {1, 0, 0};
  half.widths[0] = std::vector<double>(edge, 1.0);
  EXPECT_EQ(resident.level("f", 3, half).error().kind, ErrorKind::not_resident);
  const auto level = f.dataset->level("f", 3, half);
  EXPECT_EQ(resident.level("f", 3, half).value(), level.value());
}

TEST(Resident, PrefetchRequestsAreLoadedSoonestFirst) {
  Fixture f(10);
  f.request_prefetch({7, 8, 9, 10});
  f.wait_until_resident(10);
  EXPECT_EQ(f.log->read(), (std::vector<std::size_t>{7, 8, 9, 10}));
  for (const std::size_t step : {7, 8, 9, 10}) EXPECT_TRUE(f.is_resident(step)) << step;
  EXPECT_EQ(f.dataset->counts().prefetched, 4U);
  f.request_prefetch({8, 9, 10, 11});
  f.wait_for_reads(5);
  f.settle();
  EXPECT_EQ(f.log->read().size(), 5U) << "a resident volume is not read again";
}

TEST(Resident, NewPrefetchRequestReplacesPendingOnes) {
  Fixture f(10);
  f.log->hold = true;
  f.request_prefetch({1, 2, 3, 4});
  f.settle();  // 1 is being read
  f.request_prefetch({50});
  f.log->hold = false;
  f.wait_for_reads(2);
  f.settle();
  EXPECT_EQ(f.log->read(), (std::vector<std::size_t>{1, 50}));
}

TEST(Resident, PrefetchStaysWithinTheLimitAndKeepsRequestedVolumes) {
  Fixture f(4);
  const auto held = f.dataset->volume("f", 0);
  f.request_prefetch({1, 2, 3, 4, 5, 6});
  f.wait_for_reads(4);
  f.settle();
  EXPECT_EQ(f.log->read(), (std::vector<std::size_t>{0, 1, 2, 3})) << "no room for a fourth";
  EXPECT_EQ(f.store.counts().refusals, 1U) << "the fifth and sixth were not tried";
  EXPECT_LE(f.store.counts().bytes, 4 * volume_bytes);
  for (const std::size_t step : {1, 2, 3}) EXPECT_TRUE(f.is_resident(step)) << step;
  // A demand evicts volumes without a prefetch request first, then the least recently used.
  f.request_prefetch({2, 3});
  ASSERT_TRUE(f.dataset->volume("f", 20));
  EXPECT_FALSE(f.is_resident(1));
  EXPECT_TRUE(f.is_resident(2));
  EXPECT_TRUE(f.is_resident(3));
}

// Plain least-recently-used order would evict the oldest.
TEST(Resident, UnrequestedVolumesAreEvictedBeforeOlderRequests) {
  Fixture f(3);
  for (const std::size_t step : {1, 2, 3}) ASSERT_TRUE(f.dataset->volume("f", step));
  f.request_prefetch({1, 2});
  ASSERT_TRUE(f.dataset->volume("f", 20));
  EXPECT_TRUE(f.is_resident(1));
  EXPECT_TRUE(f.is_resident(2));
  EXPECT_FALSE(f.is_resident(3));
}

TEST(Resident, RequestedAverageStaysThoughItCouldBeRecomputed) {
  Fixture f(4);
  Coarsening half;
  half.halvings = {1, 1, 1};
  half.widths.fill(std::vector<double>(edge, 1));
  ASSERT_TRUE(f.dataset->level("f", 0, half));
  for (const std::size_t step : {1, 2}) ASSERT_TRUE(f.dataset->volume("f", step));
  f.store.request_prefetch(1, {{*f.dataset, "f", 0, f.dataset->reduction("f", half), {}}});
  ASSERT_TRUE(f.dataset->volume("f", 3));
  EXPECT_TRUE(f.dataset->resident_only().level("f", 0, half));
  EXPECT_FALSE(f.is_resident(0)) << "the oldest without a request";
}

TEST(Resident, WhatIsShownWithARequestedVolumeStays) {
  Fixture f(3);
  const auto get = [&](Dataset dataset) {
    return dataset.auxiliary("a", volume_bytes,
                             [] { return Resident(std::make_shared<const int>(1)); });
  };
  ASSERT_TRUE(get(*f.dataset));
  for (const std::size_t step : {0, 1}) ASSERT_TRUE(f.dataset->volume("f", step));
  f.store.request_prefetch(1, {{*f.dataset, "f", 1, {}, f.dataset->auxiliary_key("a")}});
  ASSERT_TRUE(f.dataset->volume("f", 2));
  EXPECT_TRUE(get(f.dataset->resident_only()));
  EXPECT_FALSE(f.is_resident(0));
}

TEST(Resident, OwnersOfPrefetchRequestsTakeTurns) {
  Fixture f(10);
  f.log->hold = true;
  f.request_prefetch({1, 2, 3}, 1);
  f.wait_until_reading();
  f.request_prefetch({11, 12, 13}, 2);
  f.log->hold = false;
  f.wait_for_reads(6);
  EXPECT_EQ(f.log->read(), (std::vector<std::size_t>{1, 11, 2, 12, 3, 13}));
}

// A moving view repeats its requests at each frame.
TEST(Resident, WhatCannotBeReadIsNotTriedAgainAtEachRequest) {
  Fixture f(10);
  f.log->unreadable = 2;
  for (int frame = 0; frame < 20; ++frame) {
    f.request_prefetch({1, 2, 3});
    f.wait_until_resident(3);
    f.settle();
  }
  EXPECT_EQ(f.log->read(), (std::vector<std::size_t>{1, 2, 3}));
  EXPECT_EQ(f.dataset->volume("f", 2).error().kind, ErrorKind::bad_data) << "is tried on demand";
  f.request_prefetch({});
  f.request_prefetch({2});
  f.wait_for_reads(5);
  EXPECT_EQ(f.log->read().size(), 5U) << "is tried again for a new view";
}

TEST(Resident, RemovedDatasetIsNoLongerLoaded) {
  Fixture f(10);
  f.log->hold = true;
  f.request_prefetch({1, 2, 3});
  f.wait_until_reading();
  ASSERT_TRUE(f.store.remove("series"));
  f.log->hold = false;
  f.wait_for_reads(1);
  f.settle();
  EXPECT_EQ(f.log->read(), std::vector<std::size_t>{1});
}

// A series larger than memory, played in a loop with prefetch: every step is resident when shown,
// although plain least-recently-used order would evict each before its next use.
TEST(Resident, SeriesLargerThanMemoryPlaysEveryStep) {
  Fixture f(8);
  constexpr std::size_t steps = 20;
  std::size_t waited_for = 0;
  for (std::size_t n = 0; n < 3 * steps; ++n) {
    const std::size_t step = n % steps;
    std::vector<std::size_t> next;
    for (std::size_t k = 0; k < 5; ++k) next.push_back((step + k) % steps);
    f.request_prefetch(next);
    for (int i = 0; i < 5000 && !f.is_resident((step + 1) % steps); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    waited_for += f.is_resident(step) ? 0 : 1;
    EXPECT_EQ((*f.dataset->volume("f", step))->values[0], static_cast<float>(step));
    EXPECT_LE(f.store.counts().bytes, 8 * volume_bytes);
  }
  EXPECT_LE(waited_for, 1U) << "except the first";
}

TEST(Resident, DemandedLoadPrecedesPrefetch) {
  Fixture f(50);
  f.log->hold = true;
  f.request_prefetch({1, 2, 3, 4, 5, 6, 7, 8});
  f.settle();
  std::thread waiting([&] { ASSERT_TRUE(f.dataset->volume("f", 60)); });
  f.settle();
  f.log->hold = false;
  waiting.join();
  const auto read = f.log->read();
  ASSERT_GE(read.size(), 2U);
  EXPECT_EQ(read[1], 60U) << "right after the running one";
}

TEST(Resident, EvictionFreesUnreferencedVolumes) {
  Fixture f(10);
  const auto held = f.dataset->volume("f", 0);
  ASSERT_TRUE(f.dataset->volume("f", 1));
  f.dataset->evict();
  EXPECT_EQ(f.log->cancelled, 1) << "the running read is cancelled";
  EXPECT_EQ(f.dataset->resident_bytes(), volume_bytes);
  EXPECT_TRUE(f.is_resident(0));
  EXPECT_FALSE(f.is_resident(1));
  EXPECT_EQ(f.dataset->seen("f", 1)->range[0], 1.0F) << "its range is cached";
}

// The caller still waits, so the error states why the data were removed.
TEST(Resident, LoadCancelledByAnotherCallerReportsTheReason) {
  const std::vector<std::pair<std::function<void(Fixture&)>, ErrorKind>> ends{
      {[](Fixture& f) { f.dataset->evict(); }, ErrorKind::not_resident},
      {[](Fixture& f) { EXPECT_TRUE(f.store.remove("series")); }, ErrorKind::not_found},
      {[](Fixture& f) { f.dataset->end(); }, ErrorKind::draining}};
  for (const auto& [end, kind] : ends) {
    Fixture f(10);
    f.log->hold = true;
    f.log->heeds_cancel = true;
    auto read = std::async(std::launch::async, [&] { return f.dataset->volume("f", 7); });
    f.wait_until_reading();
    end(f);
    f.log->hold = false;
    const auto volume = read.get();
    ASSERT_FALSE(volume);
    EXPECT_EQ(volume.error().kind, kind) << volume.error().message;
  }
}

TEST(Resident, HeldVolumesOfARemovedDatasetCountUntilReleased) {
  Fixture f(10);
  auto held = f.dataset->volume("f", 3);
  ASSERT_TRUE(f.dataset->volume("f", 4));
  EXPECT_EQ(f.store.counts().bytes, 2 * volume_bytes);
  ASSERT_TRUE(f.store.remove("series"));
  f.dataset.reset();
  EXPECT_EQ(f.store.counts().bytes, volume_bytes);
  EXPECT_EQ((*held)->values[0], 3.0F);
  held->reset();
  EXPECT_EQ(f.store.counts().bytes, 0U);
}

TEST(Resident, LoadingProgressIsReportedUntilDone) {
  Fixture f(10);
  f.log->hold = true;
  std::thread reader([&] { ASSERT_TRUE(f.dataset->volume("f", 7)); });
  f.wait_until_reading();
  for (int i = 0; i < 10000 && f.dataset->loading()->done == 0; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  const auto loading = f.dataset->loading();
  f.log->hold = false;
  reader.join();
  ASSERT_TRUE(loading);
  EXPECT_EQ(loading->field, "f");
  EXPECT_EQ(loading->step, 7U);
  EXPECT_EQ(loading->done, 0.25);
  EXPECT_FALSE(f.dataset->loading());
}

TEST(Resident, SourceIsReleasedAfterIdleTime) {
  Fixture f(10);
  ASSERT_TRUE(f.dataset->volume("f", 0));
  f.store.release_idle(3600);
  EXPECT_EQ(f.log->released, 0);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  f.store.release_idle(0.01);
  EXPECT_EQ(f.log->released, 1);
}

TEST(Resident, ValuesAreCachedByKeyAndFailuresAreNot) {
  Fixture f(1);
  int made = 0;
  const auto ask = [&](const std::string& key, bool fails) {
    return f.dataset->remembered(key, [&]() -> Result<std::vector<double>> {
      ++made;
      if (fails) return make_error(ErrorKind::bad_data, "not now");
      return std::vector<double>{static_cast<double>(made)};
    });
  };
  EXPECT_FALSE(ask("a", true));
  EXPECT_EQ(ask("a", false).value(), std::vector<double>{2});
  EXPECT_EQ(ask("b", false).value(), std::vector<double>{3});
  EXPECT_EQ(ask("a", true).value(), std::vector<double>{2});
  EXPECT_EQ(made, 3);
}

// A short phase of coarser frames must not evict the series.
TEST(Resident, AveragesAreEvictedBeforeTheirSourceVolumes) {
  Fixture f(6);
  Coarsening half;
  half.halvings = {1, 1, 1};
  half.widths.fill(std::vector<double>(edge, 1));
  for (std::size_t step = 0; step < 5; ++step) ASSERT_TRUE(f.dataset->volume("f", step));
  for (std::size_t step = 0; step < 5; ++step) ASSERT_TRUE(f.dataset->level("f", step, half));
  ASSERT_TRUE(f.dataset->volume("f", 5));
  for (std::size_t step = 0; step < 6; ++step) EXPECT_TRUE(f.is_resident(step)) << step;
  EXPECT_EQ(f.dataset->counts().levels, 5U);
  ASSERT_TRUE(f.dataset->level("f", 5, half)) << "instead of a volume";
  EXPECT_FALSE(f.is_resident(0));
}

TEST(Resident, PackedStorageHoldsMoreStepsWithinItsError) {
  Fixture plain(6);
  Fixture packed(6, Storage::packed16);
  for (std::size_t step = 0; step < 10; ++step) {
    ASSERT_TRUE(plain.dataset->volume("f", step));
    ASSERT_TRUE(packed.dataset->volume("f", step));
  }
  for (std::size_t step = 0; step < 10; ++step) {
    const auto volume = packed.dataset->volume("f", step);
    ASSERT_TRUE(volume);
    const float error = packed.dataset->storage_error("f");
    EXPECT_GT(error, 0.0F);
    EXPECT_LE(error, 0.5F * 0.999F / 65534.0F * 1.01F);
    for (std::size_t n = 0; n < 1000; ++n) {
      const float exact = static_cast<float>(step) + static_cast<float>(n) / 1000.0F;
      ASSERT_NEAR((*volume)->values[n], exact, error + 1e-6F * (1 + exact)) << step << ' ' << n;
    }
    ASSERT_TRUE(plain.dataset->volume("f", step));
  }
  EXPECT_LE(packed.store.counts().bytes, 6 * volume_bytes);
  EXPECT_EQ(packed.dataset->counts().loads, 10U) << "ten packed steps fit where six do not";
  EXPECT_GT(plain.dataset->counts().loads, 10U);
  EXPECT_GE(packed.dataset->counts().unpacked, 5U);
}

TEST(Resident, ErrorOfPackedStorageIsTheMaximumOfAllSteps) {
  Fixture f(10, Storage::packed16);
  ASSERT_TRUE(f.dataset->volume("f", last_step));
  ASSERT_TRUE(f.dataset->volume("f", 1));
  // Half of one of 65534 steps between minimum and maximum.
  EXPECT_NEAR(f.dataset->storage_error("f"), 0.5 * (999.0 / 125) / 65534, 1e-9);
}

// Limit: three volumes. Two volumes with prefetch requests and their packed forms fill it.
TEST(Resident, PackedFormDoesNotReplaceAPrefetchRequest) {
  Fixture f(3, Storage::packed16);
  f.request_prefetch({1, 2});
  for (int i = 0; i < 10000 && !f.is_resident(2); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  ASSERT_EQ(f.store.counts().bytes, 3 * volume_bytes);
  ASSERT_TRUE(f.dataset->volume("f", 20));
  EXPECT_TRUE(f.is_resident(1));
  EXPECT_TRUE(f.is_resident(2));
}

TEST(Packed, MaskedConstantAndExtremeValues) {
  Volume volume;
  volume.dims = {4, 1, 1};
  volume.components = 2;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  volume.values = std::vector<float>{-3, nan, 5, 5, 7, nan, 7, 7};
  finish_volume(volume);
  const auto packed = pack(volume);
  ASSERT_TRUE(packed);
  EXPECT_EQ(packed->error(1), 0.0F);
  const Volume back = unpack(*packed);
  EXPECT_EQ(back.values[0], -3.0F);
  EXPECT_TRUE(std::isnan(back.values[1]));
  EXPECT_NEAR(back.values[2], 5.0F, packed->error(0) + 1e-6F);
  EXPECT_EQ(back.values[4], 7.0F);
  EXPECT_TRUE(std::isnan(back.values[5]));
  EXPECT_EQ(back.masked, 1);
  EXPECT_EQ(back.range, volume.range);

  const float most = std::numeric_limits<float>::max();
  volume.components = 1;
  volume.values = std::vector<float>{-most, most, 0, 1};
  finish_volume(volume);
  EXPECT_FALSE(pack(volume)) << "quantisation steps would exceed the range of float";
  volume.values = std::vector<float>(4, nan);
  finish_volume(volume);
  const auto empty = pack(volume);
  ASSERT_TRUE(empty);
  EXPECT_EQ(unpack(*empty).masked, 4);
}

TEST(Packed, RandomValuesDeviateByAtMostHalfAStep) {
  std::mt19937 random(5);
  for (const float scale : {1e-30F, 1.0F, 1e30F}) {
    std::normal_distribution<float> normal(0.3F, 1.0F);
    Volume volume;
    volume.dims = {16, 16, 16};
    volume.values = Samples(volume.samples());
    for (std::size_t n = 0; n < volume.samples(); ++n) volume.values[n] = scale * normal(random);
    finish_volume(volume);
    const auto packed = pack(volume);
    ASSERT_TRUE(packed);
    const Volume back = unpack(*packed);
    const auto error = static_cast<double>(packed->error(0));
    for (std::size_t n = 0; n < volume.samples(); ++n) {
      const auto exact = static_cast<double>(volume.values[n]);
      ASSERT_NEAR(static_cast<double>(back.values[n]), exact,
                  1.001 * error + 5e-7 * std::abs(exact));
    }
  }
}

}  // namespace
}  // namespace windsplat::data
