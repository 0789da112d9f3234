// The document of a study validated against study.schema.json.
#include "protocol/study.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "protocol/codec.hpp"
#include "support.hpp"

namespace windsplat::protocol::testing {
namespace {

using ::testing::IsEmpty;

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

StudyPoint unstable_point() {
  StudyPoint point{"slab", "cd-euler", {{"stride", 2}, {"stopTransmittance", 0}, {"width", 64}}};
  point.rmse = unknown;
  point.psnr = std::numeric_limits<double>::infinity();
  point.stable = false;
  return point;
}

StudyExtremes extremes() {
  StudyExtreme drawn;
  drawn.group = "depth";
  drawn.label = "1e30";
  drawn.value = 1e30;
  drawn.method = "slab";
  drawn.projection = "perspective";
  drawn.mapping = "flat";
  drawn.samples = {4, 4, 1};
  StudyExtreme refused = drawn;
  refused.value = unknown;
  refused.outcome = "refused";
  refused.message = "is too large";
  drawn.outcome = "failed";
  drawn.truth = "integrator";
  drawn.finite = false;
  drawn.monotone = true;
  drawn.rmse = std::numeric_limits<double>::infinity();
  drawn.measured = unknown;
  StudyTrust trust;
  trust.group = "depth";
  trust.method = "slab";
  trust.worst = unknown;
  trust.within = {{1e-3, "all"}};
  return {{drawn, refused}, {trust}};
}

// One element of every kind.
StudyDocument whole_document() {
  StudyDocument study;
  study.runs = 3;
  StudyScene scene;
  scene.name = "climate";
  scene.view = ViewDocument::parse("{}")->view();
  scene.reference = {"integral", 0, unknown, 1e-6, 80, 60, 12, 345};
  scene.points = {unstable_point()};
  scene.curves = {{"slab", "cd-euler", "slabThickness", unknown, {0}}};
  scene.reconstruction_ripple = unknown;
  scene.jpeg = {{90, 1e-3, 60, 0.01, 4321}};
  StudyCalibration calibration;
  calibration.looks = {"unchanged"};
  calibration.agreement = {{"estimated", 1, 1, 1.1, 1}};
  calibration.aims = {{0.1, 1, 1, 1, 1, 0}};
  calibration.checks = {{"unchanged", 1e-6, 2e-6}};
  calibration.points = {{"unchanged", 0, "slab", "slab", 0, 0, 2, 1e-3, 1.1e-3, 0.2, 2e-3}};
  calibration.measured = {{"unchanged", "kernel", 1e-3, 1.1e-3}};
  scene.calibration = calibration;
  scene.pictures = {{"reference", "iVBO", ""}, {"slab analytic", "iVBO", "iVBO"}};
  study.scenes = {scene};
  study.stability = {{"simple", 1e30, unknown, 0, 1, true, false, -1e30, 1, true}};
  study.extremes = extremes();
  return study;
}

TEST(Study, MatchesItsSchemaWithEveryPart) {
  const Json json = Json::parse(encode_study(whole_document()));
  EXPECT_THAT(schema_complaints("study.schema.json", "", json), IsEmpty());
  const Json& scene = json.at("scenes").at(0);
  EXPECT_TRUE(scene.at("points").at(0).at("rmse").is_null());
  EXPECT_TRUE(scene.at("points").at(0).at("psnr").is_null());
  EXPECT_FALSE(scene.at("pictures").at(0).contains("differencePng"));
  EXPECT_EQ(scene.at("pictures").at(1).at("differencePng"), "iVBO");
  const Json& cases = json.at("extremes").at("cases");
  EXPECT_TRUE(cases.at(0).at("rmse").is_null());
  EXPECT_FALSE(cases.at(1).contains("truth"));
}

TEST(Study, MatchesItsSchemaWithoutOptionalParts) {
  StudyDocument study = whole_document();
  study.scenes[0].calibration.reset();
  study.scenes[0].pictures.clear();
  study.extremes.reset();
  const Json json = Json::parse(encode_study(study));
  EXPECT_THAT(schema_complaints("study.schema.json", "", json), IsEmpty());
  EXPECT_FALSE(json.at("scenes").at(0).contains("calibration"));
  EXPECT_FALSE(json.at("scenes").at(0).contains("pictures"));
  EXPECT_FALSE(json.contains("extremes"));
}

TEST(Study, IsTheSameOnOneLine) {
  const std::string compact = encode_study(whole_document(), true);
  EXPECT_EQ(compact.find('\n'), compact.size() - 1);
  EXPECT_EQ(Json::parse(compact), Json::parse(encode_study(whole_document())));
}

}  // namespace
}  // namespace windsplat::protocol::testing
