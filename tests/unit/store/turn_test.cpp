// Loads in turn wait until memory referenced by others is released, and only if that helps.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <thread>
#include <utility>

#include "server/data/resident/store.hpp"

namespace windsplat::data {
namespace {

using TurnClock = std::chrono::steady_clock;

constexpr std::size_t side = 10;
constexpr std::uint64_t plain_bytes = side * side * side * sizeof(float);

// Fields a and b of 10 x 10 x 10 samples, 20 steps; the value of every sample is its step.
class PlainSource : public Source {
 public:
  PlainSource() {
    for (Axis& axis : info_.grid.axes) {
      for (std::size_t i = 0; i < side; ++i) axis.coordinates.push_back(static_cast<double>(i));
    }
    for (const char* name : {"a", "b"}) {
      FieldInfo field;
      field.name = name;
      field.components = {name};
      info_.fields.push_back(field);
    }
    info_.steps.resize(20);
  }
  [[nodiscard]] const DatasetInfo& info() const override { return info_; }
  Result<Volume> read(std::size_t /*field*/, std::size_t step) override {
    Volume volume;
    volume.dims = {side, side, side};
    volume.values = std::vector<float>(volume.samples(), static_cast<float>(step));
    finish_volume(volume);
    return volume;
  }

 private:
  DatasetInfo info_;
};

class Turn : public testing::Test {
 protected:
  static std::shared_ptr<Dataset> series(const std::shared_ptr<Budget>& budget) {
    return std::make_shared<Dataset>(std::make_unique<PlainSource>(), "series", budget);
  }
  // Memory for one and a half volumes.
  std::shared_ptr<Budget> budget_ = std::make_shared<Budget>(plain_bytes * 3 / 2);
  std::shared_ptr<Dataset> dataset_ = series(budget_);
};

TEST_F(Turn, HeldStepIsEvictedForTheNextOnceReleased) {
  auto shown = dataset_->volume("a", 0);
  ASSERT_TRUE(shown);
  EXPECT_FALSE(dataset_->volume("a", 1)) << "without in_turn the error is immediate";
  auto next = std::async(std::launch::async, [&] {
    Dataset patient = dataset_->in_turn();
    return patient.volume("a", 1);
  });
  EXPECT_EQ(next.wait_for(std::chrono::milliseconds(100)), std::future_status::timeout);
  EXPECT_EQ((*shown)->values[0], 0.0F) << "held volumes stay valid";
  EXPECT_LE(budget_->counts().bytes, budget_->bytes_max());
  shown->reset();
  const auto loaded = next.get();
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ((*loaded)->values[0], 1.0F);
  EXPECT_LE(budget_->counts().bytes, budget_->bytes_max());
}

TEST_F(Turn, AwaitedVolumeStaysValidForItsHolder) {
  auto shown = dataset_->volume("a", 0);
  ASSERT_TRUE(shown);
  auto next = std::async(std::launch::async, [&] {
    Dataset patient = dataset_->in_turn();
    return patient.volume("a", 1);
  });
  Dataset resident = dataset_->resident_only();
  while (resident.volume("a", 0)) std::this_thread::yield();
  EXPECT_EQ((*shown)->values[0], 0.0F) << "a frame that references it can be rendered";
  EXPECT_FALSE(dataset_->volume("a", 2)) << "others get no memory before the turn";
  EXPECT_EQ(next.wait_for(std::chrono::milliseconds(50)), std::future_status::timeout);
  shown->reset();
  EXPECT_TRUE(next.get());
}

TEST_F(Turn, VolumesHeldByTheCallerAreNotWaitedFor) {
  const auto begin = TurnClock::now();
  Dataset patient = dataset_->in_turn();
  const auto first = patient.volume("a", 0);
  ASSERT_TRUE(first);
  const auto second = patient.volume("b", 0);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().kind, ErrorKind::out_of_memory);
  EXPECT_LT(TurnClock::now() - begin, Budget::patience / 2);
}

TEST_F(Turn, VolumeLargerThanTheLimitIsRefusedAtOnce) {
  const auto small = std::make_shared<Budget>(plain_bytes - 1);
  const auto dataset = series(small);
  const auto begin = TurnClock::now();
  Dataset patient = dataset->in_turn();
  const auto loaded = patient.volume("a", 0);
  ASSERT_FALSE(loaded);
  EXPECT_EQ(
      loaded.error().message,
      "the field needs 0.0 MiB; the memory limit leaves 0.0 MiB for data, of which 0.0 MiB are in "
      "use");
  EXPECT_LT(TurnClock::now() - begin, Budget::patience / 2);
}

TEST_F(Turn, CancelledWaitEndsAndKeepsBlockingVolumesResident) {
  const auto shown = dataset_->volume("a", 0);
  ASSERT_TRUE(shown);
  const CancelToken cancel;
  auto next = std::async(std::launch::async, [&] {
    Dataset patient = dataset_->in_turn(cancel);
    return patient.volume("a", 1);
  });
  Dataset resident = dataset_->resident_only();
  while (resident.volume("a", 0)) std::this_thread::yield();
  const auto begin = TurnClock::now();
  cancel.cancel();
  const auto loaded = next.get();
  ASSERT_FALSE(loaded);
  EXPECT_EQ(loaded.error().kind, ErrorKind::cancelled);
  EXPECT_LT(TurnClock::now() - begin, Budget::patience / 2);
  const auto again = resident.volume("a", 0);
  ASSERT_TRUE(again) << "it need not be read again";
  EXPECT_EQ(again->get(), shown->get());
  EXPECT_EQ(budget_->counts().bytes, plain_bytes);
  EXPECT_EQ(budget_->counts().evictions, 0U);
}

TEST_F(Turn, CancelledCallerDoesNotWaitForAnOccupiedTurn) {
  Store store(plain_bytes);
  const auto taken = store.take_turn(*dataset_);
  ASSERT_TRUE(taken);
  const CancelToken cancel;
  auto next =
      std::async(std::launch::async, [&] { return store.take_turn(*dataset_, cancel) != nullptr; });
  EXPECT_EQ(next.wait_for(std::chrono::milliseconds(50)), std::future_status::timeout);
  cancel.cancel();
  EXPECT_FALSE(next.get());
}

TEST_F(Turn, EndedTurnPassesToTheNext) {
  Store store(plain_bytes);
  auto taken = store.take_turn(*dataset_);
  auto next = std::async(std::launch::async, [&] { return store.take_turn(*dataset_) != nullptr; });
  EXPECT_EQ(next.wait_for(std::chrono::milliseconds(50)), std::future_status::timeout);
  taken.reset();
  EXPECT_TRUE(next.get());
}

TEST_F(Turn, TemporaryWorkIsWaitedForButNotPermanentData) {
  const auto load = [&] {
    Dataset patient = dataset_->in_turn();
    return patient.volume("a", 0);
  };
  {
    Reservation work(budget_);
    ASSERT_TRUE(work.resize(plain_bytes));
    auto next = std::async(std::launch::async, load);
    EXPECT_EQ(next.wait_for(std::chrono::milliseconds(100)), std::future_status::timeout);
    ASSERT_TRUE(work.resize(0));
    const auto loaded = next.get();
    EXPECT_TRUE(loaded) << loaded.error().message;
  }
  Reservation lasting(budget_, Reservation::Term::lasting);
  ASSERT_TRUE(lasting.resize(plain_bytes));
  const auto begin = TurnClock::now();
  EXPECT_FALSE(load());
  EXPECT_LT(TurnClock::now() - begin, Budget::reservation_patience / 2);
}

TEST(Budget, LoadThatFitsBesideALoadInTurnDoesNotWait) {
  Budget budget(10);
  const std::uint64_t owner = budget.next_owner();
  const auto get = [&](std::size_t step, std::uint64_t bytes, Urgency urgency) {
    return budget.get({owner, 0, step, ""}, bytes, urgency,
                      []() -> Result<Resident> { return Resident(std::make_shared<int>(1)); });
  };
  auto held = get(0, 6, Urgency::demand);
  ASSERT_TRUE(held);
  auto next = std::async(std::launch::async, [&] { return get(1, 5, Urgency::in_turn); });
  while (budget.has({owner, 0, 0, ""})) std::this_thread::yield();
  EXPECT_TRUE(get(2, 3, Urgency::demand)) << "5 and 3 are less than 10";
  EXPECT_FALSE(get(3, 3, Urgency::demand)) << "5, 3 and 3 are more";
  EXPECT_EQ(next.wait_for(std::chrono::milliseconds(20)), std::future_status::timeout);
  held = make_error(ErrorKind::internal, "released");
  EXPECT_TRUE(next.get());
}

TEST_F(Turn, ShutdownEndsAllWaits) {
  const auto shown = dataset_->volume("a", 0);
  ASSERT_TRUE(shown);
  const auto begin = TurnClock::now();
  auto next = std::async(std::launch::async, [&] {
    Dataset patient = dataset_->in_turn();
    return patient.volume("a", 1);
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  budget_->end();
  EXPECT_FALSE(next.get());
  EXPECT_LT(TurnClock::now() - begin, Budget::patience / 2);
}

// A source whose reads need as much memory as the volume.
class HungrySource : public PlainSource {
 public:
  explicit HungrySource(std::shared_ptr<Budget> budget) : work_(std::move(budget)) {}
  Result<Volume> read(std::size_t field, std::size_t step) override {
    if (auto room = work_.resize(plain_bytes); !room) return room.error();
    auto volume = PlainSource::read(field, step);
    static_cast<void>(work_.resize(0));
    return volume;
  }

 private:
  Reservation work_;
};

TEST(Reservation, WaitsAsPartOfALoadInTurn) {
  const auto budget = std::make_shared<Budget>(plain_bytes * 2);
  Dataset dataset(std::make_unique<HungrySource>(budget), "hungry", budget);
  auto shown = dataset.volume("a", 0);
  ASSERT_TRUE(shown);
  EXPECT_FALSE(dataset.volume("a", 1)) << "there is memory for the volume only";
  auto next = std::async(std::launch::async, [&] {
    Dataset patient = dataset.in_turn();
    return patient.volume("a", 1);
  });
  EXPECT_EQ(next.wait_for(std::chrono::milliseconds(100)), std::future_status::timeout);
  shown->reset();
  const auto loaded = next.get();
  EXPECT_TRUE(loaded) << loaded.error().message;
}

TEST(Reservation, IsCountedEvictsAndIsReleased) {
  const auto budget = std::make_shared<Budget>(2 * plain_bytes);
  Dataset dataset(std::make_unique<PlainSource>(), "series", budget);
  ASSERT_TRUE(dataset.volume("a", 0));
  ASSERT_TRUE(dataset.volume("a", 1));
  {
    Reservation work(budget, Reservation::Term::lasting);
    EXPECT_TRUE(work.resize(plain_bytes)) << "an unreferenced volume is evicted for it";
    EXPECT_EQ(budget->counts().bytes, 2 * plain_bytes);
    EXPECT_EQ(dataset.resident_bytes(), plain_bytes);
    const auto too_much = work.resize(2 * plain_bytes + 1);
    ASSERT_FALSE(too_much);
    EXPECT_EQ(too_much.error().kind, ErrorKind::out_of_memory);
    EXPECT_EQ(work.bytes(), plain_bytes) << "it stays unchanged";
    const auto begin = TurnClock::now();
    Dataset patient = dataset.in_turn();
    const auto first = patient.volume("a", 2);
    EXPECT_TRUE(first);
    EXPECT_FALSE(patient.volume("a", 3)) << "a permanent reservation is not waited for";
    EXPECT_LT(TurnClock::now() - begin, Budget::patience / 2);
  }
  EXPECT_EQ(budget->counts().bytes, plain_bytes);
  EXPECT_TRUE(Reservation().resize(plain_bytes)) << "without a budget everything is allowed";
}

}  // namespace
}  // namespace windsplat::data
