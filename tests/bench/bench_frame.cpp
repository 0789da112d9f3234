// Whole frames, engine compared with the naive renderer in one run: times and a table of ratios on
// stdout, and optionally JSON with machine, compiler and target:
//
//   bench_frame [--all] [--markdown=FILE] [--benchmark_out=FILE] [--benchmark_filter=REGEX]
//
// The same for generated scenes, whose names contain TEXT, with both methods:
//
//   bench_frame --scenes[=TEXT] [--content=lines|medium|both] [--rounds=N] [--side=N] [--no-naive]
//               [--processor-time] [--markdown=FILE]
#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "server/base/thread_pool.hpp"
#include "server/engine/render.hpp"
#include "server/image/encode.hpp"
#include "server/scene/build.hpp"
#include "tests/bench/scenes/scene_set.hpp"
#include "tests/bench/scenes/scene_times.hpp"
#include "tests/bench/support.hpp"
#include "tests/bench/text_table.hpp"
#include "tests/numerics/naive_renderer.hpp"

namespace windsplat {
namespace {

using bench::number;
using bench::Size;
using bench::value_or_give_up;
using bench::Workload;

std::string named(const std::string& what, const Size& size) {
  return what + " " + std::to_string(size.width) + "x" + std::to_string(size.height);
}

// The same scene with method slab: no naive row, because the naive renderer is kernel-based.
Workload by_slab(Workload workload) {
  workload.name += " slab";
  workload.method = protocol::MethodName::slab;
  workload.naive = false;
  return workload;
}

// Samples closer than a pixel are averaged, as by default; compared with the row of full detail.
Workload with_auto_detail(Workload workload) {
  workload.name += " auto detail";
  workload.detail = protocol::Detail::automatic;
  workload.naive = false;
  return workload;
}

void add_climate(const Size& size, bool heavy, std::vector<Workload>& out) {
  struct Kind {
    const char* name;
    const char* preset;
    bool every_line;
    bool slab;
  };
  constexpr std::array<Kind, 4> kinds = {{{"winds", "winds", true, false},
                                          {"winds+clouds", "default", true, true},
                                          {"clouds", "clouds", false, true},
                                          {"default view", "default", false, true}}};
  for (const Kind& kind : kinds) {
    Workload workload;
    workload.name = named(kind.name, size);
    workload.preset = kind.preset;
    workload.width = size.width;
    workload.height = size.height;
    workload.every_line = kind.every_line;
    workload.heavy = heavy;
    out.push_back(workload);
    if (kind.slab) out.push_back(by_slab(workload));
  }
}

void add_large(const Size& size, std::vector<Workload>& out) {
  Workload tornado;
  tornado.name = named("tornado 256^3", size);
  tornado.sample = bench::tornado_256;
  tornado.width = size.width;
  tornado.height = size.height;
  tornado.heavy = true;
  Workload scalar = tornado;
  scalar.name = named("scalar 512^3", size);
  scalar.sample = bench::tornado_512;
  scalar.preset = "clouds";
  for (const Workload& workload : {tornado, scalar}) {
    out.push_back(workload);
    out.push_back(by_slab(workload));
  }
}

// Cells smaller than a pixel.
void add_levels(std::vector<Workload>& out) {
  Workload scalar;
  scalar.name = "scalar 512^3 640x480";
  scalar.sample = bench::tornado_512;
  scalar.preset = "clouds";
  scalar.heavy = true;
  Workload tornado;
  tornado.name = "tornado 256^3 160x120";
  tornado.sample = bench::tornado_256;
  tornado.width = 160;
  tornado.height = 120;
  tornado.heavy = true;
  tornado.naive = false;
  out.push_back(tornado);
  out.push_back(by_slab(tornado));
  for (const Workload& workload : {scalar, tornado}) {
    const Workload reduced = with_auto_detail(workload);
    out.push_back(reduced);
    out.push_back(by_slab(reduced));
  }
}

std::vector<Workload> all_workloads() {
  std::vector<Workload> out;
  add_climate({640, 480}, false, out);
  add_climate({1280, 720}, false, out);
  add_climate({1920, 1080}, true, out);
  add_large({640, 480}, out);
  add_large({1280, 720}, out);
  add_levels(out);
  // One dataset is open at a time.
  std::stable_sort(out.begin(), out.end(), [](const Workload& a, const Workload& b) {
    return a.sample.dims[0] < b.sample.dims[0];
  });
  return out;
}

// One tiny frame to check that the program runs. Its cells are smaller than a pixel.
std::vector<Workload> smoke_workloads() {
  Workload workload;
  workload.name = "winds+clouds 64x48";
  workload.sample.dims = {256, 128, 8};
  workload.width = 64;
  workload.height = 48;
  return {workload, by_slab(workload), with_auto_detail(workload)};
}

void count_work(benchmark::State& state, const engine::WorkReport& work) {
  state.counters["samples"] = static_cast<double>(work.samples);
  state.counters["pixel_updates"] = static_cast<double>(work.pixel_updates);
  state.counters["exponentials"] = static_cast<double>(work.exponentials);
}

void engine_frame(benchmark::State& state, const Workload& workload, unsigned threads) {
  const scene::Scene scene = bench::scene_of(workload);
  ThreadPool pool(threads);
  const CancelToken cancel;
  // Reads memory and samples once, untimed.
  engine::RenderSpace space;
  engine::WorkReport work = value_or_give_up(engine::render(scene, pool, cancel, space));
  while (state.KeepRunning()) {
    work = value_or_give_up(engine::render(scene, pool, cancel, space));
    benchmark::DoNotOptimize(space.image().rgba.data());
  }
  count_work(state, work);
}

// Difference of two displayed pictures.
struct Apart {
  int codes = 0;      // of 255, in the worst channel of the worst pixel
  double beyond = 0;  // channels that differ by more than one code, per million
  double psnr_db;     // over all channels; infinite, and not reported, if the pictures are equal
};

Apart apart(const image::Bytes& a, const image::Bytes& b) {
  Apart out{};
  double square = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const int codes = std::abs(int{a[i]} - int{b[i]});
    out.codes = std::max(out.codes, codes);
    square += codes * codes;
    if (codes > 1) out.beyond += 1e6 / static_cast<double>(a.size());
  }
  out.psnr_db = 10 * std::log10(255.0 * 255.0 * static_cast<double>(a.size()) / square);
  return out;
}

void naive_frame(benchmark::State& state, const Workload& workload) {
  const scene::Scene scene = bench::scene_of(workload);
  while (state.KeepRunning()) {
    auto picture = naive::render<float>(scene);
    benchmark::DoNotOptimize(picture.rgba.data());
  }
  // In double precision, so that the difference is that of the engine only.
  const naive::Picture<double> exact = naive::render<double>(scene);
  ThreadPool pool(0);
  const auto engine = value_or_give_up(engine::render(scene, pool, CancelToken()));
  const auto shown = [&](const std::vector<float>& rgba) {
    return image::tone_map(rgba, exact.width, exact.height, scene.background);
  };
  const Apart found =
      apart(shown({exact.rgba.begin(), exact.rgba.end()}), shown(engine.image.rgba));
  state.counters["codes_apart"] = found.codes;
  state.counters["channels_beyond_1_ppm"] = found.beyond;
  if (found.codes > 0) state.counters["psnr_db"] = found.psnr_db;
}

std::string threads_label(unsigned threads) {
  return std::to_string(threads) + (threads == 1 ? " thread" : " threads");
}

// Normal console output, and the medians for the table.
class Reporter : public benchmark::ConsoleReporter {
 public:
  Reporter() : ConsoleReporter(OO_Tabular) {}
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      const bool median = run.aggregate_name == "median";
      if (!median && !run.aggregate_name.empty()) continue;
      Frame frame{run.GetAdjustedRealTime(), run.GetAdjustedCPUTime(), {}};
      for (const auto& [name, counter] : run.counters) frame.counters[name] = counter.value;
      frames_[run.run_name.function_name] = frame;
    }
    ConsoleReporter::ReportRuns(runs);
  }

  // Wall times; the ratio to the naive renderer by processor time, which other programs disturb
  // less.
  [[nodiscard]] bench::Table table(const std::vector<Workload>& workloads) const {
    bench::Row head{"frame, ms", "naive"};
    const std::vector<unsigned> counts = bench::thread_counts();
    for (const unsigned threads : counts) head.push_back(threads_label(threads));
    head.insert(head.end(),
                {"naive/1", "1/" + std::to_string(counts.back()), "codes apart", "beyond 1, ppm",
                 "PSNR, dB", "samples, M", "pixel updates, M", "exponentials, M"});
    bench::Table out{head};
    for (const Workload& workload : workloads) {
      if (find(workload, threads_label(1)) != nullptr) out.push_back(row(workload, counts));
    }
    return out;
  }

  // Whether a row visited every sample of its dataset: required of all but automatic detail.
  [[nodiscard]] bool drew_all_of(const Workload& workload) const {
    const Frame* frame = find(workload, threads_label(1));
    double samples = 1;
    for (const int side : workload.sample.dims) samples *= side;
    return frame != nullptr && frame->counters.at("samples") == samples;
  }

 private:
  struct Frame {
    double wall;
    double processor;
    std::map<std::string, double> counters;
  };

  [[nodiscard]] const Frame* find(const Workload& workload, const std::string& how) const {
    const auto found = frames_.find(workload.name + " " + how);
    return found == frames_.end() ? nullptr : &found->second;
  }

  [[nodiscard]] bench::Row row(const Workload& workload,
                               const std::vector<unsigned>& counts) const {
    const Frame* naive = find(workload, "naive");
    const Frame& one = *find(workload, threads_label(1));
    bench::Row out{workload.name, naive != nullptr ? number("%.1f", naive->wall) : ""};
    const Frame* most = nullptr;
    for (const unsigned threads : counts) {
      most = find(workload, threads_label(threads));
      out.push_back(most != nullptr ? number("%.1f", most->wall) : "");
    }
    out.push_back(naive != nullptr ? number("%.1fx", naive->processor / one.processor) : "");
    out.push_back(most != nullptr ? number("%.2fx", one.wall / most->wall) : "");
    out.push_back(naive != nullptr ? number("%.0f", naive->counters.at("codes_apart")) : "");
    out.push_back(naive != nullptr ? number("%.1f", naive->counters.at("channels_beyond_1_ppm"))
                                   : "");
    const bool differs = naive != nullptr && naive->counters.count("psnr_db") > 0;
    out.push_back(differs ? number("%.1f", naive->counters.at("psnr_db")) : "");
    for (const char* name : {"samples", "pixel_updates", "exponentials"}) {
      out.push_back(number("%.2f", 1e-6 * one.counters.at(name)));
    }
    return out;
  }

  std::map<std::string, Frame> frames_;
};

