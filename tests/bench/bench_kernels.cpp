// The kernels of every target that this processor supports, one at a time on one thread:
// nanoseconds and time-stamp ticks per item, and a table of targets compared with portable on
// stdout:
//
//   bench_kernels [--markdown=FILE] [--benchmark_out=FILE] [--benchmark_filter=REGEX]
#include <benchmark/benchmark.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "server/engine/bins.hpp"
#include "server/engine/kernels/dispatch.hpp"
#include "server/engine/plan.hpp"
#include "server/engine/tiles.hpp"
#include "tests/bench/support.hpp"
#include "tests/bench/text_table.hpp"

#if defined(__x86_64__)
#include <x86intrin.h>
#endif

namespace windsplat {
namespace {

using bench::Workload;
using engine::kernels::Table;

// Ticks of the time-stamp counter per nanosecond; 0 without a counter.
double ticks_per_ns() {
#if defined(__x86_64__)
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  const std::uint64_t ticks = __rdtsc();
  while (Clock::now() - start < std::chrono::milliseconds(20)) {
  }
  const std::chrono::duration<double, std::nano> passed = Clock::now() - start;
  return static_cast<double>(__rdtsc() - ticks) / passed.count();
#else
  return 0;
#endif
}

// Runs `body`, which returns its number of items, until the benchmark has enough samples. Processor
// time.
template <class Body>
void time_items(benchmark::State& state, const Body& body) {
  double items = 0;
  while (state.KeepRunning()) items += static_cast<double>(body());
  state.counters["s_item"] =
      benchmark::Counter(items, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  state.counters["items"] = items / static_cast<double>(state.iterations());
}

// Optical depths typical of frames: many thin, some thick.
void attenuate(benchmark::State& state, const Table& table) {
  constexpr int count = 4096;
  std::vector<float> tau, absorbed(count), transmitted(count);
  for (int i = 0; i < count; ++i) {
    tau.push_back(static_cast<float>(std::pow(10.0, -5 + 6.0 * i / count)));
  }
  time_items(state, [&] {
    table.attenuate(count, tau.data(), absorbed.data(), transmitted.data());
    benchmark::DoNotOptimize(absorbed.data());
    benchmark::DoNotOptimize(transmitted.data());
    benchmark::ClobberMemory();
    return count;
  });
}

void jitter(benchmark::State& state, const Table& table) {
  constexpr int side = 64;
  time_items(state, [&] {
    std::array<float, 6> six{};
    for (int j = 0; j < side; ++j) {
      for (int i = 0; i < side; ++i) {
        table.jitter(1, 0, i, j, 3, six.data());
        benchmark::DoNotOptimize(six.data());
        benchmark::ClobberMemory();
      }
    }
    return side * side;
  });
}

// A scene prepared up to its tiles.
struct Ready {
  Ready(const Workload& workload, const Table& table) : scene(bench::scene_of(workload)), pool(1) {
    engine::make_plan(scene, plan);
    bins = &engine::make_bins(plan, table, pool, CancelToken(), bin_space, work);
  }
  scene::Scene scene;
  engine::RenderPlan plan;
  ThreadPool pool;
  engine::WorkReport work;
  engine::BinSpace bin_space;
  engine::TileSpace tile_space;
  const engine::Bins* bins = nullptr;  // in bin_space
};

// Per kernel position of the visible bricks.
void summarise(benchmark::State& state, const Table& table, const Workload& workload) {
  const Ready ready(workload, table);
  // Typical pixels per world unit.
  const auto scale = static_cast<float>(workload.height);
  time_items(state, [&] {
    std::int64_t stops = 0;
    for (const auto& brick : ready.bins->bricks) {
      engine::kernels::BrickSummary summary{};
      table.summarise(ready.plan.passes[brick.pass].kernel, brick, scale, summary);
      benchmark::DoNotOptimize(summary);
      stops += std::int64_t{brick.u_count} * brick.v_count;
    }
    return stops;
  });
}

// Bricks culled, summarised and listed: per kernel position of the scene.
void bin(benchmark::State& state, const Table& table, const Workload& workload) {
  Ready ready(workload, table);
  time_items(state, [&] {
    engine::WorkReport work;
    const auto& bins =
        engine::make_bins(ready.plan, table, ready.pool, CancelToken(), ready.bin_space, work);
    benchmark::DoNotOptimize(bins.entries.data());
    return work.samples;
  });
}

// All work of tiles, per kernel position of the scene.
void draw(benchmark::State& state, const Table& table, const Workload& workload) {
  Ready ready(workload, table);
  engine::Image image{workload.width, workload.height, {}};
  engine::WorkReport work;
  time_items(state, [&] {
    image.rgba.assign(4 * static_cast<std::size_t>(image.width) * image.height, 0.0F);
    work = ready.work;
    engine::draw_tiles(ready.plan, *ready.bins, nullptr, table, ready.pool, CancelToken(),
                       ready.tile_space, engine::sink_into(image), work);
    benchmark::DoNotOptimize(image.rgba.data());
    return work.samples;
  });
  state.counters["pixel_updates"] = static_cast<double>(work.pixel_updates);
  state.counters["exponentials"] = static_cast<double>(work.exponentials);
}

struct Case {
  std::string name;
  std::function<void(benchmark::State&, const Table&)> body;
};

std::vector<Case> cases(bool smoke) {
  using protocol::MethodName;
  std::vector<Case> out{{"attenuate, per value", attenuate},
                        {"jitter, per kernel position", jitter}};
  const auto add = [&](const char* name, const auto& body, const char* preset, MethodName method) {
    Workload workload;
    workload.preset = preset;
    workload.method = method;
    if (smoke) {
      workload.sample.dims = {32, 16, 8};
      workload.width = workload.height = 64;
    }
    out.push_back({name, [body, workload](benchmark::State& state, const Table& table) {
                     body(state, table, workload);
                   }});
  };
  add("summarise winds+clouds, per kernel position", summarise, "default", MethodName::kernel);
  add("bin winds+clouds, per kernel position", bin, "default", MethodName::kernel);
  add("draw winds, per kernel position", draw, "winds", MethodName::kernel);
  add("draw clouds, per kernel position", draw, "clouds", MethodName::kernel);
  add("draw winds+clouds, per kernel position", draw, "default", MethodName::kernel);
  add("draw winds+clouds by slab, per kernel position", draw, "default", MethodName::slab);
  return out;
}

// Normal console output, and nanoseconds per item of each target for the table.
class Reporter : public benchmark::ConsoleReporter {
 public:
  Reporter() : ConsoleReporter(OO_Tabular) {}
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      const bool median = run.aggregate_name == "median";
      if (!median && !run.aggregate_name.empty()) continue;
      items_[run.run_name.function_name] = 1e9 * run.counters.at("s_item").value;
    }
    ConsoleReporter::ReportRuns(runs);
  }

