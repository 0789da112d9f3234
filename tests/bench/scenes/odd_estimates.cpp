// Generated data -> views of unusual sizes, eyes and lattices -> ratios of estimates and errors.
#include "tests/bench/scenes/odd_estimates.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/base/thread_pool.hpp"
#include "server/frame/measure.hpp"
#include "server/quality/laws.hpp"
#include "server/quality/table.hpp"
#include "server/scene/build.hpp"
#include "tests/bench/support.hpp"
#include "tests/numerics/family/family.hpp"

namespace windsplat::bench {
namespace {

using test::FamilyMember;
using test::Point;
using test::Values;
using Index = std::array<int, 3>;

constexpr double circle = 6.283185307179586;

// Crossing waves of flow and cloud.
Values ripples(const Point& at, const Index&) {
  const double a = std::sin(circle * (2.3 * at[0] + 1.1 * at[1]) + 0.4);
  const double b = std::cos(circle * (1.7 * at[1] - 1.3 * at[2]) + 3 * at[0]);
  const double c = std::sin(circle * (2.1 * at[2] + 0.8 * at[0]) - 1.2);
  return {{12 * a, 9 * b, 6 * c}, std::clamp(0.35 * (a * b + b * c + 1), 0.0, 1.0)};
}

// A cloud whose surface is a step, in a flow that turns along its height.
Values step_cloud(const Point& at, const Index&) {
  const double height = 0.5 + 0.2 * std::sin(circle * at[0]) * std::cos(circle * 1.5 * at[1]);
  const double turn = 2 * circle * at[2] + at[0];
  return {{9 * std::cos(turn), 9 * std::sin(turn), 1.5}, at[2] < height ? 1.0 : 0.0};
}

// A fog that varies by a tenth.
Values fog(const Point& at, const Index&) {
  const double wave = std::sin(circle * at[0]) + std::cos(circle * (at[1] + at[2]));
  return {{7, 2 + at[0], 1}, 0.6 + 0.03 * wave};
}

// Lumps at random in still air.
Values lumps(const Point& at, const Index&) {
  const double near = test::noise(at, 5, 7711);
  const double lump = std::clamp(2.5 * near, 0.0, 1.0);
  return {{10 * test::noise(at, 4, 7712), 10 * test::noise(at, 4, 7713), 5 * near}, lump};
}

struct OddView {
  std::string kind;
  protocol::View view;
};

void give_errors(const std::string& name, const scene::CompletedView& completed,
                 data::Dataset& dataset, ThreadPool& pool, std::vector<double>& ratios) {
  frame::Workspace workspace;
  const quality::Kind kind = quality::signature_of(completed.view()).kind;
  const quality::Table untaught(kind);
  const auto report = [&](const frame::CalibrationSample& one) {
    const quality::Setting& setting = quality::settings[one.setting];
    const double error = *one.measured.error;
    const double estimate = untaught.forecast(one.setting, one.viewpoint).error;
    constexpr double judged_above = 1e-4;
    const bool judged = error > judged_above || estimate > 2 * judged_above;
    if (judged) ratios.push_back(estimate / error);
    std::printf("%s,%s,%d,%d,%d,%d,%d,%.4g,%.4g,%.4g,%.3f%s\n", name.c_str(),
                kind.lines ? kind.medium ? "both" : "lines" : "medium",
                static_cast<int>(quality::cause_of(setting, one.viewpoint)),
                setting.method == protocol::MethodName::slab ? 1 : 0, setting.half_level,
                setting.coarser, setting.thinner, one.viewpoint.detail, error, estimate,
                estimate / error, judged ? "" : ",small");
  };
  const auto done = frame::calibrate(completed, dataset, pool, {}, workspace, report);
  if (!done) give_up(name + ": " + done.error().message);
}

void print_share(const std::string& name, std::vector<double> ratios) {
  if (ratios.empty()) return;
  std::sort(ratios.begin(), ratios.end());
  const auto count = static_cast<double>(ratios.size());
  const auto share = [&](double low, double high) {
    const auto within = std::count_if(ratios.begin(), ratios.end(),
                                      [&](double r) { return r >= low && r <= high; });
    return 100 * static_cast<double>(within) / count;
  };
  std::printf("| %s | %zu | %.1f %% | %.1f | %.3f | %.3f | %.3f |\n", name.c_str(), ratios.size(),
              share(0.5, 2), 10 * share(0, 0.25), ratios.front(), ratios[ratios.size() / 2],
              ratios.back());
}

class Listing {
 public:
  explicit Listing(int scenes) : scenes_(static_cast<std::uint32_t>(scenes)) {}
  // Views of one kind, in some scenes of each member: lines, a medium and both in turn.
  template <class Change>
  void list(const std::string& name, const std::vector<FamilyMember>& members,
            const Change& change) {
    std::vector<double> ratios;
    for (std::size_t m = 0; m < members.size(); ++m) {
      const auto dataset = test::formula_dataset(members[m].field, members[m].formula);
      for (std::uint32_t s = 0; s < scenes_; ++s) {
        const auto number = 3 * (7000 + 100 * static_cast<std::uint32_t>(m) + s) + s % 3;
        protocol::View view = test::random_view(*dataset, number, s, 320);
        view.quality.max_error = 1;  // so that slabs are allowed
        change(view, *dataset, s);
        const auto completed = value_or_give_up(scene::complete(view, *dataset));
        give_errors(name + ',' + members[m].field.name + ',' + std::to_string(s), completed,
                    *dataset, pool_, ratios);
      }
    }
    results_.emplace_back(name, std::move(ratios));
  }
  void print() const {
    std::printf(
        "\n| views | compared | within a factor of 2 | below a quarter, of 1000 | least | "
        "median | greatest |\n|---|---|---|---|---|---|---|\n");
    for (const auto& [name, ratios] : results_) print_share(name, ratios);
  }

