// How long finished animations are kept, and how many.
#include "server/tasks/animation/animations.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <future>
#include <memory>
#include <string>
#include <vector>

#include "server/movie/output.hpp"

namespace windsplat::tasks {
namespace {

using Clock = Animations::Clock;

Animations::Kept animation_of(const std::string& id, std::int64_t bytes) {
  Animations::Kept kept;
  kept.description.id = id;
  kept.description.bytes = bytes;
  return kept;
}

TEST(KeptAnimations, AreRemovedWhenTheirTimeIsOver) {
  Animations kept;
  const Clock::time_point start;
  kept.keep(animation_of("a", 1), start);
  const Clock::time_point end = start + Animations::lasts;
  EXPECT_TRUE(kept.find("a", end - std::chrono::seconds(1)));
  EXPECT_FALSE(kept.find("a", end)) << "also before expire() is called";
  kept.expire(end);
  EXPECT_FALSE(kept.find("a", start));
}

TEST(KeptAnimations, TheOldestMakeRoomForNewOnes) {
  Animations kept;
  const std::int64_t third = Animations::kept_bytes_max / 3;
  for (const char* id : {"a", "b", "c"}) kept.keep(animation_of(id, third));
  EXPECT_TRUE(kept.find("a"));
  kept.keep(animation_of("b", third));  // made again: replaces the first one
  EXPECT_TRUE(kept.find("a"));
  kept.keep(animation_of("d", third));
  EXPECT_FALSE(kept.find("a"));
  for (const char* id : {"b", "c", "d"}) EXPECT_TRUE(kept.find(id)) << id;
}

TEST(KeptAnimations, AreLimitedInNumberHoweverSmall) {
  Animations kept;
  const auto count = static_cast<int>(Animations::kept_max);
  for (int n = 0; n < count; ++n) kept.keep(animation_of(std::to_string(n), 1));
  EXPECT_TRUE(kept.find("0"));
  kept.keep(animation_of("1", 1));  // replaces the second one
  EXPECT_TRUE(kept.find("0"));
  kept.keep(animation_of("last", 1));
  EXPECT_FALSE(kept.find("0"));
  EXPECT_TRUE(kept.find("1"));
  EXPECT_TRUE(kept.find("2"));
}

// Unmapping large files takes time. Here the release of one waits for another thread that needs the
// lock.
TEST(KeptAnimations, AreReleasedOutsideOfTheLock) {
  Animations kept;
  int released = 0;
  std::vector<std::future<bool>> others;  // until the test ends
  const Clock::time_point start;
  const auto keep = [&](const std::string& id, std::int64_t bytes) {
    Animations::Kept one = animation_of(id, bytes);
    const data::Descriptor file = movie::unnamed_file();
    ASSERT_EQ(::write(file.number(), "movie", 5), 5);
    auto mapped = MappedFile::of(file);
    ASSERT_TRUE(mapped);
    one.file =
        std::shared_ptr<const MappedFile>(mapped->get(), [&, held = *mapped](const MappedFile*) {
          others.push_back(std::async(std::launch::async, [&] { return kept.remove("none"); }));
          const auto found = others.back().wait_for(std::chrono::seconds(5));
          if (found == std::future_status::ready) ++released;
        });
    kept.keep(std::move(one), start);
  };
  keep("replaced", 1);
  keep("replaced", 1);
  EXPECT_EQ(released, 1);
  kept.remove("replaced");
  EXPECT_EQ(released, 2);
  keep("makes room", 1);
  keep("large", Animations::kept_bytes_max);
  EXPECT_EQ(released, 3);
  kept.expire(start + Animations::lasts);
  EXPECT_EQ(released, 4);
}

TEST(KeptAnimations, OneIsRemoved) {
  Animations kept;
  for (const char* id : {"a", "b"}) kept.keep(animation_of(id, 1));
  EXPECT_TRUE(kept.remove("a"));
  EXPECT_FALSE(kept.remove("a"));
  EXPECT_FALSE(kept.find("a"));
  EXPECT_TRUE(kept.find("b"));
}

TEST(KeptAnimations, AFileIsReadWhileItIsHeldThoughItIsClosedAndForgotten) {
  Animations kept;
  {
    const data::Descriptor file = movie::unnamed_file();
    ASSERT_EQ(::write(file.number(), "movie", 5), 5);
    auto mapped = MappedFile::of(file);
    ASSERT_TRUE(mapped);
    Animations::Kept one = animation_of("a", 5);
    one.file = *mapped;
    kept.keep(std::move(one));
  }
  const auto found = kept.find("a");
  ASSERT_TRUE(found);
  kept.expire(Clock::now() + Animations::lasts);
  const auto bytes = found->file->bytes();
  EXPECT_EQ(std::string(bytes.begin(), bytes.end()), "movie");
}

}  // namespace
}  // namespace windsplat::tasks