void settle(benchmark::internal::Benchmark* frame, int repetitions, int iterations) {
  frame->Unit(benchmark::kMillisecond)
      ->UseRealTime()
      ->MeasureProcessCPUTime()
      ->Iterations(iterations)
      ->Repetitions(repetitions)
      ->ReportAggregatesOnly(repetitions > 1);
}

void register_frames(const std::vector<Workload>& workloads) {
  for (const Workload& workload : workloads) {
    if (workload.naive) {
      settle(benchmark::RegisterBenchmark(
                 (workload.name + " naive").c_str(),
                 [&workload](benchmark::State& state) { naive_frame(state, workload); }),
             workload.heavy ? 1 : 3, 1);
    }
    const bool kernel = workload.method == protocol::MethodName::kernel;
    for (const unsigned threads : bench::thread_counts()) {
      settle(benchmark::RegisterBenchmark((workload.name + " " + threads_label(threads)).c_str(),
                                          [&workload, threads](benchmark::State& state) {
                                            engine_frame(state, workload, threads);
                                          }),
             workload.heavy ? 3 : 9, kernel && !workload.heavy ? 2 : 1);
    }
  }
}

int run_scenes(int argc, char** argv, const std::string& only) {
  bench::SceneOptions options;
  if (only != "set") options.only = only;
  options.smoke = !bench::take_option(argc, argv, "--smoke").empty();
  options.content = bench::take_option(argc, argv, "--content");
  options.naive = bench::take_option(argc, argv, "--no-naive").empty();
  options.processor_time = !bench::take_option(argc, argv, "--processor-time").empty();
  const std::string markdown = bench::take_option(argc, argv, "--markdown");
  const std::string rounds = bench::take_option(argc, argv, "--rounds");
  const std::string side = bench::take_option(argc, argv, "--side");
  if (argc > 1) bench::give_up("unknown option '" + std::string(argv[1]) + "'");
  if (!rounds.empty()) options.rounds = std::stoi(rounds);
  if (!side.empty()) options.side = std::stoi(side);
  const bench::Table table = bench::scene_times(options);
  std::printf("%s", bench::plain(table, 3).c_str());
  if (!markdown.empty())
    bench::write_file(markdown, bench::machine_line() + bench::markdown(table));
  return table.size() > 1 ? 0 : 1;
}

