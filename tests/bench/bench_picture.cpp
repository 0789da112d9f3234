// From linear pixels to JPEG bytes, by planes and strips or by rounded RGB in one piece, in one
// run, and whole frames with and without overlap: rates on stdout, and optionally JSON:
//
//   bench_picture [--benchmark_out=FILE] [--benchmark_filter=REGEX]
#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/data/resident/dataset.hpp"
#include "server/data/samples/samples.hpp"
#include "server/frame/frame.hpp"
#include "server/image/jpeg_encoder.hpp"
#include "server/scene/completed_view.hpp"

namespace windsplat::image {
namespace {

struct Size {
  int width;
  int height;
};
constexpr Size sizes[] = {{640, 480}, {1280, 720}, {1920, 1080}};

struct Setting {
  const char* name;
  Subsampling subsampling;
  int quality;
};
constexpr Setting settings[] = {{"420 q80", Subsampling::s420, 80},
                                {"444 q90", Subsampling::s444, 90}};

constexpr std::array<float, 3> background{0.01F, 0.02F, 0.03F};
constexpr int tile = 64;

// Fine lines over soft clouds, as in typical pictures; no part is empty.
std::vector<float> scene(Size size) {
  std::vector<float> rgba;
  rgba.reserve(std::size_t{4} * size.width * size.height);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const auto u = static_cast<float>(x) * 0.01F;
      const auto v = static_cast<float>(y) * 0.01F;
      const float cloud = 0.5F + 0.25F * std::sin(u + std::sin(v)) + 0.25F * std::sin(1.7F * v);
      const float along = std::fmod(7 * (u + 0.6F * v), 2.0F);
      const float line =
          std::max(0.0F, 1 - 8 * std::abs(along - 1)) * std::max(0.0F, std::sin(9 * v));
      const float rest = 1 - line;
      rgba.insert(rgba.end(), {0.6F * cloud * rest + 0.9F * line, 0.6F * cloud * rest + 0.3F * line,
                               0.6F * cloud * rest, 0.8F * cloud * rest + line});
    }
  }
  return rgba;
}

[[noreturn]] void give_up(const Error& error) {
  std::fprintf(stderr, "bench_picture: %s\n", error.message.c_str());
  std::exit(1);  // NOLINT(concurrency-mt-unsafe)
}

