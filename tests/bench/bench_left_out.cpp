// Features that a scene may omit, and the savings: pairs of frames with and without a feature,
// drawn in turns by one thread, as a table on stdout and optionally as Markdown:
//
//   bench_left_out [--markdown=FILE] [--benchmark_filter=REGEX] [--benchmark_out=FILE]
//   bench_left_out --trials=HEIGHT [--field=NAME] [--smoke]    what tolerances leave out of
//   pictures of generated fields of all samples and of a third of them along each axis (--smoke:
//   these alone)
#include <benchmark/benchmark.h>
#include <malloc.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/annotate/paint/compose.hpp"
#include "server/annotate/paint/overlay.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/data/samples/samples.hpp"
#include "server/engine/kernels/dispatch.hpp"
#include "server/engine/render.hpp"
#include "server/frame/frame.hpp"
#include "server/ground/atlas.hpp"
#include "server/scene/build.hpp"
#include "server/scene/camera.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/place.hpp"
#include "tests/bench/left_out_table.hpp"
#include "tests/bench/scenes/skipped_changes.hpp"
#include "tests/bench/support.hpp"

namespace windsplat {
namespace {

using bench::Half;
using bench::Pair;
using protocol::View;

using Change = std::function<void(View&)>;

// `with` and `without` change the default view of the dataset, winds and clouds, 640 x 480.
struct Feature {
  std::string name;
  std::string dataset;
  Change with;
  Change without;
  bool alike = false;     // the picture should hardly change: the difference is measured
  bool anew = false;      // nothing of a ground is kept between frames
  bool prepared = false;  // the frame is also prepared: what lies over it is laid out
};

[[noreturn]] void give_up(const Error& error) {
  std::fprintf(stderr, "bench_left_out: %s\n", error.message.c_str());
  std::exit(1);  // NOLINT(concurrency-mt-unsafe)
}

template <class T>
T value_or_give_up(Result<T> result) {
  if (!result) give_up(result.error());
  return std::move(*result);
}

data::Dataset& dataset_of(const std::string& name) {
  static std::map<std::string, std::unique_ptr<data::Dataset>> opened;
  auto& dataset = opened[name];
  if (!dataset) {
    dataset = std::make_unique<data::Dataset>(value_or_give_up(data::open_sample(name)), name,
                                              std::uint64_t{4} << 30U);
  }
  return *dataset;
}

void no_medium(View& view) { view.scalars.emplace(); }
void no_lines(View& view) { view.vector.field = {protocol::FieldChoice::Kind::none, ""}; }

Change then(Change first, Change second) {
  return [=](View& view) {
    first(view);
    second(view);
  };
}

Change compositing(protocol::Compositing rule) {
  return [=](View& view) { view.method.compositing = rule; };
}

// Of every sample, whatever the stride of the default view.
Change weakest_line(double of_range) {
  return [=](View& view) {
    view.vector.stride = 1;
    view.vector.min_magnitude = of_range * view.vector.magnitude_range.value()[1];
  };
}

Change thinnest_splat(double optical_depth) {
  return [=](View& view) {
    for (auto& scalar : *view.scalars) scalar.min_optical_depth = optical_depth;
  };
}

Change stop_at(double transmittance) {
  return [=](View& view) { view.method.stop_transmittance = transmittance; };
}

Change denser(double times) {
  return [=](View& view) {
    for (auto& scalar : *view.scalars) {
      for (auto& point : *scalar.extinction) point[1] *= times;
    }
  };
}

Change stride(int samples) {
  return [=](View& view) {
    view.vector.stride = samples;
    for (auto& scalar : *view.scalars) scalar.stride = samples;
  };
}

Change colored_by(const std::string& field) {
  return [=](View& view) {
    view.vector.color.by = protocol::ColorBy::scalar;
    view.vector.color.field = field;
    view.vector.color.range.reset();
  };
}

void with_vorticity(View& view) {
  protocol::ScalarView second;
  second.field = "vorticity";
  view.scalars->push_back(second);
}

void moving(View& view) { view.vector.motion = protocol::MotionMode::phase; }
void sunlit(View& view) { view.light.emplace(); }
void headless(View& view) { view.vector.head_desaturation = 0; }
void no_overlap(View& view) { view.vector.span = 1; }
void flat_on(View& view) { view.camera.projection = protocol::Projection::orthographic; }
void globe(View& view) {
  view.geometry.mapping = protocol::GeometryMapping::sphere;
  view.camera.eye.reset();
  view.camera.target.reset();
  view.camera.height.reset();
}
void grounded(View& view) { view.ground.show = protocol::GroundShow::on; }
void bare_globe(View& view) {
  no_lines(view);
  no_medium(view);
  globe(view);
}
Change isosurface(double opacity) {
  return [=](View& view) {
    protocol::SurfaceView surface;
    surface.field = "cloud";
    surface.isovalue = 0.5;
    surface.opacity = opacity;
    view.surfaces.push_back(surface);
  };
}
void traced(View& view) { view.vector.trace.emplace(); }
void region(View& view) {
  view.region.x = {-15, 40};
  view.region.y = {30, 70};
}
void annotated(View& view) {
  view.annotations.box = view.annotations.axes = view.annotations.north = true;
  view.annotations.scale_bar = view.annotations.legend = true;
  view.annotations.title = view.annotations.step_time = true;
}
void one_layer(View& view) { view.geometry.slice = {protocol::GridAxis::z, 8}; }

// Every wind is rendered except where omitting winds is the feature, as in the figures of the
// paper.
std::vector<Feature> features() {
  using protocol::Compositing;
  const Change all = weakest_line(1e-3);
  return {
      {"medium", "climate", all, then(all, no_medium)},
      {"lines", "climate", all, no_lines},
      {"medium", "tornado", all, then(all, no_medium)},
      {"lines", "tornado", all, no_lines},
      {"heads", "climate", all, then(all, headless)},
      {"motion", "climate", then(all, moving), all},
      {"light", "climate", then(all, sunlit), all},
      {"perspective", "climate", all, then(all, flat_on)},
      {"second exponential: analytic to cd", "climate", all,
       then(all, compositing(Compositing::cd))},
      {"second exponential: analytic to simple", "climate", all,
       then(all, compositing(Compositing::simple))},
      {"second scalar", "tornado", then(all, with_vorticity), all},
      {"colour by a scalar, no medium", "climate", then(then(all, no_medium), colored_by("cloud")),
       then(all, no_medium)},
      {"curved lattice: globe to flat", "climate", then(all, globe), all},
      {"the far side of a globe: opaque", "climate", then(all, globe),
       then(then(all, globe), grounded)},
      {"ground of a flat map", "climate", then(all, grounded), all},
      {"ground of a flat map, painted anew", "climate", then(all, grounded), all, false, true},
      {"ground of a globe alone", "climate", then(bare_globe, grounded), bare_globe},
      {"ground of a globe alone, painted anew", "climate", then(bare_globe, grounded), bare_globe,
       false, true},
      {"an isosurface, opaque", "climate", then(all, isosurface(1)), all},
      {"an isosurface, opacity 0.4", "climate", then(all, isosurface(0.4)), all},
      {"streamlets: to straight lines", "tornado", then(all, traced), all},
      {"samples outside of a region", "climate", all, then(all, region)},
      {"annotations, all", "climate", then(all, annotated), all, false, false, true},
      {"overlap: span 7 to 1", "climate", all, then(all, no_overlap)},
      {"every other sample: stride 2", "climate", all, then(all, stride(2))},
      {"all layers but one: a slice", "climate", all, then(all, one_layer)},
      {"winds below 0.1 % of the range", "climate", weakest_line(0), weakest_line(1e-3), true},
      {"winds below 2 % of the range", "climate", weakest_line(0), weakest_line(0.02), true},
      {"winds below the view's default", "climate", weakest_line(0), stride(1), true},
      {"optical depths below 1e-4", "climate", then(all, thinnest_splat(0)), all, true},
      {"optical depths below 1e-2", "climate", then(all, thinnest_splat(0)),
       then(all, thinnest_splat(1e-2)), true},
      {"samples behind an opacity of 1 - 1.5e-4", "climate", then(all, stop_at(0)), all, true},
      {"the same, clouds 30 times as dense", "climate", then(then(all, stop_at(0)), denser(30)),
       then(all, denser(30)), true},
      {"samples behind an opacity of 1 - 1.5e-4", "tornado", then(all, stop_at(0)), all, true},
  };
}

View make_view(const Feature& feature, const Change& change, protocol::MethodName method) {
  data::Dataset& dataset = dataset_of(feature.dataset);
  View view = value_or_give_up(scene::complete({}, dataset)).view();
  view.image.width = 640;
  view.image.height = 480;
  const auto placed = value_or_give_up(scene::place_dataset(view.geometry, dataset));
  scene::orbit(view, placed->lattice, 20, 35, 1);
  view.method.name = method;
  view.ground.show = protocol::GroundShow::off;
  change(view);
  return value_or_give_up(scene::complete(view, dataset)).view();
}

// Bytes of the heap that are in use.
double heap_bytes() {
  const struct mallinfo2 now = mallinfo2();
  return static_cast<double>(now.uordblks) + static_cast<double>(now.hblkhd);
}

frame::Prepared prepare(const View& view, data::Dataset& dataset) {
  const auto completed = value_or_give_up(scene::complete(view, dataset));
  return value_or_give_up(frame::prepare(completed, frame::own_setting(completed), dataset, {}));
}

// Returns what lies over the picture, if anything does.
std::optional<annotate::Overlay> draw(const frame::Prepared& prepared, ThreadPool& pool,
                                      engine::RenderSpace& space) {
  value_or_give_up(engine::render(prepared.scene, pool, CancelToken(), space));
  if (!prepared.figure) return std::nullopt;
  auto overlay = value_or_give_up(annotate::Overlay::of(*prepared.figure));
  annotate::composite(overlay, pool, space.image().rgba);
  return overlay;
}

// Memory for a view and all that is kept after its second frame, without fields, which are no part
// of the heap, and without the lines of the Earth, 4 MB once.
double held_bytes(const View& view, const std::string& name, ThreadPool& pool) {
  for (std::size_t n = 0; n < ground::levels; ++n) ground::atlas(n);
  const double before = heap_bytes();
  data::Dataset dataset(value_or_give_up(data::open_sample(name)), name, std::uint64_t{4} << 30U);
  const frame::Prepared prepared = prepare(view, dataset);
  engine::RenderSpace space;
  std::optional<annotate::Overlay> overlay;
  for (int n = 0; n < 2; ++n) overlay = draw(prepared, pool, space);
  return heap_bytes() - before;
}

// The report of a frame, with its measured error; the picture is the end of an NPY file.
void draw_once(const View& view, const std::string& name, Half& half) {
  ThreadPool pool(1);
  data::Dataset& dataset = dataset_of(name);
  half.bytes = held_bytes(view, name, pool);
  frame::Encoding encoding;
  encoding.format = frame::Format::npy;
  encoding.measure = true;
  const frame::Frame drawn =
      value_or_give_up(frame::produce(view, dataset, encoding, pool, CancelToken()));
  half.work = drawn.work;
  half.error = drawn.error;
  half.rgba = bench::npy_values(drawn.bytes, drawn.width, drawn.height);
}

// Processor time of one thread, which other programs disturb least. The frame is prepared anew if
// `view` is given.
double time_frame(frame::Prepared& prepared, const View* view, data::Dataset& dataset,
                  ThreadPool& pool, engine::RenderSpace& space) {
  const auto now = [] {
    timespec at{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &at);
    return 1e3 * static_cast<double>(at.tv_sec) + 1e-6 * static_cast<double>(at.tv_nsec);
  };
  const double start = now();
  if (view != nullptr) prepared = prepare(*view, dataset);
  draw(prepared, pool, space);
  benchmark::DoNotOptimize(space.image().rgba.data());
  return now() - start;
}

// With, without, without, with: drift affects both equally.
void run_pair(benchmark::State& state, const Feature& feature, protocol::MethodName method,
              Pair& pair) {
  data::Dataset& dataset = dataset_of(feature.dataset);
  std::array<View, 2> views;
  std::array<Half*, 2> halves{&pair.with, &pair.without};
  for (const std::size_t i : {0U, 1U}) {
    const View view = make_view(feature, i == 0 ? feature.with : feature.without, method);
    draw_once(view, feature.dataset, *halves[i]);
    views[i] = view;
  }
  std::array<frame::Prepared, 2> frames{prepare(views[0], dataset), prepare(views[1], dataset)};
  ThreadPool pool(1);
  std::array<engine::RenderSpace, 2> spaces;
  if (feature.anew) spaces[0].limit_grounds(0);
  std::size_t first = 0;
  while (state.KeepRunning()) {
    std::array<double, 2> ms{};
    for (const std::size_t i : {first, 1 - first}) {
      const View* const anew = feature.prepared ? &views[i] : nullptr;
      ms[i] = time_frame(frames[i], anew, dataset, pool, spaces[i]);
    }
    first = 1 - first;
    pair.with.ms.push_back(ms[0]);
    pair.without.ms.push_back(ms[1]);
    state.SetIterationTime((ms[0] + ms[1]) * 1e-3);
  }
  state.counters["with_ms"] = bench::median(pair.with.ms);
  state.counters["without_ms"] = bench::median(pair.without.ms);
}

void write_markdown(const std::string& path, const std::vector<Pair>& pairs) {
  std::ofstream file(path);
  for (const bench::Table& table : bench::tables(pairs)) file << bench::markdown(table) << '\n';
  if (file.flush()) return;
  std::fprintf(stderr, "bench_left_out: cannot write '%s'\n", path.c_str());
  std::exit(1);  // NOLINT(concurrency-mt-unsafe)
}

int run(int argc, char** argv) {
  constexpr int rounds = 7;
  const std::string trials = bench::take_option(argc, argv, "--trials");
  if (!trials.empty()) {
    const std::string field = bench::take_option(argc, argv, "--field");
    const int height = std::atoi(trials.c_str());  // NOLINT(cert-err34-c): 0 is refused
    const bool smoke = !bench::take_option(argc, argv, "--smoke").empty();
    if (height < 1 || argc > 1) return 2;
    const std::vector<int> reductions = smoke ? std::vector{3} : std::vector{1, 3};
    std::fputs(bench::markdown(bench::skipped_changes(height, field, reductions)).c_str(), stdout);
    return 0;
  }
  benchmark::Initialize(&argc, argv);
  std::string output;
  const std::string option = "--markdown=";
  if (argc == 2 && std::string(argv[1]).rfind(option, 0) == 0) {
    output = std::string(argv[1]).substr(option.size());
    argc = 1;
  }
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  const auto target = value_or_give_up(engine::kernels::chosen_table());
  benchmark::AddCustomContext("target", target->name);
  benchmark::AddCustomContext("compiler", __VERSION__);
  const std::vector<Feature> all = features();
  std::vector<Pair> pairs(2 * all.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Feature& feature = all[i / 2];
    const bool slab = i % 2 == 1;
    pairs[i].feature = feature.dataset == "climate" ? feature.name : feature.name + " (tornado)";
    pairs[i].method = slab ? "slab" : "kernel";
    pairs[i].alike = feature.alike;
    const auto method = slab ? protocol::MethodName::slab : protocol::MethodName::kernel;
    const std::string label = pairs[i].feature + ", " + pairs[i].method;
    benchmark::RegisterBenchmark(label.c_str(),
                                 [&, method, i](benchmark::State& state) {
                                   pairs[i].with.ms.clear();
                                   pairs[i].without.ms.clear();
                                   run_pair(state, feature, method, pairs[i]);
                                 })
        ->Unit(benchmark::kMillisecond)
        ->UseManualTime()
        ->Iterations(rounds);
  }
  benchmark::RunSpecifiedBenchmarks();
  for (const bench::Table& table : bench::tables(pairs)) {
    std::fputs(("\n" + bench::plain(table)).c_str(), stdout);
  }
  if (!output.empty()) write_markdown(output, pairs);
  benchmark::Shutdown();
  return 0;
}

}  // namespace
}  // namespace windsplat

int main(int argc, char** argv) { return windsplat::run(argc, argv); }
