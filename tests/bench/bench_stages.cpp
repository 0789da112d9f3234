// Time and memory of a frame while the camera moves: every stage by itself, all stages from a
// changed view to JPEG bytes, and heap allocations per frame. What a daemon keeps between frames is
// kept here too:
//
//   bench_stages [--markdown=FILE] [--benchmark_out=FILE] [--benchmark_filter=REGEX]
#include <benchmark/benchmark.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "server/engine/bins.hpp"
#include "server/engine/kernels/dispatch.hpp"
#include "server/engine/plan.hpp"
#include "server/engine/render.hpp"
#include "server/engine/tiles.hpp"
#include "server/frame/frame.hpp"
#include "server/scene/build.hpp"
#include "server/scene/completed_view.hpp"
#include "tests/bench/allocations.hpp"
#include "tests/bench/support.hpp"
#include "tests/bench/text_table.hpp"

namespace windsplat {
namespace {

using bench::number;
using bench::value_or_give_up;
using bench::Workload;
using Clock = std::chrono::steady_clock;

constexpr int jpeg_quality = 80;  // as moving frames are sent, 4:2:0

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// Values by name, one per frame; reported as medians.
class Series {
 public:
  void add(const std::string& name, double value) { values_[name].push_back(value); }
  void count(benchmark::State& state) const {
    for (const auto& [name, values] : values_) state.counters[name] = bench::median(values);
  }

 private:
  std::map<std::string, std::vector<double>> values_;
};

// Pixels are converted to YCbCr codes as a tile is finished.
constexpr std::array<const char*, 7> stages = {"view",         "scene",           "plan", "bins",
                                               "clear planes", "tiles, tone map", "JPEG"};

// Memory of a daemon's renderer, and the same for the frame rendered stage by stage.
struct Kept {
  frame::Workspace whole;
  engine::RenderSpace engine;
  engine::RenderPlan plan;
  engine::BinSpace bins;
  engine::TileSpace tiles;
  image::YccPicture planes;
  image::JpegEncoder jpeg;
};

// One frame, stage by stage.
void staged_frame(const protocol::View& asked, const Workload& workload, ThreadPool& pool,
                  Kept& kept, Series& series) {
  data::Dataset& dataset = bench::dataset_of(workload.sample);
  const auto& table = *value_or_give_up(engine::kernels::chosen_table());
  const CancelToken cancel;
  engine::WorkReport work;
  std::size_t stage = 0;
  auto start = Clock::now();
  const auto lap = [&] {
    series.add(stages[stage++], ms_since(start));
    start = Clock::now();
  };
  const protocol::View view = value_or_give_up(scene::complete(asked, dataset)).view();
  lap();
  const scene::Scene scene = value_or_give_up(scene::build_scene(view, dataset));
  lap();
  engine::make_plan(scene, kept.plan);
  const engine::RenderPlan& plan = kept.plan;
  lap();
  const engine::Bins& bins = engine::make_bins(plan, table, pool, cancel, kept.bins, work);
  lap();
  kept.planes.reset(scene.camera.width, scene.camera.height, image::Subsampling::s420,
                    scene.background);
  lap();
  const auto to_planes = [&kept](const engine::TilePixels& tile) {
    kept.planes.put({tile.x, tile.y, tile.width, tile.height, tile.rgba, tile.stride});
  };
  engine::draw_tiles(plan, bins, nullptr, table, pool, cancel, kept.tiles, to_planes, work);
  lap();
  image::Bytes jpeg;
  if (auto done = kept.jpeg.encode(kept.planes, jpeg_quality, pool, jpeg); !done) {
    bench::give_up(done.error().message);
  }
  lap();
  benchmark::DoNotOptimize(jpeg.data());
}

// The same as in a stream, and its allocations.
void whole_frame(const protocol::View& view, const Workload& workload, ThreadPool& pool, Kept& kept,
                 Series& series) {
  frame::Encoding encoding;
  encoding.quality = jpeg_quality;
  encoding.subsampling = image::Subsampling::s420;
  bench::forget_peak();
  const bench::Allocations before = bench::allocations();
  const auto start = Clock::now();
  const frame::Frame frame = value_or_give_up(frame::produce(
      view, bench::dataset_of(workload.sample), encoding, pool, CancelToken(), kept.whole));
  series.add("to JPEG", ms_since(start));
  const bench::Allocations after = bench::allocations();
  series.add("allocations", static_cast<double>(after.count - before.count));
  series.add("allocated MB", 1e-6 * static_cast<double>(after.bytes - before.bytes));
  series.add("in flight MB", 1e-6 * static_cast<double>(after.live_peak - before.live));
  series.add("JPEG kB", 1e-3 * static_cast<double>(frame.bytes.size()));
}

// The engine alone, which must not allocate in the steady state.
void engine_frame(const protocol::View& view, const Workload& workload, ThreadPool& pool,
                  Kept& kept, Series& series) {
  const scene::Scene scene =
      value_or_give_up(scene::build_scene(view, bench::dataset_of(workload.sample)));
  const CancelToken cancel;
  const bench::Allocations before = bench::allocations();
  value_or_give_up(engine::render(scene, pool, cancel, kept.engine));
  benchmark::DoNotOptimize(kept.engine.image().rgba.data());
  const bench::Allocations after = bench::allocations();
  series.add("engine allocations", static_cast<double>(after.count - before.count));
  series.add("engine allocated MB", 1e-6 * static_cast<double>(after.bytes - before.bytes));
}

void frames(benchmark::State& state, const Workload& workload, unsigned threads) {
  ThreadPool pool(threads);
  protocol::View view = bench::view_of(workload);
  Kept kept;
  Series warm_up;
  whole_frame(view, workload, pool, kept, warm_up);
  staged_frame(view, workload, pool, kept, warm_up);
  engine_frame(view, workload, pool, kept, warm_up);
  Series series;
  double azimuth = 20;
  while (state.KeepRunning()) {
    bench::turn(view, workload, azimuth += 1);
    const auto start = Clock::now();
    whole_frame(view, workload, pool, kept, series);
    state.SetIterationTime(1e-3 * ms_since(start));
    staged_frame(view, workload, pool, kept, series);
    engine_frame(view, workload, pool, kept, series);
  }
  series.count(state);
  const data::Dataset& dataset = bench::dataset_of(workload.sample);
  state.counters["bytes per voxel"] = static_cast<double>(dataset.resident_bytes()) /
                                      static_cast<double>(dataset.info().grid.samples());
}

// Normal console output, and every run for the tables.
class Reporter : public benchmark::ConsoleReporter {
 public:
  Reporter() : ConsoleReporter(OO_None) {}
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) runs_.emplace_back(run.run_name.function_name, run.counters);
    ConsoleReporter::ReportRuns(runs);
  }
  [[nodiscard]] bench::Table table(const std::string& what, const bench::Row& names) const {
    bench::Table out{{what}};
    out.front().insert(out.front().end(), names.begin(), names.end());
    for (const auto& [frame, counters] : runs_) {
      bench::Row row{frame};
      for (const std::string& name : names) {
        row.push_back(
            number(counters.at(name).value < 10 ? "%.2f" : "%.1f", counters.at(name).value));
      }
      out.push_back(row);
    }
    return out;
  }