void tell(benchmark::State& state, Size size) {
  const double pixels = static_cast<double>(state.iterations()) * size.width * size.height;
  // Printed with their units: 169M/s, 5.9ns.
  state.counters["pixels"] = benchmark::Counter(pixels, benchmark::Counter::kIsRate);
  state.counters["a pixel"] =
      benchmark::Counter(pixels, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

// Pixels of a tile are in the cache when converted; here every tile is read from the same memory.
void fill(const std::vector<float>& tile_rgba, Size size, ThreadPool& pool, YccPicture& picture) {
  const int columns = (size.width + tile - 1) / tile;
  const int rows = (size.height + tile - 1) / tile;
  pool.run(static_cast<std::size_t>(columns * rows), [&](std::size_t index, unsigned) {
    const int x = static_cast<int>(index) % columns * tile;
    const int y = static_cast<int>(index) / columns * tile;
    picture.put({x, y, std::min(tile, size.width - x), std::min(tile, size.height - y),
                 tile_rgba.data(), std::size_t{4} * tile});
  });
}

void tone_map_tiles(benchmark::State& state, Size size, Subsampling subsampling, unsigned threads) {
  ThreadPool pool(threads);
  const std::vector<float> rgba = scene({tile, tile});
  YccPicture picture;
  for (auto _ : state) {
    picture.reset(size.width, size.height, subsampling, background);
    fill(rgba, size, pool, picture);
  }
  tell(state, size);
}

void tone_map_rgb(benchmark::State& state, Size size) {
  const std::vector<float> rgba = scene(size);
  for (auto _ : state) {
    benchmark::DoNotOptimize(tone_map(rgba, size.width, size.height, background));
  }
  tell(state, size);
}

void jpeg_strips(benchmark::State& state, Size size, Setting setting, unsigned threads) {
  ThreadPool pool(threads);
  const std::vector<float> rgba = scene(size);
  YccPicture picture;
  picture.reset(size.width, size.height, setting.subsampling, background);
  picture.put({0, 0, size.width, size.height, rgba.data(), std::size_t{4} * size.width});
  JpegEncoder encoder;
  Bytes bytes;
  for (auto _ : state) {
    if (auto done = encoder.encode(picture, setting.quality, pool, bytes); !done) {
      give_up(done.error());
    }
  }
  tell(state, size);
  state.counters["bytes"] = static_cast<double>(bytes.size());
}

void jpeg_rgb(benchmark::State& state, Size size, Setting setting) {
  const Bytes rgb = tone_map(scene(size), size.width, size.height, background);
  std::size_t bytes = 0;
  for (auto _ : state) {
    const auto jpeg =
        encode_jpeg(rgb, size.width, size.height, setting.quality, setting.subsampling);
    if (!jpeg) give_up(jpeg.error());
    bytes = jpeg->size();
  }
  tell(state, size);
  state.counters["bytes"] = static_cast<double>(bytes);
}

// The climate sample in motion, `frames` frames per iteration.
class Loop {
 public:
  Loop(Size size, unsigned threads) : pool_(threads) {
    auto source = data::open_sample("climate");
    if (!source) give_up(source.error());
    dataset_.emplace(std::move(*source), "climate", std::uint64_t{1} << 30U);
    auto completed = scene::complete({}, *dataset_);
    if (!completed) give_up(completed.error());
    view_ = completed->view();
    view_.image.width = size.width;
    view_.image.height = size.height;
    view_.method.name = protocol::MethodName::kernel;
    draw(spaces_[0]);  // loads the data
  }

  void draw(frame::Workspace& space) {
    const frame::Encoding moving{frame::Format::jpeg, 80, Subsampling::s420};
    const auto completed = frame::complete(view_, *dataset_);
    if (!completed) give_up(completed.error());
    const auto prepared =
        frame::prepare(*completed, frame::own_setting(*completed), *dataset_, moving);
    if (!prepared) give_up(prepared.error());
    const auto done = frame::draw(*prepared, *dataset_, pool_, CancelToken(), space);
    if (!done) give_up(done.error());
  }

  static void encode(frame::Workspace& space, ThreadPool& pool) {
    auto frame = frame::encode(space, pool);
    if (!frame) give_up(frame.error());
    benchmark::DoNotOptimize(frame->bytes.data());
  }

  void one_after_the_other() {
    for (int n = 0; n < frames; ++n) {
      draw(spaces_[0]);
      encode(spaces_[0], pool_);
    }
  }

  // The last frame is encoded by its own thread while all threads render the next.
  void side_by_side() {
    draw(spaces_[0]);
    for (std::size_t n = 1; n <= frames; ++n) {
      std::thread encoder([&] { encode(spaces_[(n - 1) % 2], alone_); });
      if (n < frames) draw(spaces_[n % 2]);
      encoder.join();
    }
  }

  static constexpr int frames = 8;

 private:
  ThreadPool pool_;
  ThreadPool alone_{1};
  std::optional<data::Dataset> dataset_;
  protocol::View view_;
  std::array<frame::Workspace, 2> spaces_;
};

void frame_loop(benchmark::State& state, Size size, unsigned threads, bool overlapped) {
  Loop loop(size, threads);
  for (auto _ : state) {
    if (overlapped) {
      loop.side_by_side();
    } else {
      loop.one_after_the_other();
    }
  }
  state.counters["ms/frame"] =
      benchmark::Counter(1e-3 * static_cast<double>(state.iterations()) * Loop::frames,
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

template <class Function, class... Arguments>
void add(const std::string& name, Function function, Arguments... arguments) {
  benchmark::RegisterBenchmark(name.c_str(), function, arguments...)
      ->Unit(benchmark::kMicrosecond)
      ->UseRealTime()
      ->MeasureProcessCPUTime();
}

void register_all() {
  for (const Size size : sizes) {
    std::string at = " ";
    at += std::to_string(size.width);
    at += "x";
    at += std::to_string(size.height);
    add(std::string("tone map, rgb").append(at), tone_map_rgb, size);
    for (const unsigned threads : {1U, 2U}) {
      std::string on = at;
      on += " threads ";
      on += std::to_string(threads);
      add(std::string("tone map, 420 in tiles").append(on), tone_map_tiles, size, Subsampling::s420,
          threads);
      add(std::string("tone map, 444 in tiles").append(on), tone_map_tiles, size, Subsampling::s444,
          threads);
    }
    for (const unsigned threads : {1U, 2U}) {
      std::string on = at;
      on += " threads ";
      on += std::to_string(threads);
      add(std::string("frames, sequential").append(on), frame_loop, size, threads, false);
      add(std::string("frames, encoding in parallel with the next").append(on), frame_loop, size,
          threads, true);
    }
    for (const Setting& setting : settings) {
      std::string what = setting.name;
      what += at;
      add(std::string("jpeg, rgb ").append(what), jpeg_rgb, size, setting);
      for (const unsigned threads : {1U, 2U}) {
        std::string name = "jpeg, strips ";
        name += what;
        name += " threads ";
        name += std::to_string(threads);
        add(name, jpeg_strips, size, setting, threads);
      }
    }
  }
}

}  // namespace
}  // namespace windsplat::image

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  windsplat::image::register_all();
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
