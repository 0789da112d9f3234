// Processor time of frames with light over that of the same frames without, alternating in one run,
// and of the factors of the samples:
//
//   bench_light [--rounds=N] [--smoke]
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <string>
#include <vector>

#include "server/base/thread_pool.hpp"
#include "server/engine/render.hpp"
#include "server/scene/build.hpp"
#include "tests/bench/support.hpp"

namespace windsplat {
namespace {

double processor_ms() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

void measure(const bench::Workload& workload, int rounds) {
  data::Dataset& dataset = bench::dataset_of(workload.sample);
  protocol::View view = bench::view_of(workload);
  const scene::Scene plain = bench::value_or_give_up(scene::build_scene(view, dataset));
  view.light.emplace();
  view.light->anisotropy = 0.5;
  const double before = processor_ms();
  const scene::Scene lit = bench::value_or_give_up(scene::build_scene(view, dataset));
  const double made = processor_ms() - before;
  ThreadPool pool(1);
  engine::RenderSpace space;
  const auto time = [&](const scene::Scene& scene) {
    const double from = processor_ms();
    bench::value_or_give_up(engine::render(scene, pool, {}, space));
    return processor_ms() - from;
  };
  time(plain);
  time(lit);
  std::vector<double> unlit_ms;
  std::vector<double> ratios;
  for (int n = 0; n < rounds; ++n) {
    unlit_ms.push_back(time(plain));
    ratios.push_back(time(lit) / unlit_ms.back());
  }
  std::printf("%-28s %8.1f %8.2f %10.1f %12.1f\n", workload.name.c_str(), median(unlit_ms),
              median(ratios), made,
              1e6 * made / static_cast<double>(lit.scalars.front().field->samples()));
}

}  // namespace
}  // namespace windsplat

int main(int argc, char** argv) {
  using namespace windsplat;
  const bool smoke = !bench::take_option(argc, argv, "smoke").empty();
  const std::string asked = bench::take_option(argc, argv, "rounds");
  const int rounds = smoke ? 1 : asked.empty() ? 9 : std::stoi(asked);
  std::puts(bench::machine_line().c_str());
  std::printf("%-28s %8s %8s %10s %12s\n", "frame", "unlit ms", "lit", "made in ms", "ns a sample");
  for (const auto method : {protocol::MethodName::kernel, protocol::MethodName::slab}) {
    for (const char* preset : {"clouds", "default"}) {
      bench::Workload workload;
      workload.preset = preset;
      workload.method = method;
      workload.name = std::string(preset) + (method == protocol::MethodName::slab ? " slab" : "");
      if (smoke) {
        workload.width = 64;
        workload.height = 48;
      }
      measure(workload, rounds);
    }
  }
  return 0;
}
