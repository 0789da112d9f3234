// Numbers on contours: where they are, which way up, and what they say.
#include "server/annotate/contour_labels.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "server/annotate/paint/document.hpp"
#include "server/annotate/paint/type.hpp"
#include "server/frame/pick/hidden.hpp"
#include "server/surface/contour_lines.hpp"
#include "tests/unit/annotate/shown.hpp"

namespace windsplat::annotate {
namespace {

using Function = std::function<double(double, double)>;

// A square over [-1, 1] x [-1, 1] at height z, of side x side cells, with values.
std::shared_ptr<const surface::Mesh> valued_square(int side, double z, const Function& value) {
  auto mesh = std::make_shared<surface::Mesh>();
  const auto row = static_cast<std::uint32_t>(side + 1);
  for (int j = 0; j <= side; ++j) {
    for (int i = 0; i <= side; ++i) {
      const double x = -1 + 2.0 * i / side;
      const double y = -1 + 2.0 * j / side;
      mesh->places.push_back({static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
      mesh->normals.push_back({0, 0, 1});
      mesh->values.push_back(static_cast<float>(value(x, y)));
    }
  }
  for (std::uint32_t j = 0; j + 1 < row; ++j) {
    for (std::uint32_t i = 0; i + 1 < row; ++i) {
      const std::uint32_t at = j * row + i;
      mesh->triangles.push_back({at, at + 1, at + row + 1});
      mesh->triangles.push_back({at, at + row + 1, at + row});
    }
  }
  return mesh;
}

surface::Shown shown_of(std::shared_ptr<const surface::Mesh> mesh, double step,
                        std::vector<double> levels = {}) {
  surface::Shown shown;
  shown.mesh = std::move(mesh);
  shown.colors = {{1, 1, 1}};
  shown.contours = {step, 1, {0, 0, 0}, std::move(levels)};
  return shown;
}

// Looks straight down; 240 pixels a unit.
void look_down(scene::Scene& scene, bool perspective) {
  scene.camera.perspective = perspective;
  scene.camera.eye = {0, 0, 5};
  scene.camera.right = {1, 0, 0};
  scene.camera.up = {0, 1, 0};
  scene.camera.forward = {0, 0, -1};
  scene.camera.half_height = perspective ? 0.2 : 1;
  scene.camera.near = 0.1;
  scene.camera.width = 640;
  scene.camera.height = 480;
}

struct Written {
  Figure figure;
  std::vector<Text> texts;
  double scale = 240;

  [[nodiscard]] Point world(const Point& pixel) const {
    return {(pixel.x - 320) / scale, (240 - pixel.y) / scale};
  }
};

// The middle of the digits of a turned text.
Point middle_of(const Text& text) {
  return {text.at.x + 0.36 * text.size * std::sin(text.turn),
          text.at.y - 0.36 * text.size * std::cos(text.turn)};
}

Written written_on(std::vector<surface::Shown> surfaces, bool perspective = false,
                   const decltype(Subject::hidden)& hidden = {}) {
  const Shown shown(scene::atmosphere_grid(), one_scalar());
  scene::Scene scene = shown.scene();
  scene.surfaces = std::move(surfaces);
  look_down(scene, perspective);
  Subject subject{shown.subject().completed, scene, shown.subject().info, nullptr, hidden};
  Written out;
  out.figure.width = scene.camera.width;
  out.figure.height = scene.camera.height;
  add_contour_labels(subject, style_of(subject), out.figure);
  for (const Item& item : out.figure.above) out.texts.push_back(std::get<Text>(item));
  return out;
}

double radius(double x, double y) { return std::hypot(x, y); }

// Whether the rectangles of two turned texts meet, by their four axes.
bool meet(const Text& a, const Text& b) {
  const auto corners = [](const Text& text) {
    std::array<Point, 4> out;
    const Point middle = middle_of(text);
    const double half = 0.5 * width_of(text.text, text.size);
    for (std::size_t n = 0; n < 4; ++n) {
      const double x = n % 2 == 0 ? -half : half;
      const double y = (n < 2 ? -0.4 : 0.4) * text.size;
      out.at(n) = {middle.x + x * std::cos(text.turn) - y * std::sin(text.turn),
                   middle.y + x * std::sin(text.turn) + y * std::cos(text.turn)};
    }
    return out;
  };
  const auto of_a = corners(a);
  const auto of_b = corners(b);
  for (const double turn :
       {a.turn, a.turn + std::numbers::pi / 2, b.turn, b.turn + std::numbers::pi / 2}) {
    const auto ends = [turn](const std::array<Point, 4>& of) {
      std::array<double, 2> range{1e300, -1e300};
      for (const Point& p : of) {
        const double along = p.x * std::cos(turn) + p.y * std::sin(turn);
        range = {std::min(range[0], along), std::max(range[1], along)};
      }
      return range;
    };
    const auto [a_low, a_high] = ends(of_a);
    const auto [b_low, b_high] = ends(of_b);
    if (a_high < b_low || b_high < a_low) return false;
  }
  return true;
}

TEST(ContourLabels, LieUprightOnTheLinesWhoseValuesTheyTell) {
  for (const bool perspective : {false, true}) {
    const Written out =
        written_on({shown_of(valued_square(160, 0, radius), 0.25, {0.6})}, perspective);
    EXPECT_GE(out.texts.size(), 8U);
    std::vector<std::string> seen;
    for (const Text& text : out.texts) {
      const Point at = out.world(middle_of(text));
      const double off = std::abs(radius(at.x, at.y) - std::stod(text.text));
      EXPECT_LT(off * out.scale, 0.2 * text.size) << text.text;
      EXPECT_LE(std::abs(text.turn), std::numbers::pi / 2 + 1e-9);
      // Across the direction to the middle of the circles.
      const double along = at.x * std::cos(text.turn) - at.y * std::sin(text.turn);
      EXPECT_LT(std::abs(along), 0.1 * radius(at.x, at.y));
      seen.push_back(text.text);
    }
    EXPECT_THAT(seen, testing::IsSupersetOf({"0.50", "0.75", "1.00", "0.6"}));
  }
}

TEST(ContourLabels, KeepApartFromEachOtherAndInsideThePicture) {
  const Written out = written_on({shown_of(valued_square(200, 0, radius), 0.04)});
  EXPECT_GE(out.texts.size(), 20U);
  for (std::size_t a = 0; a < out.texts.size(); ++a) {
    const Point at = middle_of(out.texts[a]);
    EXPECT_TRUE(at.x > 0 && at.y > 0 && at.x < 640 && at.y < 480);
    for (std::size_t b = 0; b < a; ++b) EXPECT_FALSE(meet(out.texts[a], out.texts[b]));
  }
}

TEST(ContourLabels, AreNotWrittenOverOtherTexts) {
  const Shown shown(scene::atmosphere_grid(), one_scalar());
  scene::Scene scene = shown.scene();
  scene.surfaces = {shown_of(valued_square(40, 0, [](double x, double) { return x; }), 0.5)};
  look_down(scene, false);
  const Subject subject{shown.subject().completed, scene, shown.subject().info};
  Figure figure;
  figure.width = 640;
  figure.height = 480;
  figure.taken = {{{0, 0}, {640, 300}}};
  add_contour_labels(subject, style_of(subject), figure);
  EXPECT_FALSE(figure.above.empty());
  for (const Item& item : figure.above) {
    const Text& text = std::get<Text>(item);
    EXPECT_GT(middle_of(text).y - 0.5 * width_of(text.text, text.size), 300);
  }
}

// An opaque square lies over the upper half of contours, a faint one over the lower half.
TEST(ContourLabels, AreNotWrittenOnHiddenLines) {
  surface::Shown covers = shown_of(valued_square(2, 0.5, radius), 0);
  auto half = std::make_shared<surface::Mesh>(*covers.mesh);
  for (auto& place : half->places) place[1] = 0.5F * (place[1] + 1);
  covers.mesh = half;
  surface::Shown faint = covers;
  auto other = std::make_shared<surface::Mesh>(*half);
  for (auto& place : other->places) place[1] -= 1;
  faint.mesh = other;
  faint.opacity = 0.4;
  for (const bool perspective : {false, true}) {
    const std::vector<surface::Shown> surfaces{shown_of(valued_square(100, 0, radius), 0.25),
                                               covers, faint};
    const Shown any(scene::atmosphere_grid(), one_scalar());
    scene::Scene scene = any.scene();
    scene.surfaces = surfaces;
    scene.body.reset();
    look_down(scene, perspective);
    const Written out =
        written_on(surfaces, perspective, [&scene](const std::vector<glm::dvec3>& places) {
          return frame::hidden_places(scene, places);
        });
    EXPECT_GE(out.texts.size(), 4U);
    for (const Text& text : out.texts) EXPECT_LT(out.world(middle_of(text)).y, 0.01);
  }
}

// Lines around a ball, seen from its pole: those beyond 72 degrees from it run along the limb.
TEST(ContourLabels, AreNotWrittenAlongTheLimb) {
  auto ball = std::make_shared<surface::Mesh>(*valued_square(120, 0, radius));
  for (std::size_t n = 0; n < ball->places.size(); ++n) {
    auto& [x, y, z] = ball->places[n];
    const double r = std::min(radius(x, y), 1.0);
    if (r > 0) {
      const double longer = std::hypot(x, y);
      x = static_cast<float>(x / longer * std::sin(r * std::numbers::pi / 2));
      y = static_cast<float>(y / longer * std::sin(r * std::numbers::pi / 2));
    }
    z = static_cast<float>(std::cos(r * std::numbers::pi / 2));
    ball->normals[n] = {x, y, z};
    ball->values[n] = static_cast<float>(90 * r);  // degrees from the pole
  }
  const Written out = written_on({shown_of(ball, 15)});
  std::vector<std::string> seen;
  for (const Text& text : out.texts) seen.push_back(text.text);
  EXPECT_THAT(seen, testing::IsSupersetOf({"30", "45", "60"}));
  EXPECT_THAT(seen, testing::Not(testing::Contains("75")));
}

TEST(ContourLabels, HavePreciselyTheDecimalsOfTheirIntervalOrLevel) {
  const surface::Contours quarters{0.25, 1, {}, {0.3}};
  EXPECT_EQ(level_text(quarters, 0.5), "0.50");
  EXPECT_EQ(level_text(quarters, -1.25), "\u22121.25");
  EXPECT_EQ(level_text(quarters, 0.3), "0.3");
  EXPECT_EQ(level_text({20, 1, {}, {}}, 280), "280");
  EXPECT_EQ(level_text({0.1, 1, {}, {}}, 3 * 0.1), "0.3");
  EXPECT_EQ(level_text({0, 1, {}, {273.15}}, 273.15), "273.15");
  EXPECT_EQ(level_text({5, 1, {}, {}}, 0), "0");
}

TEST(ContourLabels, OfManyLinesNumberEvery2nd5thOr10th) {
  const surface::Contours contours{1, 1, {}, {2.5, 4, 99}};
  EXPECT_THAT(numbered_levels(contours, 0.5, 5, 60), testing::ElementsAre(1, 2, 2.5, 3, 4, 5));
  EXPECT_THAT(numbered_levels({1, 1, {}, {}}, 0, 70, 10),
              testing::ElementsAre(0, 10, 20, 30, 40, 50, 60, 70));
  EXPECT_THAT(numbered_levels({1, 1, {}, {}}, 0, 18, 10),
              testing::ElementsAre(0, 2, 4, 6, 8, 10, 12, 14, 16, 18));
  EXPECT_LE(numbered_levels({1e-30, 1, {}, {}}, -1e30, 1e30, 60).size(), 61U);
}

// 1.3 million segments of vertical lines, and a few hundred of another.
TEST(ContourLabels, LeaveOutLevelsOfTooManySegments) {
  const auto stripes = [](double x, double y) {
    if (y > 0.5) return 2 + y;
    return std::lround((x + 1) * 400) % 2 == 0 ? 0.0 : 1.0;
  };
  const auto few = [](double x, double y) {
    return y > 0.5 ? 2 + y : std::lround((x + 1) * 400) % 40 == 0 ? 0.0 : 1.0;
  };
  for (const bool many : {true, false}) {
    const auto mesh = valued_square(800, 0, many ? Function(stripes) : Function(few));
    const Written written = written_on({shown_of(mesh, 0, {0.5, 2.75})});
    std::vector<std::string> texts;
    for (const Text& text : written.texts) texts.push_back(text.text);
    EXPECT_THAT(texts, testing::Contains("2.75"));
    const bool has_stripes = std::find(texts.begin(), texts.end(), "0.5") != texts.end();
    EXPECT_EQ(has_stripes, !many);
  }
}

TEST(ContourLabels, NeedMemoryForTheirLines) {
  scene::Scene scene;
  EXPECT_EQ(contour_label_bytes(scene), 0U);
  scene.surfaces = {shown_of(valued_square(1000, 0, radius), 0)};
  EXPECT_EQ(contour_label_bytes(scene), 0U);  // no contours
  scene.surfaces = {shown_of(valued_square(1000, 0, radius), 0.1)};
  const std::uint64_t bytes = contour_label_bytes(scene);
  EXPECT_GT(bytes, std::uint64_t{64} << 20U);
  EXPECT_LT(bytes, std::uint64_t{160} << 20U);
}

TEST(ContourLabels, AreTextsOfASvg) {
  const Written out =
      written_on({shown_of(valued_square(40, 0, [](double x, double) { return x; }), 0.5)});
  ASSERT_FALSE(out.texts.empty());
  const std::vector<std::uint8_t> rgb(std::size_t{3} * 640 * 480, 255);
  const auto svg = encode_svg(rgb, out.figure, 300);
  ASSERT_TRUE(svg);
  const std::string text(svg->begin(), svg->end());
  EXPECT_THAT(text, testing::ContainsRegex("transform=\"rotate\\(-?90.00 [0-9. ]*\\)\"[^>]*>0.5<"));
}

std::vector<surface::ContourLine> lines_of(const surface::Mesh& mesh,
                                           const std::vector<double>& levels) {
  std::vector<surface::ContourLine> lines;
  surface::each_contour_line(mesh, levels, [&](const auto& line) { lines.push_back(line); });
  return lines;
}

TEST(ContourLines, HaveAsManySegmentsAsAreCountedOfEachLevel) {
  const auto mesh = valued_square(700, 0, radius);  // more than are followed at a time
  std::vector<double> levels{-1};
  for (int n = 0; n < 400; ++n) levels.push_back(0.0021 + 0.0033 * n);
  const auto counts = surface::contour_segments(*mesh, levels);
  std::vector<std::size_t> followed(levels.size(), 0);
  surface::each_contour_line(*mesh, levels, [&](const auto& line) {
    const auto at = std::find(levels.begin(), levels.end(), line.level) - levels.begin();
    followed.at(static_cast<std::size_t>(at)) += line.places.size() - 1;
  });
  EXPECT_EQ(followed, counts);
  EXPECT_EQ(counts[0], 0U);
  EXPECT_GT(counts[200], 2000U);
}

TEST(ContourLines, EndWhenTheyAreCancelled) {
  const auto mesh = valued_square(100, 0, radius);
  const CancelToken cancel;
  int lines = 0;
  surface::each_contour_line(
      *mesh, {0.2, 0.5, 1.2},
      [&](const auto&) {
        ++lines;
        cancel.cancel();
      },
      cancel);
  EXPECT_EQ(lines, 1);
}

TEST(ContourLines, AreClosedCirclesOfTheirRadiusAndOpenAtTheEdge) {
  const auto mesh = valued_square(100, 0, radius);
  const auto lines = lines_of(*mesh, {0.5, 1.2, 3});
  ASSERT_EQ(lines.size(), 5U);  // a circle, and an arc in each corner
  EXPECT_EQ(lines[0].level, 0.5);
  EXPECT_EQ(lines[0].places.front(), lines[0].places.back());
  double length = 0;
  for (std::size_t n = 1; n < lines[0].places.size(); ++n) {
    const auto& p = lines[0].places[n - 1];
    const auto& q = lines[0].places[n];
    length += std::hypot(static_cast<double>(p[0] - q[0]), static_cast<double>(p[1] - q[1]));
  }
  EXPECT_NEAR(length, std::numbers::pi, 2e-3);
  for (std::size_t n = 1; n < 5; ++n) {
    EXPECT_EQ(lines[n].level, 1.2);
    EXPECT_NE(lines[n].places.front(), lines[n].places.back());
    for (const auto* end : {&lines[n].places.front(), &lines[n].places.back()}) {
      EXPECT_NEAR(std::max(std::abs((*end)[0]), std::abs((*end)[1])), 1, 1e-6);
    }
  }
}

TEST(ContourLines, HaveGapsWhereValuesAreMasked) {
  const auto mesh = valued_square(10, 0, [](double x, double y) {
    return std::abs(x - 0.2) < 1e-6 && std::abs(y - 0.2) < 1e-6 ? std::nan("") : x;
  });
  const auto lines = lines_of(*mesh, {0.1, 0.7});
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_EQ(lines[0].level, 0.1);
  EXPECT_EQ(lines[1].level, 0.1);
  EXPECT_EQ(lines[2].level, 0.7);
}

TEST(HiddenPlaces, LieBehindSurfacesThatTogetherAbsorbMoreThanHalfOrBehindTheBody) {
  const Shown any(scene::atmosphere_grid(), one_scalar());
  scene::Scene scene = any.scene();
  scene.body.reset();
  surface::Shown square = shown_of(valued_square(3, 0, radius), 0);
  for (const bool perspective : {false, true}) {
    look_down(scene, perspective);
    const std::vector<glm::dvec3> places{
        {0.1, 0.2, 0.5}, {0.1, 0.2, 0}, {0.1, 0.2, -0.5}, {1.2, 0.2, -0.5}};
    scene.surfaces = {square};
    EXPECT_THAT(frame::hidden_places(scene, places),
                testing::ElementsAre(false, false, true, false));
    scene.surfaces[0].opacity = 0.4;
    EXPECT_FALSE(frame::hidden_places(scene, places)[2]);
    scene.surfaces.push_back(scene.surfaces[0]);
    EXPECT_TRUE(frame::hidden_places(scene, places)[2]);
    scene.surfaces.clear();
    scene.body.emplace();
    scene.body->radius = 0.3;
    EXPECT_THAT(frame::hidden_places(scene, places),
                testing::ElementsAre(false, true, true, false));
    scene.body.reset();
  }
  EXPECT_TRUE(frame::hidden_places(scene, {{0, 0, 6}})[0]) << "behind the eye";
}

}  // namespace
}  // namespace windsplat::annotate
