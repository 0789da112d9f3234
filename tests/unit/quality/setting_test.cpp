// Settings: picture sizes, their effect on a view, and when they are allowed.
#include "server/quality/setting.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "protocol/limits.hpp"

namespace windsplat::quality {
namespace {

using protocol::MethodName;

protocol::View view_of(int width, int height, MethodName method = MethodName::slab) {
  protocol::View view;
  view.image.width = width;
  view.image.height = height;
  view.method.name = method;
  return view;
}

std::size_t index(const Setting& setting) {
  const auto at = index_of(setting);
  if (!at) ADD_FAILURE() << "no such setting";
  return at.value_or(0);
}

TEST(Size, WholeLevelsHalveAndHalfLevelsHalveThePixels) {
  const PictureSize full{1280, 720};
  const auto size = [&](int half_level) { return size_at(full, {MethodName::kernel, half_level}); };
  EXPECT_EQ(size(0), full);
  EXPECT_EQ(size(2), (PictureSize{640, 360}));
  EXPECT_EQ(size(6), (PictureSize{160, 90}));
  for (const int half_level : {1, 3, 5}) {
    const double wanted = 1280 * std::pow(2.0, -0.5 * half_level);
    EXPECT_NEAR(size(half_level).width, wanted, 0.02 * wanted) << half_level;
  }
  EXPECT_EQ(size_at({5, 4}, {MethodName::kernel, 8}), (PictureSize{1, 1}));
  EXPECT_EQ(size_at({1, 1}, {MethodName::kernel, 31}), (PictureSize{1, 1}));
}

// Other proportions would move what is shown: by up to half a row of the smaller picture.
TEST(Size, KeepsTheProportionsOfTheViewAndDecreases) {
  for (const PictureSize full : {PictureSize{640, 480}, {1280, 720}, {1013, 677}, {300, 1201}}) {
    PictureSize last = full;
    for (int size = 1; size <= 32; ++size) {
      const PictureSize now = size_at(full, {MethodName::kernel, size / 8, 0, 1, size % 8});
      EXPECT_LE(now.height, last.height);
      const double scale = std::exp2(-size / 16.0);
      EXPECT_NEAR(now.height, scale * full.height, std::max(1.0, 0.016 * now.height)) << size;
      const double moved = std::abs(static_cast<double>(now.width) * full.height /
                                        (static_cast<double>(now.height) * full.width) -
                                    1);
      const int shorter = std::min(now.width, now.height);
      EXPECT_LE(moved, shorter > 150 ? 1.2e-3 : 6e-3) << full.width << " " << size;
      last = now;
    }
  }
  EXPECT_EQ(size_at({640, 480}, {MethodName::kernel, 1, 0, 1, 4}), (PictureSize{380, 285}));
}

TEST(Size, WireLevelIsTheFinerWholeOne) {
  EXPECT_EQ(wire_level(0), 0);
  EXPECT_EQ(wire_level(1), 0);
  EXPECT_EQ(wire_level(2), 1);
  EXPECT_EQ(wire_level(5), 2);
}

TEST(Setting, EachExistsOnceAndIsFound) {
  for (std::size_t i = 0; i < settings.size(); ++i) EXPECT_EQ(index_of(settings[i]), i);
  EXPECT_FALSE(index_of({MethodName::kernel, 7, 0}));
  EXPECT_FALSE(index_of({MethodName::slab, 0, 0, 3}));
}

TEST(Setting, OwnSettingRendersTheViewUnchanged) {
  for (const MethodName method : {MethodName::kernel, MethodName::slab}) {
    const protocol::View view = view_of(640, 480, method);
    const Setting& own = settings[own_setting(view)];
    EXPECT_EQ(own, (Setting{method, 0, 0, 1}));
    const protocol::View same = at_setting(view, own);
    EXPECT_EQ(same.method.name, method);
    EXPECT_EQ(same.method.slab_thickness, view.method.slab_thickness);
  }
}

TEST(Setting, AppliesMethodAndThicknessAndKeepsTheSize) {
  protocol::View view = view_of(640, 480);
  view.method.slab_thickness = 2;
  const protocol::View thin = at_setting(view, {MethodName::slab, 0, 0, 4});
  EXPECT_EQ(thin.method.slab_thickness, 0.5);
  const protocol::View small = at_setting(view, {MethodName::kernel, 4, 1});
  EXPECT_EQ(small.method.name, MethodName::kernel);
  EXPECT_EQ(small.image.width, 640);
  view.method.name = MethodName::reference;
  EXPECT_EQ(at_setting(view, {MethodName::kernel, 4, 1}).method.name, MethodName::reference);
}

TEST(Allowed, KernelViewUsesSlabsOnlyForARequestedError) {
  protocol::View view = view_of(640, 480, MethodName::kernel);
  EXPECT_FALSE(is_allowed({MethodName::slab, 0, 0}, view));
  EXPECT_TRUE(is_allowed({MethodName::kernel, 0, 0}, view));
  view.quality.max_error = 0.01;
  EXPECT_TRUE(is_allowed({MethodName::slab, 0, 0}, view));
}

TEST(Allowed, ReferenceHasNoAlternativesAndFullDetailNoAverages) {
  for (const Setting& setting : settings) {
    EXPECT_FALSE(is_allowed(setting, view_of(640, 480, MethodName::reference)));
    protocol::View full = view_of(640, 480);
    full.method.detail = protocol::Detail::full;
    EXPECT_EQ(is_allowed(setting, full),
              setting.coarser == 0 && is_allowed(setting, view_of(640, 480)));
  }
}

TEST(Allowed, NoPictureBelow64PixelsExceptTheRequestedOne) {
  EXPECT_TRUE(is_allowed({MethodName::kernel, 6, 0}, view_of(1024, 512)));
  EXPECT_FALSE(is_allowed({MethodName::kernel, 8, 0}, view_of(1024, 512)));
  EXPECT_FALSE(is_allowed({MethodName::kernel, 6, 0}, view_of(1024, 500)));
  const protocol::View tiny = view_of(40, 30);
  EXPECT_TRUE(is_allowed(settings[own_setting(tiny)], tiny));
  EXPECT_FALSE(is_allowed({MethodName::kernel, 1, 0}, tiny));
}

TEST(Allowed, NoSlabsThinnerThanTheWireLimit) {
  protocol::View view = view_of(640, 480);
  view.method.slab_thickness = 2 * protocol::limits::slab_thickness_min;
  EXPECT_TRUE(is_allowed(settings[index({MethodName::slab, 0, 0, 2})], view));
  EXPECT_FALSE(is_allowed(settings[index({MethodName::slab, 0, 0, 4})], view));
}

}  // namespace
}  // namespace windsplat::quality
