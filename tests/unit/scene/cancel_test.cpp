// Computations of a scene that take long, ended by a raised token.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {
namespace {

using protocol::View;

View with_streamlets() {
  View view;
  view.vector.trace = protocol::TraceView{};
  return view;
}

View with_seeds() {
  View view = with_streamlets();
  view.vector.trace->seeds = protocol::SeedsView{};
  return view;
}

View with_surface() {
  View view;
  protocol::SurfaceView surface;
  surface.field = "cloud";
  surface.isovalue = 0.2;
  view.surfaces = {surface};
  return view;
}

View with_light() {
  View view;
  view.light = protocol::LightView{};
  return view;
}

// Nothing of a cancelled computation is kept: the next caller gets all of it.
TEST(CancelledScene, KeepsNothingHalfDone) {
  for (const View& view : {with_streamlets(), with_seeds(), with_surface(), with_light()}) {
    auto dataset = sample_dataset("tornado", {20, 20, 20});
    const auto completed = complete(view, *dataset);
    ASSERT_TRUE(completed) << completed.error().message;
    const CancelToken cancel;
    data::Dataset cancelled = dataset->cancelled_by(cancel);
    cancel.cancel();
    const auto none = build_scene(*completed, cancelled);
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().kind, ErrorKind::cancelled);
    auto whole = sample_dataset("tornado", {20, 20, 20});
    const Scene expected = built(view, *whole);
    const Scene scene = built(view, *dataset);
    if (view.vector.trace) {
      EXPECT_EQ(scene.vector->streamlets->places, expected.vector->streamlets->places);
    }
    if (!view.surfaces.empty()) {
      EXPECT_EQ(scene.surfaces[0].mesh->triangles, expected.surfaces[0].mesh->triangles);
    }
    if (view.light) {
      EXPECT_EQ(*scene.light->sunlight, *expected.light->sunlight);
    }
  }
}

// One caller is cancelled while another waits for what it computes.
TEST(CancelledScene, AnotherCallerComputesWhatItWaitedFor) {
  auto dataset = sample_dataset("tornado", {8, 8, 8});
  const CancelToken cancel;
  data::Dataset first = dataset->cancelled_by(cancel);
  std::atomic<bool> began = false;
  std::atomic<int> made = 0;
  std::thread one([&] {
    const auto kept = first.auxiliary("x", 8, [&]() -> Result<data::Resident> {
      began = true;
      while (!cancel.cancelled()) std::this_thread::yield();
      return make_error(ErrorKind::cancelled, "cancelled");
    });
    EXPECT_FALSE(kept);
  });
  while (!began) std::this_thread::yield();
  std::thread two([&] {
    data::Dataset second = *dataset;
    const auto kept = second.auxiliary("x", 8, [&]() -> Result<data::Resident> {
      ++made;
      return data::Resident(std::make_shared<const int>(7));
    });
    EXPECT_TRUE(kept);
  });
  cancel.cancel();
  one.join();
  two.join();
  EXPECT_EQ(made, 1);
}

}  // namespace
}  // namespace windsplat::scene
