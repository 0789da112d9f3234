// A frame loop allocates nothing in its steady state; from a view to a JPEG only small blocks:
// copies of the view, its scene and the output. Every allocation of this program is counted.
#include <gtest/gtest.h>
#include <malloc.h>

#include <atomic>
#include <cstdlib>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "server/data/resident/store.hpp"
#include "server/data/samples/samples.hpp"
#include "server/engine/render.hpp"
#include "server/frame/frame.hpp"
#include "server/image/encode.hpp"
#include "server/scene/build.hpp"
#include "server/scene/camera.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/place.hpp"
#include "server/trace/streamlets.hpp"
#include "server/trace/streamlines.hpp"

namespace {

std::atomic<std::int64_t> blocks{0};
std::atomic<std::int64_t> bytes{0};
std::atomic<std::int64_t> held{0};  // bytes not yet freed
std::atomic<std::int64_t> most{0};  // of them at a time
thread_local int good_left = -1;    // number of allocations before one that fails; -1: none fails

void fail_if_due() {
  if (good_left >= 0 && good_left-- == 0) throw std::bad_alloc();
}

void* hold(void* at) {
  const auto size = static_cast<std::int64_t>(malloc_usable_size(at));
  const std::int64_t now = held.fetch_add(size, std::memory_order_relaxed) + size;
  std::int64_t before = most;
  while (before < now && !most.compare_exchange_weak(before, now)) continue;
  return at;
}

void give_up(void* at) {
  if (at == nullptr) return;
  held.fetch_sub(static_cast<std::int64_t>(malloc_usable_size(at)), std::memory_order_relaxed);
  std::free(at);
}

void* counted(std::size_t size) {
  fail_if_due();
  blocks.fetch_add(1, std::memory_order_relaxed);
  bytes.fetch_add(static_cast<std::int64_t>(size), std::memory_order_relaxed);
  if (void* at = std::malloc(size == 0 ? 1 : size)) return hold(at);
  throw std::bad_alloc();
}

void* counted(std::size_t size, std::align_val_t alignment) {
  const auto step = static_cast<std::size_t>(alignment);
  blocks.fetch_add(1, std::memory_order_relaxed);
  bytes.fetch_add(static_cast<std::int64_t>(size), std::memory_order_relaxed);
  if (void* at = std::aligned_alloc(step, (size + step - 1) / step * step)) return hold(at);
  throw std::bad_alloc();
}

}  // namespace

