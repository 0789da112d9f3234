// Estimated against measured errors of every setting over a family of generated datasets
// (tests/numerics/family): measure, list features, fit and judge (docs/benchmarks/error.md).
//
//   bench_estimates --measure=FILE [--members=N --scenes=N --views=N]
//   bench_estimates --list=FILE
//   bench_estimates --times=SIDE    forecast and measured times of generated scenes
//   bench_estimates --family-times=N  the same for N members of each kind of generated data
//   bench_estimates --parts=fitted|judged  what grounds, surfaces and light add
//   bench_estimates --odd=SCENES      views of unusual sizes, eyes and lattices
//   bench_estimates                 the time of forecasts
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "server/base/thread_pool.hpp"
#include "server/frame/measure.hpp"
#include "server/quality/laws.hpp"
#include "server/quality/pick.hpp"
#include "server/quality/table.hpp"
#include "server/scene/build.hpp"
#include "server/scene/completed_view.hpp"
#include "tests/bench/scenes/odd_estimates.hpp"
#include "tests/bench/scenes/part_estimates.hpp"
#include "tests/bench/scenes/time_estimates.hpp"
#include "tests/bench/support.hpp"
#include "tests/bench/text_table.hpp"
#include "tests/numerics/family/family.hpp"

namespace windsplat::bench {
namespace {

constexpr int width_most = 640;

// Members of the family, then those that nothing is fitted to.
std::vector<test::FamilyMember> all_members() {
  auto members = test::family();
  for (auto& stranger : test::strangers()) members.push_back(std::move(stranger));
  return members;
}

scene::CompletedView completed_view(data::Dataset& dataset, std::size_t member, int scene,
                                    int viewpoint) {
  // The content of a random view is that of its number modulo 3.
  const auto number =
      static_cast<std::uint32_t>(3 * (100 * static_cast<int>(member) + scene) + scene % 3);
  protocol::View view =
      test::random_view(dataset, number, static_cast<std::uint32_t>(viewpoint), width_most);
  view.quality.max_error = 1;  // so that slabs are allowed
  return value_or_give_up(scene::complete(view, dataset));
}

// One line for each setting of each view: member, scene, viewpoint, setting, error.
void measure(const std::string& path, int members_most, int scenes, int viewpoints) {
  std::ofstream out(path);
  ThreadPool pool(2);
  const CancelToken cancel;
  frame::Workspace workspace;
  const auto members = all_members();
  for (std::size_t m = 0; m < members.size() && static_cast<int>(m) < members_most; ++m) {
    const auto dataset = test::formula_dataset(members[m].field, members[m].formula);
    for (int s = 0; s < scenes; ++s) {
      // The first scenes, one of each content, are seen twice as often.
      const int seen = s < 3 ? 2 * viewpoints : viewpoints;
      for (int v = 0; v < seen; ++v) {
        const auto report = [&](const frame::CalibrationSample& found) {
          out << m << ',' << s << ',' << v << ',' << found.setting << ',' << *found.measured.error
              << '\n';
        };
        const auto done = frame::calibrate(completed_view(*dataset, m, s, v), *dataset, pool,
                                           cancel, workspace, report);
        if (!done) give_up(members[m].field.name + ": " + done.error().message);
      }
    }
    std::fprintf(stderr, "%s\n", members[m].field.name.c_str());
  }
  if (!out.flush()) give_up("cannot write '" + path + "'");
}

struct Row {
  std::size_t setting = 0;
  double error = 0;
};
// By member, scene and viewpoint.
using Measurements = std::map<std::array<int, 3>, std::vector<Row>>;

Measurements read(const std::string& path) {
  std::ifstream in(path);
  Measurements out;
  std::array<int, 3> at{};
  Row row;
  char comma = 0;
  while (in >> at[0] >> comma >> at[1] >> comma >> at[2] >> comma >> row.setting >> comma >>
         row.error) {
    out[at].push_back(row);
  }
  if (out.empty()) give_up("no measurements in '" + path + "'");
  return out;
}

// One line for each measurement: member, scene, viewpoint, setting, error; the estimates without
// measurements, after that of a final frame and after a calibration run, both at the first
// viewpoint of the scene; the 95 % bounds of the first and the last estimate; estimates and bounds
// of a view whose content is unknown, without measurements and after that final frame; cause,
// content, error of tried pixels, features.
void list(const Measurements& measurements) {
  const auto members = all_members();
  std::unique_ptr<data::Dataset> dataset;
  std::array<int, 3> last{-1, -1, -1};
  std::optional<quality::Table> untaught;
  std::optional<quality::Table> after_final;
  std::optional<quality::Table> calibrated;
  for (const auto& [at, rows] : measurements) {
    if (at[0] != last[0]) {
      const auto& member = members[static_cast<std::size_t>(at[0])];
      dataset = test::formula_dataset(member.field, member.formula);
    }
    const auto completed = completed_view(*dataset, static_cast<std::size_t>(at[0]), at[1], at[2]);
    const quality::Kind kind = quality::signature_of(completed.view()).kind;
    value_or_give_up(scene::build_scene(completed, *dataset));  // merged data become resident
    const quality::Viewpoint viewpoint = frame::viewpoint_of(completed, *dataset);
    if (!viewpoint.content) give_up("the content of a view is unknown");
    quality::Viewpoint unknown = viewpoint;
    unknown.content.reset();
    const bool first = at[0] != last[0] || at[1] != last[1];
    last = at;
    if (first) {
      untaught.emplace(kind);
      after_final.emplace(kind);
      calibrated.emplace(kind);
    }
    for (const Row& row : rows) {
      const quality::Setting& setting = quality::settings[row.setting];
      // Lines with a stride stay while the medium is merged, whose law gives the error.
      const bool apart = kind.lines && kind.lines_stride > 1 &&
                         quality::cause_of(setting, viewpoint) == quality::Cause::merged;
      if (apart && setting.coarser > std::ilogb(kind.lines_stride)) continue;
      quality::Kind merged = kind;
      merged.lines = kind.lines && !apart;
      const quality::Forecast before = untaught->forecast(row.setting, viewpoint);
      const quality::Forecast after = calibrated->forecast(row.setting, viewpoint);
      const quality::Forecast typical = untaught->forecast(row.setting, unknown);
      const quality::Forecast moved = after_final->forecast(row.setting, unknown);
      std::printf("%d,%d,%d,%zu,%.4g,%.4g,%.4g,%.4g,%.4g,%.4g,%.4g,%.4g,%.4g,%.4g,%d,%d", at[0],
                  at[1], at[2], row.setting, row.error, before.error,
                  after_final->forecast(row.setting, viewpoint).error, after.error,
                  quality::error_bound(before), quality::error_bound(after), typical.error,
                  quality::error_bound(typical), moved.error, quality::error_bound(moved),
                  static_cast<int>(quality::cause_of(setting, viewpoint)), apart ? 1 : at[1] % 3);
      std::printf(",%.4g", quality::tried_error(kind, setting, viewpoint));
      for (const double feature : quality::features_of(merged, setting, viewpoint)) {
        std::printf(",%.5g", feature);
      }
      std::printf("\n");
    }
    for (const Row& row : rows) {
      if (!first) continue;
      calibrated->add(row.setting, viewpoint, {row.error, {}});
      if (quality::settings[row.setting] == quality::Setting{protocol::MethodName::slab, 0, 0}) {
        after_final->add(row.setting, viewpoint, {row.error, {}});
      }
    }
  }
}

// Time of the forecasts of all settings from a table with as many measurements as it keeps.
void time_forecasts() {
  quality::Table table{quality::Kind()};
  const auto viewpoint_at = [](int degrees) {
    quality::Viewpoint viewpoint;
    const double angle = 0.017453292519943295 * degrees;
    viewpoint.direction = {std::sin(angle), std::cos(angle), 0};
    viewpoint.width = 1280;
    viewpoint.pixels_high = 720;
    viewpoint.content.emplace();
    return viewpoint;
  };
  constexpr auto kept = static_cast<int>(quality::Table::measurements_max);
  for (int n = 0; n < kept; ++n) {
    for (std::size_t i = 0; i < quality::settings_count; ++i) {
      table.add(i, viewpoint_at(15 * n), {1e-3 * (1 + n), 10.0 + n});
    }
  }
  std::vector<double> us;
  double errors = 0;
  for (int n = 0; n < 360; ++n) {
    const auto start = std::chrono::steady_clock::now();
    errors += table.forecasts(viewpoint_at(n)).front().error;
    us.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start)
                     .count());
  }
  std::printf("forecasts of %zu settings from %zu measurements: %.0f us (mean error %.4g)\n",
              quality::settings_count, kept * quality::settings_count, median(us), errors / 360);
}

}  // namespace
}  // namespace windsplat::bench

int main(int argc, char** argv) {
  using namespace windsplat::bench;
  const auto number = [&](const char* name, int otherwise) {
    const std::string text = take_option(argc, argv, name);
    return text.empty() ? otherwise : std::atoi(text.c_str());
  };
  const std::string measured = take_option(argc, argv, "--measure");
  const std::string listed = take_option(argc, argv, "--list");
  if (!measured.empty()) {
    const int members = number("--members", 1000);
    const int scenes = number("--scenes", 9);
    measure(measured, members, scenes, number("--views", 2));
  }
  const int side = number("--times", 0);
  const int family = number("--family-times", 0);
  if (!listed.empty()) list(read(listed));
  if (side > 0) list_times(side);
  if (family > 0) list_family_times(family, 2);
  const std::string parts = take_option(argc, argv, "--parts");
  if (!parts.empty()) {
    list_parts(parts == "judged");
    return 0;
  }
  const int odd = number("--odd", 0);
  if (odd > 0) list_odd(odd);
  if (measured.empty() && listed.empty() && side <= 0 && family <= 0 && odd <= 0) time_forecasts();
  return 0;
}
