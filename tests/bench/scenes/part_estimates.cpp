// Draws each view with and without a part, by one thread.
#include "tests/bench/scenes/part_estimates.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/base/thread_pool.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/data/samples/samples.hpp"
#include "server/engine/render.hpp"
#include "server/frame/cost.hpp"
#include "server/ground/atlas.hpp"
#include "server/scene/build.hpp"
#include "server/scene/completed_view.hpp"
#include "tests/bench/support.hpp"
#include "tests/numerics/family/family.hpp"

namespace windsplat::bench {
namespace {

using protocol::View;
using Change = std::function<void(View&)>;

constexpr double ns_a_kernel = 6;

struct Part {
  const char* name;
  Change add;
};

struct Opened {
  std::string name;
  std::unique_ptr<data::Dataset> dataset;
};

Opened sample_of_size(const std::string& name, const std::array<int, 3>& dims) {
  return {name, std::make_unique<data::Dataset>(value_or_give_up(data::open_sample(name, dims)),
                                                name, std::uint64_t{4} << 30U)};
}

void add_members(std::vector<test::FamilyMember> members, std::size_t first, std::size_t every,
                 std::vector<Opened>& to) {
  for (std::size_t n = first; n < members.size(); n += every) {
    to.push_back(
        {members[n].field.name, test::formula_dataset(members[n].field, members[n].formula)});
  }
}

std::vector<Opened> datasets(bool judged) {
  std::vector<Opened> out;
  if (judged) {
    out.push_back(sample_of_size("climate", {480, 240, 12}));
    out.push_back(sample_of_size("tornado", {160, 64, 48}));
    out.push_back(sample_of_size("efield", {80, 80, 40}));
    add_members(test::strangers(), 0, 1, out);
    add_members(test::family(), 1, 6, out);
  } else {
    out.push_back(sample_of_size("climate", {240, 120, 19}));
    out.push_back(sample_of_size("tornado", {96, 96, 96}));
    add_members(test::family(), 0, 6, out);
  }
  return out;
}

// What the scene computes for a view is kept by its dataset: views with different shifts compute it
// anew.
double shift_of(int view) { return 0.003 * view; }

protocol::SurfaceView isosurface(const protocol::ScalarView& of, double share, double opacity) {
  const auto [low, high] = *of.color.range;
  protocol::SurfaceView shown;
  shown.field = of.field;
  shown.isovalue = low + share * (high - low);
  shown.opacity = opacity;
  return shown;
}

protocol::SurfaceView section(const protocol::ScalarView& of, double shift, bool judged) {
  protocol::SurfaceView shown;
  shown.field = of.field;
  shown.plane = protocol::PlaneView{
      {shift, 0, 0}, judged ? protocol::Vec3{-0.6, 0.3, 0.5} : protocol::Vec3{0.3, 1, 0.2}};
  return shown;
}

void light(View& view, double shift) {
  view.light.emplace();
  view.light->azimuth += 100 * shift;
}

// By the number of the view; surfaces of the medium of the view.
std::vector<Part> parts_of(const View& base, bool judged, int number) {
  const double shift = shift_of(number);
  std::vector<Part> out;
  out.push_back({"ground", [](View& view) { view.ground.show = protocol::GroundShow::on; }});
  if (base.scalars->empty()) return out;
  const protocol::ScalarView& of = base.scalars->front();
  out.push_back({"isosurface", [=](View& view) {
                   view.surfaces = {isosurface(of, (judged ? 0.35 : 0.5) + shift, 1)};
                 }});
  out.push_back({"two translucent isosurfaces", [=](View& view) {
                   view.surfaces = {isosurface(of, (judged ? 0.25 : 0.4) + shift, 0.4),
                                    isosurface(of, (judged ? 0.7 : 0.6) + shift, 0.4)};
                 }});
  out.push_back({"section", [=](View& view) { view.surfaces = {section(of, shift, judged)}; }});
  out.push_back({"section with contours", [=](View& view) {
                   view.surfaces = {section(of, shift + 0.1, judged)};
                   view.surfaces[0].contours.emplace();
                   const auto [low, high] = *of.color.range;
                   view.surfaces[0].contours->interval = 0.1 * (high - low);
                 }});
  out.push_back({"light", [=](View& view) { light(view, shift); }});
  out.push_back({"light on an isosurface", [=](View& view) {
                   view.surfaces = {isosurface(of, (judged ? 0.3 : 0.55) + shift, 1)};
                   light(view, shift + 0.2);
                 }});
  return out;
}

double now_ms() {
  timespec at{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &at);
  return 1e3 * static_cast<double>(at.tv_sec) + 1e-6 * static_cast<double>(at.tv_nsec);
}

struct Timed {
  double ms = 0;
  double kernels = 0;
  std::size_t triangles = 0;
  std::size_t samples = 0;
};

Timed timed(const View& asked, data::Dataset& dataset, ThreadPool& pool) {
  Timed out;
  const auto completed = value_or_give_up(scene::complete(asked, dataset));
  const auto outline = value_or_give_up(scene::outline(asked, dataset));
  out.kernels = frame::cost_of(outline, dataset).kernels;
  engine::RenderSpace space;
  const double start = now_ms();
  const scene::Scene scene = value_or_give_up(scene::build_scene(completed, dataset));
  value_or_give_up(engine::render(scene, pool, CancelToken(), space));
  out.ms = now_ms() - start;
  for (const surface::Shown& shown : scene.surfaces) out.triangles += shown.mesh->triangles.size();
  const auto& dims = completed.lattice().dims;
  out.samples = static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]) *
                static_cast<std::size_t>(dims[2]);
  return out;
}