 private:
  std::uint32_t scenes_;
  ThreadPool pool_{2};
  std::vector<std::pair<std::string, std::vector<double>>> results_;
};

// The eye half a cell inside or a quarter of a cell beyond a face, looking outward, or along it.
void look_from_face(protocol::View& view, data::Dataset& dataset, std::uint32_t number) {
  const auto completed = value_or_give_up(scene::complete(view, dataset));
  const scene::Lattice& lattice = completed.lattice();
  glm::dvec3 eye = 0.5 * (lattice.box_min + lattice.box_max);
  const auto axis = static_cast<glm::length_t>(number / 3 % 3);
  const auto other = (axis + 1) % 3;
  const double cell = lattice.spacing[static_cast<std::size_t>(axis)].front();
  const bool high = number % 2 == 0;
  const double inside = number % 4 < 2 ? 0.5 : -0.1;  // cells, from the last samples
  const auto& places = lattice.positions[static_cast<std::size_t>(axis)];
  eye[axis] = high ? places.back() - inside * cell : places.front() + inside * cell;
  glm::dvec3 to{0, 0, 0};
  to[axis] = (number % 3 == 0 ? 0.05 : 1) * (high ? 1 : -1);
  to[other] = number % 3 == 0 ? 1 : 0.3;
  const glm::dvec3 target = eye + cell * to;
  view.camera.eye = protocol::Vec3{eye.x, eye.y, eye.z};
  view.camera.target = protocol::Vec3{target.x, target.y, target.z};
  view.camera.up = axis == 2 ? protocol::Vec3{1, 0.1, 0} : protocol::Vec3{0, 0, 1};
  view.camera.fov_y = 60;
}

}  // namespace

void list_odd(int scenes) {
  const Point box{1200, 1000, 800};
  const std::vector<FamilyMember> solid{{{"ripples", {26, 22, 18}, box}, ripples},
                                        {{"step cloud", {26, 22, 18}, box}, step_cloud},
                                        {{"fog", {20, 22, 18}, box}, fog},
                                        {{"lumps", {30, 26, 22}, box}, lumps}};
  const std::vector<FamilyMember> thin{
      {{"ripples across x", {1, 30, 24}, {40, 1000, 800}}, ripples},
      {{"lumps across y", {40, 1, 32}, {1200, 30, 1000}}, lumps},
      {{"ripples across z", {36, 30, 1}, box}, ripples},
      {{"fog across z", {40, 40, 1}, box}, fog},
      {{"lumps across z", {96, 90, 1}, {4e3, 4e3, 50}}, lumps}};
  Listing listing(scenes);
  struct Size {
    int width, height;
  };
  for (const Size size :
       {Size{320, 200}, Size{333, 217}, Size{61, 43}, Size{17, 301}, Size{17, 901}, Size{301, 17},
        Size{901, 17}, Size{7, 5}, Size{1, 300}, Size{300, 1}, Size{1, 18}, Size{24, 1}}) {
    const std::string name = std::to_string(size.width) + 'x' + std::to_string(size.height);
    listing.list(name, solid, [&](protocol::View& view, auto&, std::uint32_t) {
      view.image.width = size.width;
      view.image.height = size.height;
    });
  }
  listing.list("eye at a face", solid, look_from_face);
  listing.list("one sample thick", thin, [](auto&, auto&, std::uint32_t) {});
  listing.print();
}

}  // namespace windsplat::bench
