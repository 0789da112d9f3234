// Comparisons of the calibration report, with synthetic numbers.
#include "server/study/calibration.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "server/quality/pick.hpp"
#include "server/study/report/report.hpp"

namespace windsplat::study {
namespace {

Compared compared(double told, double truth, std::size_t setting = 0, std::size_t variant = 0) {
  Compared one;
  one.variant = variant;
  one.setting = setting;
  one.error = truth;
  one.forecast = {told, std::log(2.0) / 1.65, 1, true};  // bounded by twice the estimate
  one.prior = {10 * truth, 0, 1, false};
  return one;
}

Calibration made_up() {
  Calibration calibration;
  calibration.plan = {64, 48, 1, 1};
  calibration.variants = {"unchanged", "lines only"};
  const std::size_t slab = quality::index_of({protocol::MethodName::slab, 0, 0}).value();
  calibration.compared = {compared(0.01, 0.01), compared(0.019, 0.01), compared(0.01, 0.019, slab),
                          compared(0.01, 0.021, slab, 1)};
  calibration.measured = {{0, true, 0.01, 0.011}, {1, false, 0.01, 0.03}};
  calibration.encodings = {{0, 90, true, 0.01, 0.012, 0.02}};
  calibration.aimed = {{0.02, 4, 3, 2, 4, 3}};
  calibration.checks = {{1, 2e-6, 3e-6}};
  return calibration;
}

TEST(Looks, MatchTheContentOfTheSubject) {
  const auto names_of = [](const char* scene) {
    std::set<std::string> names;
    for (const Variant& variant : variants_of(standard_subject(scene, true).value())) {
      EXPECT_TRUE(names.insert(variant.name).second);
    }
    return names;
  };
  EXPECT_EQ(names_of("soft").size(), 5U);
  EXPECT_EQ(names_of("vectors"), (std::set<std::string>{"unchanged", "thick lines"}));
  EXPECT_EQ(names_of("scalar"), (std::set<std::string>{"unchanged", "ten times as dense"}));
}

TEST(Looks, DifferInTheNamedProperties) {
  const Subject subject = standard_subject("soft", true).value();
  for (const Variant& variant : variants_of(subject)) {
    const bool lines = variant.view.vector.field.kind == protocol::FieldChoice::Kind::named;
    EXPECT_EQ(lines, variant.name != "medium only");
    EXPECT_EQ(variant.view.scalars->empty(), variant.name == "lines only");
    if (variant.name != "ten times as dense") continue;
    const auto& own = *subject.view.scalars->front().extinction;
    const auto& dense = *variant.view.scalars->front().extinction;
    EXPECT_NEAR(dense.back()[1], 10 * own.back()[1], 1e-9 * own.back()[1]);
  }
}

TEST(Seen, IsReproducibleAndDiffersByViewpoint) {
  const Subject subject = standard_subject("soft", true).value();
  std::set<double> heights;
  for (std::uint64_t n = 0; n < 20; ++n) {
    const auto view = seen_from(subject.view, *subject.dataset, n).value();
    const auto again = seen_from(subject.view, *subject.dataset, n).value();
    EXPECT_EQ(view.camera.eye, again.camera.eye);
    EXPECT_TRUE(heights.insert(*view.camera.height).second);
  }
  EXPECT_GT(*heights.rbegin() / *heights.begin(), 3) << "from near and from far";
}

TEST(Agreement, CountsSharesAndTheMedianRatio) {
  const Calibration calibration = made_up();
  const Agreement all = agreement(calibration);
  EXPECT_EQ(all.count, 4U);
  EXPECT_DOUBLE_EQ(all.within_two, 0.75);
  EXPECT_DOUBLE_EQ(all.bounded, 0.75);
  EXPECT_NEAR(all.median, 0.5 * (1 + 0.01 / 0.019), 1e-12);
  const Agreement first =
      agreement(calibration, [](const Compared& one) { return one.variant == 0; });
  EXPECT_DOUBLE_EQ(first.within_two, 1);
  EXPECT_DOUBLE_EQ(agreement_of_priors(calibration).within_two, 0);
  EXPECT_DOUBLE_EQ(agreement_of_priors(calibration).bounded, 1);
  EXPECT_DOUBLE_EQ(agreement_of_measured(calibration).within_two, 0.5);
  EXPECT_DOUBLE_EQ(agreement_of_encodings(calibration).within_two, 1);
  EXPECT_EQ(agreement(Calibration()).count, 0U);
}

TEST(Agreement, RoundingErrorsAreEquivalent) {
  Calibration calibration;
  calibration.compared = {compared(1e-5, 1e-9)};
  EXPECT_DOUBLE_EQ(agreement(calibration).within_two, 1);
}

TEST(Calibrate, ComparesEverySettingOfEveryHeldOutView) {
  const Subject subject = standard_subject("vectors", true).value();
  ThreadPool pool(2);
  int asked = 0;
  const Truth truth = [&](const scene::Scene& scene) -> Result<Picture> {
    ++asked;
    Picture picture{scene.camera.width, scene.camera.height, {}, 0, 0};
    picture.rgba.assign(4 * static_cast<std::size_t>(picture.width) * picture.height, 0.5);
    return picture;
  };
  int views = 0;
  const Calibration made =
      calibrate(subject, {100, 80, 1, 2}, truth, pool, CancelToken(), [&](int n) {
        EXPECT_EQ(n, ++views);
      }).value();
  EXPECT_EQ(views, 2 * 3);
  EXPECT_EQ(made.variants.size(), 2U);
  protocol::View view = subject.view;
  view.image.width = 100;
  view.image.height = 80;
  std::size_t allowed = 0;
  for (const quality::Setting& setting : quality::settings) {
    allowed += quality::is_allowed(setting, view) ? 1 : 0;
  }
  EXPECT_EQ(made.compared.size(), 2 * 2 * allowed);
  EXPECT_EQ(made.measured.size(), 2U * 2 * 2);
  for (const Aimed& aimed : made.aimed) {
    EXPECT_EQ(aimed.frames, 4U);
    EXPECT_LE(aimed.promised_kept, aimed.promised);
    EXPECT_LE(aimed.possible_kept, aimed.possible);
  }
  // A uniform grey picture is not a valid reference.
  EXPECT_EQ(asked, 2);
  ASSERT_EQ(made.checks.size(), 2U);
  EXPECT_GT(made.checks[0].apart, 0.1);
}

TEST(Calibrate, StopsWhenCancelled) {
  ThreadPool pool(1);
  const CancelToken cancel;
  const auto made = calibrate(standard_subject("vectors", true).value(), {100, 80, 1, 2}, {}, pool,
                              cancel, [&](int) { cancel.cancel(); });
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().kind, ErrorKind::cancelled);
}

TEST(CalibrationReport, IsInTheJson) {
  Report report;
  report.scenes.emplace_back();
  SceneReport& scene = report.scenes[0];
  scene.view = standard_subject("vectors", true).value().view;
  using Json = nlohmann::json;
  EXPECT_FALSE(Json::parse(report_json(report)).at("scenes").at(0).contains("calibration"));

  scene.calibration = made_up();
  scene.calibration->measured.push_back({0, true, 0.25, 0.5});
  const Json json = Json::parse(report_json(report)).at("scenes").at(0).at("calibration");
  EXPECT_EQ(json.at("agreement").at(0).at("of"), "estimated");
  EXPECT_EQ(json.at("agreement").at(0).at("withinTwo"), 0.75);
  ASSERT_EQ(json.at("points").size(), 4U);
  EXPECT_EQ(json.at("points").at(3).at("method"), "slab");
  for (std::size_t i = 0; i < 4; ++i) {
    const quality::Setting& setting = quality::settings[scene.calibration->compared[i].setting];
    EXPECT_EQ(json.at("points").at(i).at("settingClass"), name_of(class_of(setting)));
  }
  EXPECT_EQ(json.at("aims").at(0).at("promisedKept"), 2);
  EXPECT_EQ(json.at("checks").at(0).at("apart"), 2e-6);
  const std::string first = scene.calibration->variants[0];
  const Json frame{{"look", first}, {"method", "slab"}, {"error", 0.25}, {"measured", 0.5}};
  EXPECT_EQ(json.at("measured").back(), frame);
}

}  // namespace
}  // namespace windsplat::study