Timed median_of(const std::function<Timed(int)>& draw, int first) {
  std::vector<Timed> drawn;
  for (int n = first; n < first + 3; ++n) drawn.push_back(draw(n));
  std::sort(drawn.begin(), drawn.end(), [](const Timed& a, const Timed& b) { return a.ms < b.ms; });
  return drawn[1];
}

// first: number of the first view of the dataset.
void list_parts_of(const std::string& name, View base, bool judged, int first,
                   data::Dataset& dataset, ThreadPool& pool) {
  base = value_or_give_up(scene::complete(base, dataset)).view();
  const auto draw_plain = [&](int) { return timed(base, dataset, pool); };
  draw_plain(0);  // its fields become resident
  const std::vector<Part> parts = parts_of(base, judged, first);
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const Timed without = median_of(draw_plain, 0);
    const Timed with = median_of(
        [&](int number) {
          View view = base;
          parts_of(base, judged, number)[p].add(view);
          return timed(view, dataset, pool);
        },
        first);
    const double forecast = ns_a_kernel * 1e-6 * (with.kernels - without.kernels);
    std::printf("%s,%s,%s,%d,%.3f,%.3f,%.5g,%.5g,%zu,%zu,%.3f\n", name.c_str(), parts[p].name,
                base.geometry.mapping == protocol::GeometryMapping::sphere ? "globe" : "flat",
                base.image.width, with.ms, without.ms, with.kernels, without.kernels,
                with.triangles, with.samples, forecast / (with.ms - without.ms));
    std::fflush(stdout);
  }
}

}  // namespace

void list_parts(bool judged) {
  std::printf(
      "dataset,part,mapping,width,ms,ms without,kernels,kernels without,triangles,samples,"
      "forecast / measured\n");
  ThreadPool pool(1);
  for (std::size_t level = 0; level < ground::levels; ++level) ground::atlas(level);
  for (Opened& opened : datasets(judged)) {
    data::Dataset& dataset = *opened.dataset;
    int first = 0;
    for (const int width : judged ? std::vector{960} : std::vector{640, 1280}) {
      View base;
      base.image.width = width;
      base.image.height = width * 9 / 16;
      base.ground.show = protocol::GroundShow::off;
      base.method.detail = protocol::Detail::full;
      list_parts_of(opened.name, base, judged, first, dataset, pool);
      if (opened.name == "climate") {
        base.geometry.mapping = protocol::GeometryMapping::sphere;
        list_parts_of(opened.name, base, judged, first, dataset, pool);
      }
      first += 3;
    }
  }
}

}  // namespace windsplat::bench
