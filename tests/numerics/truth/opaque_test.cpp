// Clouds in which rays end where little light is left: reported errors against the integral.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "server/frame/difference.hpp"
#include "server/frame/frame.hpp"
#include "server/frame/measure.hpp"
#include "server/quality/laws.hpp"
#include "server/quality/setting.hpp"
#include "server/quality/view_traits.hpp"
#include "server/scene/build.hpp"
#include "server/scene/completed_view.hpp"
#include "server/study/truth/integrator.hpp"
#include "tests/numerics/trial_fields.hpp"

namespace windsplat::test {
namespace {

// A cloud that fills its box. Optical depth: along an edge of the box at a value of 1.
struct Cloud {
  std::string name;
  double depth = 1;
  TrialFormula formula;
};

std::vector<Cloud> clouds() {
  const auto smooth = [](const Point& at, const auto&) {
    Values out;
    out.cloud = 0.55 + 0.4 * std::sin(5 * at[0] + 2 * at[1]) * std::cos(4 * at[2] - 3 * at[1]);
    return out;
  };
  const auto rough = [](const Point& at, const auto&) {
    Values out;
    out.cloud = std::clamp(0.6 + 0.5 * turbulence(at, 8, 0.6, 71), 0.05, 1.0);
    return out;
  };
  const auto steps = [](const Point& at, const auto&) {
    Values out;
    out.cloud = noise(at, 4, 72) > -0.2 ? 1 : 0.02;
    return out;
  };
  return {{"smooth", 30, smooth}, {"rough", 60, rough}, {"steps", 16, steps}};
}

// In slabs of a quarter of a cell, whose own error is no greater than what the end of rays loses.
protocol::View thin_slabs(data::Dataset& dataset, double depth) {
  constexpr double edge = 2;  // world units
  protocol::View view;
  view.dataset = dataset.info().id;
  view.vector.field = {protocol::FieldChoice::Kind::none, ""};
  view.scalars.emplace();
  protocol::ScalarView& layer = view.scalars->emplace_back();
  layer.field = "cloud";
  layer.extinction = std::vector<std::array<double, 2>>{{0, 0}, {1, depth / edge}};
  view.image.width = 48;
  view.image.height = 36;
  view.method.name = protocol::MethodName::slab;
  view.method.slab_thickness = 0.25;
  view.quality.max_error = 1;  // so that thinner slabs are allowed
  return scene::complete(view, dataset).value().view();
}

std::vector<double> integral(const scene::Scene& scene) {
  std::vector<double> out;
  for (const truth::Light& pixel : truth::integrate(scene)) {
    out.insert(out.end(), pixel.rgb.begin(), pixel.rgb.end());
    out.push_back(pixel.alpha);
  }
  return out;
}

TEST(OpaqueClouds, ReportedErrorsContainWhatIsLostWhereRaysEnd) {
  ThreadPool pool(2);
  const CancelToken cancel;
  frame::Workspace workspace;
  for (const Cloud& cloud : clouds()) {
    const auto dataset = formula_dataset({"cloud", {14, 14, 14}, {1e3, 1e3, 1e3}}, cloud.formula);
    const protocol::View view = thin_slabs(*dataset, cloud.depth);
    const auto completed = scene::complete(view, *dataset).value();
    const scene::Scene scene = scene::build_scene(completed, *dataset).value();
    const std::vector<double> truth = integral(scene);
    const auto true_error = [&](int thinner, engine::RenderSpace& space) {
      scene::Scene thin = scene;
      thin.slab_thickness /= thinner;
      EXPECT_TRUE(engine::render(thin, pool, cancel, space));
      return frame::difference_of(space.image().rgba, truth).rmse;
    };
    const quality::Kind kind = quality::signature_of(view).kind;
    const auto within = [&](double told, double error, const char* what, int thinner) {
      EXPECT_GT(told / error, 0.7) << cloud.name << ' ' << what << ' ' << thinner << ' ' << error;
      EXPECT_LT(told / error, 1.7) << cloud.name << ' ' << what << ' ' << thinner << ' ' << error;
    };

    for (const int thinner : {1, 4}) {
      protocol::View thin = view;
      thin.method.slab_thickness /= thinner;
      const auto wanted = scene::complete(thin, *dataset).value();
      const auto prepared =
          frame::prepare(wanted, frame::own_setting(wanted), *dataset, {}).value();
      const double error = true_error(thinner, workspace.space);
      const auto measured =
          frame::measured_error(prepared, *dataset, pool, cancel, workspace).value();
      within(measured.value(), error, "measured", thinner);
    }
    const auto done = frame::calibrate(
        completed, *dataset, pool, cancel, workspace, [&](const frame::CalibrationSample& one) {
          const quality::Setting& setting = quality::settings[one.setting];
          if (setting.method == protocol::MethodName::kernel) return;
          if (setting.half_level > 0 || setting.coarser > 0) return;
          engine::RenderSpace space;
          const double error = true_error(setting.thinner, space);
          within(one.measured.error.value(), error, "calibrated", setting.thinner);
          within(quality::expected_error(kind, setting, one.viewpoint).value, error, "estimated",
                 setting.thinner);
        });
    EXPECT_TRUE(done);
  }
}

}  // namespace
}  // namespace windsplat::test
