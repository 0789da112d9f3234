// Draws each view at some settings and prints the times beside the forecasts.
#include "tests/bench/scenes/time_estimates.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <string>

#include "server/base/thread_pool.hpp"
#include "server/engine/render.hpp"
#include "server/frame/frame.hpp"
#include "server/frame/measure.hpp"
#include "server/quality/laws.hpp"
#include "server/quality/table.hpp"
#include "server/scene/build.hpp"
#include "tests/bench/scenes/scene_set.hpp"
#include "tests/bench/support.hpp"
#include "tests/numerics/family/family.hpp"

namespace windsplat::bench {
namespace {

constexpr unsigned threads = 2;

double processor_ms() {
  timespec at{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &at);
  return 1e3 * static_cast<double>(at.tv_sec) + 1e-6 * static_cast<double>(at.tv_nsec);
}

double measured_ms(const scene::Scene& scene, ThreadPool& pool, engine::RenderSpace& space,
                   engine::WorkReport& work) {
  double best = 0;
  for (int run = 0; run < 3; ++run) {
    const double start = processor_ms();
    work = value_or_give_up(engine::render(scene, pool, CancelToken(), space));
    const double ms = (processor_ms() - start) / threads;
    if (run > 0) best = run == 1 ? ms : std::min(best, ms);
  }
  return best;
}

double samples_of(const std::array<int, 3>& dims) {
  return static_cast<double>(dims[0]) * dims[1] * dims[2];
}

void list_view(const std::string& name, const scene::CompletedView& completed,
               data::Dataset& dataset, ThreadPool& pool, engine::RenderSpace& space) {
  const quality::Kind kind = quality::signature_of(completed.view()).kind;
  value_or_give_up(scene::build_scene(completed, dataset));  // resident
  const quality::Viewpoint viewpoint = frame::viewpoint_of(completed, dataset);
  for (const std::size_t i : {0U, 2U, 4U, 6U, 8U, 10U, 15U, 18U, 20U, 21U, 22U, 24U}) {
    const quality::Setting& setting = quality::settings[i];
    if (!quality::is_allowed(setting, completed.view())) continue;
    const auto drawn = value_or_give_up(frame::at_setting(completed, setting));
    const scene::Scene scene = value_or_give_up(scene::build_scene(drawn, dataset));
    engine::WorkReport work;
    const double ms = measured_ms(scene, pool, space, work);
    const quality::Content content = viewpoint.content.value_or(quality::Content());
    std::printf(
        "%s,%d,%d,%d,%d,%zu,%.3f,%.3f,%.4g,%.4g,%.4g,%.4g,%.4g,%.4g,%.4g,%.4g,%.4g,%lld,%lld\n",
        name.c_str(), kind.lines, kind.medium, viewpoint.width, viewpoint.pixels_high, i, ms,
        quality::expected_ms(kind, setting, viewpoint).value, samples_of(completed.lattice().dims),
        samples_of(scene.lattice.dims), viewpoint.detail, content.lines, content.layers,
        content.length, content.depth, content.cell, content.finest_cell,
        static_cast<long long>(work.pixel_updates),
        static_cast<long long>(scene.camera.width) * scene.camera.height);
    std::fflush(stdout);
  }
}

}  // namespace

void list_times(int side) {
  ThreadPool pool(threads);
  engine::RenderSpace space;
  for (const GeneratedScene& scene : generated_scenes(side)) {
    const auto dataset = scene.open(1);
    for (const Content content : scene.contents) {
      for (const Size size : {Size{640, 360}, Size{1280, 720}}) {
        const auto completed =
            completed_view_of(scene, *dataset, content, size, protocol::MethodName::slab,
                              protocol::Detail::automatic);
        list_view(scene.name, completed, *dataset, pool, space);
      }
    }
  }
}

void list_family_times(int scenes, int viewpoints) {
  ThreadPool pool(threads);
  engine::RenderSpace space;
  std::uint32_t number = 0;
  auto members = test::family();
  for (auto& stranger : test::strangers()) members.push_back(std::move(stranger));
  for (const auto& member : members) {
    const auto dataset = test::formula_dataset(member.field, member.formula);
    for (int s = 0; s < scenes; ++s, ++number) {
      for (int v = 0; v < viewpoints; ++v) {
        const auto completed = value_or_give_up(scene::complete(
            test::random_view(*dataset, 3 * number + static_cast<std::uint32_t>(s) % 3,
                              static_cast<std::uint32_t>(v), 1280),
            *dataset));
        list_view(member.field.name, completed, *dataset, pool, space);
      }
    }
  }
}

}  // namespace windsplat::bench