  [[nodiscard]] bench::Table table(const std::vector<Case>& all,
                                   const std::vector<const Table*>& targets) const {
    bench::Row head{"kernel, ns (time-stamp ticks)"};
    for (const Table* target : targets) head.emplace_back(target->name);
    for (const Table* target : targets) {
      if (target != targets.front()) head.push_back("portable/" + std::string(target->name));
    }
    bench::Table out{head};
    for (const Case& one : all) {
      bench::Row row{one.name};
      bench::Row ratios;
      double first = 0;
      for (const Table* target : targets) {
        const auto found = items_.find(std::string(target->name) + ": " + one.name);
        if (found == items_.end()) break;
        const double ns = found->second;
        row.push_back(bench::number("%.2f", ns) + bench::number(" (%.1f)", ns * ticks_per_ns_));
        if (target == targets.front()) {
          first = ns;
        } else {
          ratios.push_back(bench::number("%.2fx", first / ns));
        }
      }
      row.insert(row.end(), ratios.begin(), ratios.end());
      if (row.size() == head.size()) out.push_back(row);
    }
    return out;
  }

 private:
  double ticks_per_ns_ = ticks_per_ns();
  std::map<std::string, double> items_;  // ns
};

int run(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  const bool smoke = !bench::take_option(argc, argv, "--smoke").empty();
  const std::string markdown = bench::take_option(argc, argv, "--markdown");
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  bench::add_context();
  const std::vector<Case> all = cases(smoke);
  const std::vector<const Table*> targets = engine::kernels::usable_tables();
  for (const Case& one : all) {
    for (const Table* target : targets) {
      const std::string name = std::string(target->name) + ": " + one.name;
      auto* registered = benchmark::RegisterBenchmark(
          name.c_str(), [&one, target](benchmark::State& state) { one.body(state, *target); });
      registered->Unit(benchmark::kMicrosecond)->MinTime(smoke ? 1e-3 : 0.1);
      if (!smoke) registered->Repetitions(5)->ReportAggregatesOnly(true);
    }
  }
  Reporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  const bench::Table table = reporter.table(all, targets);
  std::printf("\n%s", bench::plain(table, 1).c_str());
  if (!markdown.empty())
    bench::write_file(markdown, bench::machine_line() + bench::markdown(table));
  benchmark::Shutdown();
  return smoke && table.size() != 1 + all.size() ? 1 : 0;
}

}  // namespace
}  // namespace windsplat

int main(int argc, char** argv) { return windsplat::run(argc, argv); }
