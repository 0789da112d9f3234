// Whole frames of the climate sample, engine against naive renderer in one run: times and a table
// of ratios on stdout, and JSON with machine, compiler and target where asked for:
//
//   bench_frame [--benchmark_out=FILE] [--benchmark_filter=REGEX]
#include <benchmark/benchmark.h>

#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/data/store.hpp"
#include "server/engine/kernels/dispatch.hpp"
#include "server/engine/render.hpp"
#include "server/scene/build.hpp"
#include "tests/numerics/naive_renderer.hpp"

namespace windsplat {
namespace {

// Everything visible is drawn: every wind above a thousandth of the range has its line, as in the
// paper's figures, whatever the view's default would leave out for clarity.
struct Workload {
  const char* name;
  const char* preset;
  int width;
  int height;
  bool every_line;
  scene::Method method = scene::Method::kernel;  // as moving frames are drawn
};

constexpr Workload workloads[] = {
    {"winds 640x480", "winds", 640, 480, true},
    {"winds+clouds 640x480", "default", 640, 480, true},
    {"winds 1280x720", "winds", 1280, 720, true},
    {"winds+clouds 1280x720", "default", 1280, 720, true},
    {"default view 640x480", "default", 640, 480, false},
    {"clouds 640x480", "clouds", 640, 480, false},
    {"winds+clouds by slab", "default", 640, 480, true, scene::Method::slab},
    {"default view by slab", "default", 640, 480, false, scene::Method::slab},
};

[[noreturn]] void give_up(const Error& error) {
  std::fprintf(stderr, "bench_frame: %s\n", error.message.c_str());
  std::exit(1);  // NOLINT(concurrency-mt-unsafe)
}

template <class T>
T value_or_give_up(Result<T> result) {
  if (!result) give_up(result.error());
  return std::move(*result);
}

data::Dataset& climate() {
  static data::Dataset dataset(value_or_give_up(data::open_sample("climate")), "climate",
                               std::uint64_t{4} << 30U);
  return dataset;
}

scene::Scene make_scene(const Workload& workload) {
  data::Dataset& dataset = climate();
  protocol::View view = value_or_give_up(scene::default_view(dataset));
  view.image.width = workload.width;
  view.image.height = workload.height;
  const auto placed = value_or_give_up(scene::place_dataset(view.geometry, dataset));
  const scene::Lattice& lattice = placed->lattice;
  if (auto applied = scene::apply_preset(view, lattice, workload.preset); !applied) {
    give_up(applied.error());
  }
  scene::orbit(view, lattice, 20, 35, 1);
  scene::Scene scene = value_or_give_up(scene::build_scene(view, dataset));
  scene.method = workload.method;
  if (workload.every_line && scene.vector) {
    scene.vector->min_magnitude = 1e-3 * scene.vector->magnitude_range[1];
  }
  return scene;
}

void count_work(benchmark::State& state, const engine::WorkReport& work) {
  state.counters["samples"] = static_cast<double>(work.samples);
  state.counters["pixel_updates"] = static_cast<double>(work.pixel_updates);
  state.counters["exponentials"] = static_cast<double>(work.exponentials);
}

void engine_frame(benchmark::State& state, const Workload& workload, unsigned threads) {
  const scene::Scene scene = make_scene(workload);
  ThreadPool pool(threads);
  const CancelToken cancel;
  engine::WorkReport work;
  while (state.KeepRunning()) {
    auto rendered = value_or_give_up(engine::render(scene, pool, cancel));
    benchmark::DoNotOptimize(rendered.image.rgba.data());
    work = rendered.work;
  }
  count_work(state, work);
}

void naive_frame(benchmark::State& state, const Workload& workload) {
  const scene::Scene scene = make_scene(workload);
  while (state.KeepRunning()) {
    auto picture = naive::render<float>(scene);
    benchmark::DoNotOptimize(picture.rgba.data());
  }
}

// Console output as ever, and the medians for the table.
class Reporter : public benchmark::ConsoleReporter {
 public:
  Reporter() : ConsoleReporter(OO_Tabular) {}
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.aggregate_name == "median") {
        medians_[run.run_name.function_name] = {run.GetAdjustedRealTime(),
                                                run.GetAdjustedCPUTime()};
      }
    }
    ConsoleReporter::ReportRuns(runs);
  }

  // Wall times; the ratio to the naive renderer by processor time, which other programs on the
  // machine disturb less.
  void print_table() const {
    std::printf("\n%-24s %10s %10s %10s %9s %9s\n", "frame, ms", "naive", "1 thread", "2 threads",
                "naive/1", "1/2");
    for (const Workload& workload : workloads) {
      const std::string name = workload.name;
      const auto naive = medians_.find(name + " naive");
      const auto one = medians_.find(name + " 1 thread");
      const auto two = medians_.find(name + " 2 threads");
      if (naive == medians_.end() || one == medians_.end() || two == medians_.end()) continue;
      std::printf("%-24s %10.1f %10.1f %10.1f %8.1fx %8.2fx\n", workload.name, naive->second.wall,
                  one->second.wall, two->second.wall,
                  naive->second.processor / one->second.processor,
                  one->second.wall / two->second.wall);
    }
  }

 private:
  struct Times {
    double wall;
    double processor;
  };
  std::map<std::string, Times> medians_;
};

void register_frames() {
  const auto settle = [](benchmark::internal::Benchmark* frame, int repetitions, int iterations) {
    frame->Unit(benchmark::kMillisecond)
        ->UseRealTime()
        ->Iterations(iterations)
        ->Repetitions(repetitions)
        ->ReportAggregatesOnly(true);
  };
  for (const Workload& workload : workloads) {
    const std::string name = workload.name;
    settle(benchmark::RegisterBenchmark(
               (name + " naive").c_str(),
               [&workload](benchmark::State& state) { naive_frame(state, workload); }),
           3, 1);
    for (const unsigned threads : {1U, 2U}) {
      const std::string label = name + (threads == 1 ? " 1 thread" : " 2 threads");
      settle(benchmark::RegisterBenchmark(label.c_str(),
                                          [&workload, threads](benchmark::State& state) {
                                            engine_frame(state, workload, threads);
                                          }),
             9, 3);
    }
  }
}

int run(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  const auto target = value_or_give_up(engine::kernels::chosen_table());
  benchmark::AddCustomContext("target", target->name);
  benchmark::AddCustomContext("compiler", __VERSION__);
  register_frames();
  Reporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  reporter.print_table();
  benchmark::Shutdown();
  return 0;
}

}  // namespace
}  // namespace windsplat

int main(int argc, char** argv) { return windsplat::run(argc, argv); }
