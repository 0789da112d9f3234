// How long finished animations are kept, and how many.
#include "server/tasks/animation/animations.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <string>

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