// Array and nothrow forms call these by default, but not under every sanitizer.
void* operator new[](std::size_t size) { return counted(size); }
void operator delete[](void* at) noexcept { give_up(at); }
void operator delete[](void* at, std::size_t /*size*/) noexcept { give_up(at); }
void* operator new(std::size_t size) { return counted(size); }
void* operator new(std::size_t size, const std::nothrow_t& /*tag*/) noexcept {
  try {
    return counted(size);
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  return counted(size, alignment);
}
void operator delete(void* at) noexcept { give_up(at); }
void operator delete(void* at, std::size_t /*size*/) noexcept { give_up(at); }
void operator delete(void* at, std::align_val_t /*alignment*/) noexcept { give_up(at); }
void operator delete(void* at, std::size_t /*size*/, std::align_val_t /*alignment*/) noexcept {
  give_up(at);
}

namespace windsplat {
namespace {

struct Spent {
  std::int64_t blocks = 0;
  std::int64_t bytes = 0;
};

template <class Run>
Spent spent_by(const Run& run) {
  const Spent before{blocks, bytes};
  run();
  return {blocks - before.blocks, bytes - before.bytes};
}

enum class Look { kernel, slab, globe, winds, clouds };

constexpr int turns = 6;  // directions of a camera around the data

std::vector<scene::Scene> orbit(Look look, std::array<int, 3> dims, int width, int height,
                                double offset = 0) {
  data::Dataset dataset(data::open_sample("climate", dims, 1).value(), "climate",
                        std::uint64_t{1} << 30U);
  protocol::View view = scene::complete({}, dataset).value().view();
  view.image.width = width;
  view.image.height = height;
  if (look == Look::globe) {
    view.geometry.mapping = protocol::GeometryMapping::sphere;
    view.camera.eye.reset();
    view.camera.target.reset();
    view.camera.height.reset();
  }
  if (look == Look::winds) view.scalars.emplace();
  if (look == Look::clouds) view.vector.field = {protocol::FieldChoice::Kind::none, ""};
  view.method.name = look == Look::slab ? protocol::MethodName::slab : protocol::MethodName::kernel;
  const auto placed = scene::place_dataset(view.geometry, dataset).value();
  std::vector<scene::Scene> scenes;
  for (int turn = 0; turn < turns; ++turn) {
    scene::orbit(view, placed->lattice, 360.0 / turns * turn + offset, 25 + offset, 1);
    scenes.push_back(scene::build_scene(view, dataset).value());
  }
  return scenes;
}

class SteadyState : public testing::TestWithParam<Look> {
 protected:
  void draw(const std::vector<scene::Scene>& scenes) {
    for (const scene::Scene& scene : scenes) {
      if (!engine::render(scene, pool_, cancel_, space_)) std::abort();
    }
  }
  ThreadPool pool_{2};
  CancelToken cancel_;
  engine::RenderSpace space_;
};

// From the third round, for any picture size and dataset: within two, each of the four kept grounds
// has had every camera.
TEST_P(SteadyState, FramesAllocateNothing) {
  struct Size {
    std::array<int, 3> dims;
    int width, height;
  };
  for (const Size& size : {Size{{40, 24, 8}, 160, 120}, Size{{64, 40, 12}, 240, 180}}) {
    const auto scenes = orbit(GetParam(), size.dims, size.width, size.height);
    const Spent first = spent_by([&] { draw(scenes); });
    EXPECT_GT(first.blocks, 0) << "kept memory was allocated once";
    draw(scenes);
    for (int round = 3; round < 5; ++round) {
      const Spent spent = spent_by([&] { draw(scenes); });
      EXPECT_EQ(spent.blocks, 0) << "round " << round << ", " << spent.bytes << " bytes";
    }
  }
}

// A camera at new positions reuses almost all memory: the remaining growth is far less than a
// picture per frame.
TEST_P(SteadyState, NewPathCostsFewAllocations) {
  const std::array<int, 3> dims{64, 40, 12};
  const auto warm = orbit(GetParam(), dims, 240, 180);
  const auto scenes = orbit(GetParam(), dims, 240, 180, 7);
  draw(warm);
  draw(warm);
  const Spent known = spent_by([&] { draw(warm); });
  const Spent fresh = spent_by([&] { draw(scenes); });
  const std::int64_t picture = std::int64_t{4} * 240 * 180 * static_cast<int>(sizeof(float));
  EXPECT_LE(fresh.bytes - known.bytes, turns * picture / 3);
}

INSTANTIATE_TEST_SUITE_P(Looks, SteadyState,
                         testing::Values(Look::kernel, Look::slab, Look::globe, Look::winds,
                                         Look::clouds));

// From a view to a JPEG: no picture, planes or strips, only the output.
TEST(SteadyStateItself, JpegAllocatesItsOwnBytesOnly) {
  data::Dataset dataset(data::open_sample("climate", {64, 40, 12}, 1).value(), "climate",
                        std::uint64_t{1} << 30U);
  protocol::View view = scene::complete({}, dataset).value().view();
  view.image.width = 320;
  view.image.height = 240;
  view.method.name = protocol::MethodName::kernel;
  const auto placed = scene::place_dataset(view.geometry, dataset).value();
  std::vector<protocol::View> views;
  for (int turn = 0; turn < turns; ++turn) {
    scene::orbit(view, placed->lattice, 360.0 / turns * turn, 25, 1);
    views.push_back(view);
  }
  ThreadPool pool(2);
  frame::Workspace workspace;
  for (const auto subsampling : {image::Subsampling::s420, image::Subsampling::s444}) {
    const frame::Encoding encoding{frame::Format::jpeg, 80, subsampling};
    std::int64_t sent = 0;
    const auto draw = [&] {
      sent = 0;
      for (const protocol::View& each : views) {
        const auto made = frame::produce(each, dataset, encoding, pool, CancelToken(), workspace);
        if (!made) std::abort();
        sent += static_cast<std::int64_t>(made->bytes.size());
      }
    };
    draw();
    draw();  // each kept ground has had every camera
    const Spent spent = spent_by(draw);
    // The view, its defaults, two colour tables of 3 kB, some numbers per kernel position of each
    // axis, names of the report, how levels are read, and the axes of the map of the ground; the
    // planes alone would be 115 kB.
    EXPECT_LE(spent.bytes, turns * 25600 + sent);
    EXPECT_GE(spent.bytes, sent);
    EXPECT_LE(spent.blocks, turns * 90);
  }
}

// One and a half times as many pixels as are kept.
constexpr int huge_width = 2048;
constexpr int huge_height = 1536;
constexpr std::int64_t huge_pixels = std::int64_t{huge_width} * huge_height;

TEST(HugePicture, FloatsAreReleasedByTheNextSmallerPicture) {
  const auto huge = orbit(Look::kernel, {8, 8, 4}, huge_width, huge_height);
  const auto small = orbit(Look::kernel, {8, 8, 4}, 160, 120);
  ThreadPool pool(2);
  engine::RenderSpace space;
  ASSERT_TRUE(engine::render(huge[0], pool, CancelToken(), space));
  ASSERT_GE(space.image().rgba.capacity(), static_cast<std::size_t>(4 * huge_pixels));
  ASSERT_TRUE(engine::render(small[0], pool, CancelToken(), space));
  EXPECT_LT(space.image().rgba.capacity(), std::size_t{4} * 1920 * 1080);
}

TEST(HugePicture, FloatsOfAPngAreReleasedAfterEncoding) {
  data::Dataset dataset(data::open_sample("climate", {8, 8, 4}, 1).value(), "climate",
                        std::uint64_t{1} << 30U);
  protocol::View view = scene::complete({}, dataset).value().view();
  ThreadPool pool(2);
  frame::Workspace workspace;
  for (const int width : {320, huge_width}) {
    view.image.width = width;
    view.image.height = 3 * width / 4;
    const frame::Encoding encoding{frame::Format::png};
    ASSERT_TRUE(frame::produce(view, dataset, encoding, pool, CancelToken(), workspace));
    const bool kept = workspace.space.image().rgba.capacity() > 0;
    EXPECT_EQ(kept, width < huge_width) << width;
  }
}

// The planes and strips that a workspace keeps after one huge and one small picture.
TEST(HugePicture, PlanesAndStripsAreReleasedByTheNextSmallerPicture) {
  ThreadPool pool(2);
  for (const auto subsampling : {image::Subsampling::s420, image::Subsampling::s444}) {
    image::YccPicture planes;
    image::JpegEncoder encoder;
    image::Bytes jpeg;
    const auto encode = [&](int width, int height) {
      planes.reset(width, height, subsampling, {});
      ASSERT_TRUE(encoder.encode(planes, 80, pool, jpeg));
    };
    encode(160, 120);
    const std::int64_t small = held;
    encode(4 * huge_width, huge_height);
    const std::int64_t huge = held;
    EXPECT_GT(huge - small, 4 * huge_pixels) << "a substantial amount is released";
    planes.reset(160, 120, subsampling, {});
    const std::int64_t without_planes = held;
    EXPECT_LE(without_planes, huge - 4 * huge_pixels) << "at least one sample per pixel";
    encode(160, 120);
    EXPECT_LE(held, without_planes - 4 * huge_pixels) << "strips";
    jpeg = image::Bytes();
    EXPECT_LE(held, small + 65536);
    // Memory for common picture sizes is kept, whatever is rendered in between.
    encode(1920, 1080);
    const std::int64_t common = held;
    encode(960, 540);
    EXPECT_GE(held, common);
  }
}

// Shutdown of a daemon without free memory, and the destructors of its sessions.
TEST(WithoutMemory, PrefetchRequestsAreWithdrawnAndAStoreIsDestroyed) {
  data::Store store(std::uint64_t{1} << 30U);
  const auto dataset = store.add("climate:16x16x8").value();
  const std::string field = dataset->info().fields.front().name;
  ASSERT_TRUE(dataset->volume(field, 0)) << "so that no thread works on a prefetch request";
  store.request_prefetch(1, {{*dataset, field, 0, {}, {}}});
  const Spent spent = spent_by([&] {
    store.request_prefetch(2, {});
    store.request_prefetch(1, {});
    store.end();
  });
  EXPECT_EQ(spent.blocks, 0);
}

// A failure of any allocation, by libpng, zlib or for the output, is an error without leaks.
TEST(WithoutMemory, PngIsAnError) {
  constexpr int edge = 200;
  std::vector<std::uint8_t> noise(std::size_t{3} * edge * edge);
  std::uint32_t state = 1;
  for (std::uint8_t& sample : noise) {
    state = state * 1664525U + 1013904223U;
    sample = static_cast<std::uint8_t>(state >> 24U);
  }
  const CancelToken cancel;
  int failures = 0;
  for (bool done = false; !done; ++failures) {
    const std::int64_t before = held;
    {
      good_left = failures;
      const auto png = image::encode_png(noise, edge, edge, cancel);
      good_left = -1;
      done = png.has_value();
      if (!done) {
        EXPECT_EQ(png.error().kind, ErrorKind::out_of_memory) << failures;
        EXPECT_TRUE(png.error().message.starts_with("PNG: ")) << png.error().message;
      }
    }
    EXPECT_EQ(held, before) << failures;
  }
  EXPECT_GE(failures, 8) << "two structures, five blocks of zlib's, some of the bytes";
}

// Checks the counter: an allocation of picture size is counted.
// Bytes that run() holds at a time beyond those held before.
template <class Run>
std::int64_t held_by(const Run& run) {
  const std::int64_t before = held;
  most = before;
  run();
  return most - before;
}

// A vortex in a lattice of unit cells.
struct Vortex {
  static constexpr std::array<int, 3> dims{48, 48, 12};
  std::array<std::vector<double>, 3> positions, spacing;
  std::array<std::vector<float>, 3> values;

  Vortex() {
    for (std::size_t a = 0; a < 3; ++a) {
      const auto count = static_cast<std::size_t>(dims[a]);
      for (int i = 0; i < dims[a]; ++i) positions[a].push_back(i);
      spacing[a].assign(count, 1);
    }
    for (int n = 0; n < dims[0] * dims[1] * dims[2]; ++n) {
      values[0].push_back(static_cast<float>(23.4 - n / dims[0] % dims[1]));
      values[1].push_back(static_cast<float>(n % dims[0] - 23.7));
      values[2].push_back(0);
    }
  }
  void set(trace::Flow& flow) const {
    for (std::size_t a = 0; a < 3; ++a) {
      flow.dims.at(a) = dims[a];
      flow.components.at(a) = values[a].data();
      flow.positions.at(a) = positions[a];
      flow.spacing.at(a) = spacing[a];
    }
  }
};

constexpr std::int64_t thread_bytes = 65536;  // of paths and threads

TEST(Tracing, StreamletsHoldNoMoreThanTheyAreChargedWith) {
  const Vortex vortex;
  trace::Streamlets of;
  vortex.set(of.flow);
  of.drawn = Vortex::dims;
  of.length = 12;
  of.segments_max = 4;
  of.color = [](const glm::dvec3&, const trace::Motion& motion) { return motion.magnitude; };
  const trace::Room room = trace::room_of(of);
  trace::Segments made;
  const std::int64_t bytes = held_by([&] { made = trace::make_segments(of); });
  EXPECT_GT(made.tally.segments, 2 * 48 * 48 * 12);
  EXPECT_LE(made.vertices(), static_cast<std::size_t>(room.vertices));
  EXPECT_LE(bytes, static_cast<std::int64_t>(room.bytes) + thread_bytes);
}

TEST(Tracing, LinesOfSeedsHoldNoMoreThanTheyAreChargedWith) {
  const Vortex vortex;
  trace::Streamlines of;
  vortex.set(of.flow);
  of.length = 30;
  of.dash = 2;
  of.pieces_max = 128;
  of.departure = 1e-6;
  of.longest = 0.5;
  of.color = [](const glm::dvec3&, const trace::Motion& motion) { return motion.magnitude; };
  constexpr int count = 2000;
  for (int n = 0; n < count; ++n) of.seeds.emplace_back(12 + n % 24, 12 + n / 24 % 24, n % 11);
  const trace::Room room = trace::room_of(of, count);
  trace::Segments made;
  const std::int64_t bytes = held_by([&] { made = trace::make_streamlines(of); });
  EXPECT_GT(made.tally.segments, count * 100);
  EXPECT_LE(made.vertices(), static_cast<std::size_t>(room.vertices));
  EXPECT_LE(bytes, static_cast<std::int64_t>(room.bytes) + thread_bytes);
}

TEST(SteadyStateItself, CountsTheAllocationOfAVector) {
  const Spent spent = spent_by([] {
    std::vector<float> picture(4UL * 320 * 240);
    ASSERT_EQ(picture.back(), 0.0F);
  });
  EXPECT_GE(spent.blocks, 1);
  EXPECT_GE(spent.bytes, static_cast<std::int64_t>(4UL * 320 * 240 * sizeof(float)));
}

}  // namespace
}  // namespace windsplat