int run(int argc, char** argv) {
  const std::string scenes = bench::take_option(argc, argv, "--scenes");
  if (!scenes.empty()) return run_scenes(argc, argv, scenes);
  benchmark::Initialize(&argc, argv);
  const bool all = !bench::take_option(argc, argv, "--all").empty();
  const bool smoke = !bench::take_option(argc, argv, "--smoke").empty();
  const std::string markdown = bench::take_option(argc, argv, "--markdown");
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  bench::add_context();
  std::vector<Workload> workloads = smoke ? smoke_workloads() : all_workloads();
  if (!all) std::erase_if(workloads, [](const Workload& workload) { return workload.heavy; });
  register_frames(workloads);
  Reporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  const bench::Table table = reporter.table(workloads);
  std::printf("\n%s", bench::plain(table, 1).c_str());
  if (!markdown.empty())
    bench::write_file(markdown, bench::machine_line() + bench::markdown(table));
  benchmark::Shutdown();
  if (!smoke) return 0;
  // A smoke run must have rendered its content.
  const bool each_right = std::all_of(workloads.begin(), workloads.end(), [&](const Workload& row) {
    return reporter.drew_all_of(row) == (row.detail == protocol::Detail::full);
  });
  return table.size() == 1 + workloads.size() && each_right ? 0 : 1;
}

}  // namespace
}  // namespace windsplat

int main(int argc, char** argv) { return windsplat::run(argc, argv); }