 private:
  std::vector<std::pair<std::string, benchmark::UserCounters>> runs_;
};

std::vector<Workload> workloads(bool smoke) {
  std::vector<Workload> out;
  for (const bool large : {false, true}) {
    for (const char* preset : {"winds", "clouds", "default"}) {
      Workload workload;
      workload.preset = preset;
      workload.width = large ? 1280 : 640;
      workload.height = large ? 720 : 480;
      workload.every_line = std::string(preset) != "clouds";
      if (smoke) {
        workload.sample.dims = {32, 16, 8};
        workload.width = large ? 64 : 32;
        workload.height = 32;
      }
      workload.name = std::string(preset) == "default" ? "winds+clouds" : preset;
      workload.name += " ";
      workload.name += std::to_string(workload.width);
      workload.name += "x";
      workload.name += std::to_string(workload.height);
      out.push_back(workload);
    }
  }
  return out;
}

int run(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  const bool smoke = !bench::take_option(argc, argv, "--smoke").empty();
  const std::string markdown = bench::take_option(argc, argv, "--markdown");
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  bench::add_context();
  const std::vector<Workload> all = workloads(smoke);
  for (const Workload& workload : all) {
    for (const unsigned threads : bench::thread_counts()) {
      const std::string name = workload.name + ", " + std::to_string(threads) + " thr.";
      benchmark::RegisterBenchmark(
          name.c_str(),
          [&workload, threads](benchmark::State& state) { frames(state, workload, threads); })
          ->Unit(benchmark::kMillisecond)
          ->UseManualTime()
          ->Iterations(smoke ? 2 : 15);
    }
  }
  Reporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  bench::Row times(stages.begin(), stages.end());
  times.emplace_back("to JPEG");
  std::string text;
  std::string marked = bench::machine_line();
  for (const auto& [what, names] :
       {std::pair<std::string, bench::Row>{"medians, ms", times},
        {"a frame",
         {"allocations", "allocated MB", "in flight MB", "engine allocations",
          "engine allocated MB", "JPEG kB", "bytes per voxel"}}}) {
    const bench::Table table = reporter.table(what, names);
    text += "\n";
    text += bench::plain(table, 1);
    marked += bench::markdown(table) + "\n";
  }
  std::fputs(text.c_str(), stdout);
  if (!markdown.empty()) bench::write_file(markdown, marked);
  benchmark::Shutdown();
  return 0;
}

}  // namespace
}  // namespace windsplat

int main(int argc, char** argv) { return windsplat::run(argc, argv); }
