// Figures against the camera, the engine's pixels and closed forms.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "server/annotate/annotate.hpp"
#include "server/annotate/axes.hpp"
#include "server/annotate/box.hpp"
#include "server/annotate/legend.hpp"
#include "server/annotate/marks.hpp"
#include "server/annotate/paint/type.hpp"
#include "server/annotate/projector.hpp"
#include "server/annotate/room.hpp"
#include "server/engine/render.hpp"
#include "server/scene/angles.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::annotate {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

// A view of a dataset with everything that a figure is made of.
class Shown {
 public:
  Shown(data::Grid grid, std::vector<data::FieldInfo> fields,
        const std::function<void(protocol::View&)>& change = {}) {
    auto source = std::make_unique<scene::FakeSource>(std::move(grid), std::move(fields), 2);
    dataset_ = scene::dataset_of(std::move(source));
    protocol::View view;
    view.dataset = "fake";
    view.image.width = 640;
    view.image.height = 480;
    if (change) change(view);
    completed_.emplace(scene::complete(view, *dataset_).value());
    scene_.emplace(scene::build_scene(*completed_, *dataset_).value());
  }
  [[nodiscard]] Subject subject() const { return {*completed_, *scene_, dataset_->info()}; }
  [[nodiscard]] const scene::Scene& scene() const { return *scene_; }
  [[nodiscard]] Projector projector() const { return Projector(scene_->camera); }

 private:
  std::unique_ptr<data::Dataset> dataset_;
  std::optional<scene::CompletedView> completed_;
  std::optional<scene::Scene> scene_;
};

std::vector<std::string> texts(const std::vector<Item>& items) {
  std::vector<std::string> out;
  for (const Item& item : items) {
    if (const Text* text = std::get_if<Text>(&item)) out.push_back(text->text);
  }
  return out;
}

std::vector<Line> lines(const std::vector<Item>& items) {
  std::vector<Line> out;
  for (const Item& item : items) {
    if (const Line* line = std::get_if<Line>(&item)) out.push_back(*line);
  }
  return out;
}

Figure empty_figure(const Shown& shown) {
  Figure figure;
  figure.width = shown.scene().camera.width;
  figure.height = shown.scene().camera.height;
  return figure;
}

std::vector<data::FieldInfo> one_scalar() { return {scene::scalar_info("cloud", "kg m**-3")}; }

// The centroid of a medium of one sample in the middle of the box is where the projector puts it.
TEST(Projector, AgreesWithTheEngine) {
  for (const auto projection :
       {protocol::Projection::perspective, protocol::Projection::orthographic}) {
    data::Grid grid;
    grid.axes = {scene::axis(data::AxisKind::cartesian, "m", {0, 1, 2, 3, 4, 5, 6}),
                 scene::axis(data::AxisKind::cartesian, "m", {0, 1, 2, 3, 4}),
                 scene::axis(data::AxisKind::cartesian, "m", {0, 1, 2, 3, 4})};
    const std::size_t sample = (1 * 5 + 3) * 7 + 5;
    auto source = std::make_unique<scene::FakeSource>(grid, one_scalar(), 1);
    source->values = [](const std::string&, std::size_t n) { return n == sample ? 1.0 : 0.0; };
    const auto dataset = scene::dataset_of(std::move(source));
    protocol::View view;
    view.dataset = "fake";
    view.image.width = 320;
    view.image.height = 240;
    view.camera.projection = projection;
    view.camera.eye = protocol::Vec3{1.5, -3, 1};
    view.scalars.emplace().push_back({});
    view.scalars->front().field = "cloud";
    view.scalars->front().extinction = {{{0, 0}, {1, 2}}};
    const auto completed = scene::complete(view, *dataset).value();
    const auto scene = scene::build_scene(completed, *dataset).value();
    ThreadPool pool(1);
    engine::RenderSpace space;
    ASSERT_TRUE(engine::render(scene, pool, {}, space));
    double weight = 0;
    Point centroid{0, 0};
    const auto& rgba = space.image().rgba;
    for (std::size_t n = 0; n < rgba.size() / 4; ++n) {
      const double alpha = rgba[4 * n + 3];
      weight += alpha;
      centroid.x += alpha * (static_cast<double>(n % 320) + 0.5);
      centroid.y += alpha * (static_cast<double>(n / 320) + 0.5);
    }
    ASSERT_GT(weight, 1);
    const auto& at = scene.lattice.positions;
    const auto pixel = Projector(scene.camera).pixel({at[0][5], at[1][3], at[2][1]});
    ASSERT_TRUE(pixel);
    EXPECT_NEAR(centroid.x / weight, pixel->x, 0.5);
    EXPECT_NEAR(centroid.y / weight, pixel->y, 0.5);
  }
}

TEST(Box, HasTwelveEdgesOfWhichThoseOfTwoVisibleSidesAreOverTheData) {
  // From above at an angle three sides face the eye: three edges lie between two of them.
  const Shown corner(scene::atmosphere_grid(), one_scalar(), [](protocol::View& view) {
    view.camera.eye = protocol::Vec3{4, -4, 3};
  });
  Figure figure = empty_figure(corner);
  add_box(corner.subject(), style_of(corner.subject()), figure);
  EXPECT_THAT(figure.above, SizeIs(3));
  EXPECT_THAT(figure.below, SizeIs(9));
  // They meet in the nearest corner.
  const glm::dvec3 low = corner.scene().lattice.box_min;
  const glm::dvec3 high = corner.scene().lattice.box_max;
  const auto nearest = corner.projector().pixel({high.x, low.y, high.z});
  ASSERT_TRUE(nearest);
  for (const Line& line : lines(figure.above)) {
    const auto apart = [&](const Point& p) {
      return std::hypot(p.x - nearest->x, p.y - nearest->y);
    };
    EXPECT_LT(std::min(apart(line.points[0]), apart(line.points[1])), 1e-6);
  }
  // Inside the box no side is seen from without, and edges behind the eye are cut.
  const Shown inside(scene::atmosphere_grid(), one_scalar(), [](protocol::View& view) {
    view.camera.eye = protocol::Vec3{0, 0, 0};
    view.camera.target = protocol::Vec3{0, 1, 0};
    view.camera.fov_y = 120;
  });
  figure = empty_figure(inside);
  add_box(inside.subject(), style_of(inside.subject()), figure);
  EXPECT_THAT(figure.above, IsEmpty());
  EXPECT_THAT(figure.below, SizeIs(8)) << "four edges lie behind the eye";
}

// The same position by the samples: a coordinate of the data is where its sample is drawn.
TEST(AxisMap, PutsCoordinatesAtTheirSamples) {
  const Shown shown(scene::atmosphere_grid(), one_scalar());
  const scene::Lattice& lattice = shown.scene().lattice;
  const data::Grid grid = scene::atmosphere_grid();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto map = axis_map(shown.subject(), axis);
    ASSERT_TRUE(map);
    for (std::size_t i = 0; i < grid.axes[axis].coordinates.size(); ++i) {
      EXPECT_NEAR(map->position(grid.axes[axis].coordinates[i]), lattice.positions[axis][i], 1e-12);
      EXPECT_NEAR(map->value(lattice.positions[axis][i]), grid.axes[axis].coordinates[i], 1e-9);
    }
    EXPECT_EQ(map->even(), axis < 2) << "pressures by their logarithm";
  }
  // 1000, 500 and 250 hPa are evenly spaced in log p: 707 hPa is midway between the first two.
  const auto map = axis_map(shown.subject(), 2);
  EXPECT_NEAR(map->position(1000 / std::sqrt(2.0)),
              0.5 * (lattice.positions[2][0] + lattice.positions[2][1]), 1e-9);
}

TEST(Axes, TellDegreesAndPressures) {
  const Shown shown(scene::atmosphere_grid(), one_scalar(), [](protocol::View& view) {
    view.annotations.axes = true;
    view.camera.eye = protocol::Vec3{-2, -5, 2};
    view.geometry.scale = {1, 1, 4};
  });
  const Figure figure = figure_of(shown.subject());
  const auto written = texts(figure.above);
  EXPECT_THAT(written, Contains("10\u00b0E"));
  EXPECT_THAT(written, Contains("0\u00b0"));
  EXPECT_THAT(written, Contains("pressure (hPa)"));
  EXPECT_THAT(written, Contains("500"));
  EXPECT_THAT(figure.below, IsEmpty());
}

bool overlap(const Rectangle& a, const Rectangle& b) {
  return a.low.x < b.high.x && b.low.x < a.high.x && a.low.y < b.high.y && b.low.y < a.high.y;
}

// Every annotation at once, from many sides and in many shapes: no text over another, none outside.
TEST(Figure, TextsLieInThePictureAndApart) {
  int written = 0;
  for (int azimuth = 0; azimuth < 360; azimuth += 30) {
    for (const auto& [width, height] : {std::array{640, 480}, {1280, 720}, {300, 800}, {90, 60}}) {
      auto fields = one_scalar();
      fields.push_back(scene::wind_info());
      const int across = width;
      const int down = height;
      const Shown shown(scene::atmosphere_grid(), fields, [&](protocol::View& view) {
        const double a = azimuth * scene::radians_per_degree;
        view.camera.eye = protocol::Vec3{4 * std::sin(a), -4 * std::cos(a), 2};
        view.image.width = across;
        view.image.height = down;
        view.annotations = {true, true, true, true, true, true, true, 1, {}};
      });
      const Figure figure = figure_of(shown.subject());
      std::vector<Rectangle> boxes;
      for (const Item& item : figure.above) {
        const Text* const text = std::get_if<Text>(&item);
        if (text == nullptr) continue;
        const Rectangle box = bounds_of(*text);
        EXPECT_GE(box.low.x, -0.5) << text->text;
        EXPECT_LE(box.high.x, width + 0.5) << text->text;
        EXPECT_GE(box.low.y, -0.5) << text->text;
        EXPECT_LE(box.high.y, height + 0.5) << text->text;
        for (const Rectangle& other : boxes) {
          // Texts of a card have no rim, and their places are fixed.
          const bool over = text->rim.alpha > 0 && overlap(box, other);
          EXPECT_FALSE(over) << text->text << ' ' << azimuth;
        }
        boxes.push_back(box);
        ++written;
      }
    }
  }
  EXPECT_GT(written, 400);
}

// The bar's length is that between two points of the ground as they are drawn.
// A view of a thousandth of the box: what is drawn lies at the picture, on the same lines as the
// whole edges, and an axis that passes through has as many ticks as it has when all of it is seen.
TEST(Axes, KeepTheirTicksInViewsOfAPart) {
  const auto view_of = [](double height) {
    return [height](protocol::View& view) {
      view.camera.projection = protocol::Projection::orthographic;
      view.camera.target = protocol::Vec3{0, -1, 0};
      view.camera.eye = protocol::Vec3{0, -1, 3};
      view.camera.up = protocol::Vec3{0, 1, 0};
      view.camera.height = height;
    };
  };
  data::Grid grid;
  grid.axes = {scene::axis(data::AxisKind::cartesian, "m", {0, 1, 2, 3}),
               scene::axis(data::AxisKind::cartesian, "m", {0, 1, 2, 3}),
               scene::axis(data::AxisKind::cartesian, "m", {0, 1})};
  for (const double height : {1.0, 0.1, 1e-6}) {
    const Shown shown(grid, one_scalar(), view_of(height));
    Figure figure = empty_figure(shown);
    const Style style = style_of(shown.subject());
    add_box(shown.subject(), style, figure);
    EXPECT_FALSE(lines(figure.above).empty() && lines(figure.below).empty());
    const auto edges = {lines(figure.above), lines(figure.below)};
    add_axes(shown.subject(), style, figure);
    for (const auto& layer : edges) {
      for (const Line& line : layer) {
        for (const Point& at : line.points) {
          EXPECT_GE(at.x, -10);
          EXPECT_LE(at.x, figure.width + 10);
          EXPECT_NEAR(at.y, 240, 240 + 10);
        }
      }
    }
    if (height < 0.1) continue;
    EXPECT_GE(texts(figure.above).size(), 4U) << height << ": three ticks and a name";
  }
}

TEST(VisiblePart, EndsAtTheEdgesOfThePicture) {
  Figure figure;
  figure.width = 100;
  figure.height = 50;
  const auto part = visible_part(figure, {Point{-1e9, 25 - 1e9}, Point{1e9, 25 + 1e9}}, 0);
  ASSERT_TRUE(part);
  EXPECT_NEAR((*part)[0].x, -25 + 25, 1e-5);
  EXPECT_NEAR((*part)[0].y, 25, 1e-5);
  EXPECT_NEAR((*part)[1].x, 25, 1e-5);
  EXPECT_NEAR((*part)[1].y, 50, 1e-5);
  EXPECT_FALSE(visible_part(figure, {Point{-5, 0}, Point{-5, 50}}, 4));
  EXPECT_TRUE(visible_part(figure, {Point{-3, 0}, Point{-3, 50}}, 4));
  EXPECT_FALSE(visible_part(figure, {Point{-50, 40}, Point{20, 110}}, 0)) << "past a corner";
}

TEST(Fitted, CutsWholeCharacters) {
  const std::string title = "\u98a8\u901f of the north";
  EXPECT_EQ(fitted(title, 10, 1000), title);
  for (double room = 0; room < width_of(title, 10); ++room) {
    const std::string cut = fitted(title, 10, room);
    EXPECT_LE(width_of(cut, 10), room);
    if (cut.empty()) continue;
    ASSERT_THAT(cut, testing::EndsWith("\u2026"));
    const std::string kept = cut.substr(0, cut.size() - 3);
    EXPECT_EQ(title.substr(0, kept.size()), kept);
    EXPECT_NE(static_cast<unsigned char>(title[kept.size()]) & 0xc0U, 0x80U) << kept;
  }
}

// A title of any length is written, cut short, beside the arrow; data without times have none.
TEST(Heading, HasLongTitlesAndNoTimeWithoutTimes) {
  Shown shown(scene::atmosphere_grid(), one_scalar(), [](protocol::View& view) {
    view.annotations.title = true;
    view.annotations.step_time = true;
    view.annotations.north = true;
  });
  data::DatasetInfo info = shown.subject().info;
  info.title = std::string(300, 'w');
  info.steps = {{0, "0"}};
  info.time_units.clear();
  const Subject named = shown.subject();
  const Figure figure = figure_of({named.completed, named.scene, info});
  const auto written = texts(figure.above);
  EXPECT_THAT(written, Contains(testing::StartsWith("wwwwww")));
  EXPECT_THAT(written, Not(Contains("0")));
  info.steps = {{7, "7"}};
  EXPECT_THAT(texts(figure_of({named.completed, named.scene, info}).above), Contains("7"));
}

TEST(ScaleBar, HasTheLengthItTells) {
  const Shown shown(scene::atmosphere_grid(), one_scalar(), [](protocol::View& view) {
    view.camera.projection = protocol::Projection::orthographic;
    view.camera.eye = protocol::Vec3{0, 0, 5};
    view.camera.up = protocol::Vec3{0, 1, 0};
  });
  Figure figure = empty_figure(shown);
  add_scale_bar(shown.subject(), style_of(shown.subject()), figure);
  const auto written = texts(figure.above);
  ASSERT_THAT(written, SizeIs(1));
  ASSERT_THAT(written[0], testing::EndsWith(" km"));
  const double km = std::stod(written[0]);
  const auto bars = lines(figure.above);
  ASSERT_THAT(bars, SizeIs(1));
  const double pixels = bars[0].points[2].x - bars[0].points[1].x;
  const auto& y = shown.scene().lattice.positions[1];  // 10 degrees of latitude apart
  const auto south = shown.projector().pixel({0, y[0], 0});
  const auto north = shown.projector().pixel({0, y[1], 0});
  const double of_ten_degrees = south->y - north->y;
  EXPECT_NEAR(km / 1111.95, pixels / of_ten_degrees, 1e-3);
  EXPECT_LE(pixels, 0.22 * 640);
  EXPECT_GE(pixels, 0.22 * 640 / 2.5) << "1, 2 and 5 are at most 2.5 times apart";
}

// A globe's shell is drawn thicker than the atmosphere; its ground is the body within it. In a
// parallel projection the bar is to the radius of the ground's disc as its length to the Earth's.
TEST(ScaleBar, HasTheLengthItTellsOnTheGroundOfAGlobe) {
  for (const double thickness : {0.1, 1.0, 3.0}) {
    const Shown shown(scene::atmosphere_grid(), one_scalar(), [&](protocol::View& view) {
      view.geometry.mapping = protocol::GeometryMapping::sphere;
      view.geometry.scale = protocol::Vec3{1, 1, thickness};
      view.camera.projection = protocol::Projection::orthographic;
      view.camera.eye = protocol::Vec3{0, -5, 0};
      view.camera.target = protocol::Vec3{0, 0, 0};
      view.camera.height = 2.5;
    });
    Figure figure = empty_figure(shown);
    add_scale_bar(shown.subject(), style_of(shown.subject()), figure);
    const auto written = texts(figure.above);
    ASSERT_THAT(written, SizeIs(1));
    const double km = std::stod(written[0]);
    const auto bars = lines(figure.above);
    ASSERT_THAT(bars, SizeIs(1));
    const double pixels = bars[0].points[2].x - bars[0].points[1].x;
    ASSERT_TRUE(shown.scene().body);
    const double disc = shown.scene().body->radius * 480 / 2.5;
    // The body is 0.999 of the ground, so that it lies within the lowest cells.
    EXPECT_NEAR(km / 6371, pixels / disc, 0.002 * pixels / disc) << thickness;
  }
}

TEST(ScaleBar, IsAbsentWithoutALength) {
  data::Grid grid = scene::atmosphere_grid();
  for (std::size_t a = 0; a < 2; ++a) {
    grid.axes[a].kind = data::AxisKind::cartesian;
    grid.axes[a].units = "furlong";
  }
  const Shown shown(grid, one_scalar());
  Figure figure = empty_figure(shown);
  add_scale_bar(shown.subject(), style_of(shown.subject()), figure);
  add_north(shown.subject(), style_of(shown.subject()), figure);
  EXPECT_THAT(figure.above, IsEmpty());
}

// The tip of the arrow relative to its middle.
Point arrow(const Figure& figure) {
  for (const Item& item : figure.above) {
    const Area* const area = std::get_if<Area>(&item);
    if (area == nullptr) continue;
    return {area->points[0].x - area->points[2].x, area->points[0].y - area->points[2].y};
  }
  return {0, 0};
}

TEST(North, FollowsTheGrid) {
  const auto north_of = [](data::Grid grid) {
    const Shown shown(std::move(grid), one_scalar(), [](protocol::View& view) {
      view.camera.eye = protocol::Vec3{0, 0, 5};
      view.camera.up = protocol::Vec3{0, 1, 0};
    });
    Figure figure = empty_figure(shown);
    add_north(shown.subject(), style_of(shown.subject()), figure);
    return arrow(figure);
  };
  const Point up = north_of(scene::atmosphere_grid());
  EXPECT_NEAR(up.x, 0, 1e-9);
  EXPECT_LT(up.y, -1);
  // Rows of a grid turned by 30 degrees: east lies 30 degrees above x, north 30 degrees left of y.
  data::Grid turned;
  turned.axes = {scene::axis(data::AxisKind::cartesian, "km", {0, 100, 200, 300}),
                 scene::axis(data::AxisKind::cartesian, "km", {0, 100, 200, 300}),
                 scene::axis(data::AxisKind::height, "m", {0, 1000})};
  auto columns = std::make_shared<data::Columns>();
  const double a = 30 * scene::radians_per_degree;
  for (int j = 0; j < 4; ++j) {
    for (int i = 0; i < 4; ++i) {
      columns->longitude.push_back(i * std::cos(a) + j * std::sin(a));
      columns->latitude.push_back(-i * std::sin(a) + j * std::cos(a));
    }
  }
  turned.columns = columns;
  const Point north = north_of(turned);
  EXPECT_NEAR(std::atan2(-north.x, -north.y) / scene::radians_per_degree, 30, 0.5)
      << "degrees left of up";
}

TEST(North, IsTheDirectionOfThePoleOnASphere) {
  const Shown shown(scene::atmosphere_grid(), one_scalar(), [](protocol::View& view) {
    view.geometry.mapping = protocol::GeometryMapping::sphere;
  });
  Figure figure = empty_figure(shown);
  add_north(shown.subject(), style_of(shown.subject()), figure);
  const Point to = arrow(figure);
  ASSERT_LT(to.y, -1);
  EXPECT_NEAR(to.x, 0, 1e-6) << "the default view looks along a meridian";
}

TEST(Legend, TellsUnitsLengthsAndWhatIsLeftOut) {
  auto fields = one_scalar();
  fields.push_back(scene::wind_info());
  const Shown shown(scene::atmosphere_grid(), fields, [](protocol::View& view) {
    view.vector.magnitude_range = protocol::Range{0, 40};
    view.vector.min_magnitude = 12.5;
    view.vector.color.by = protocol::ColorBy::magnitude;
    view.vector.color.range = protocol::Range{0, 40};
  });
  Figure figure = empty_figure(shown);
  add_legend(shown.subject(), style_of(shown.subject()), figure);
  const auto written = texts(figure.above);
  EXPECT_THAT(written, Contains("wind: magnitude"));
  EXPECT_THAT(written, Contains("m s\u207b\u00b9"));
  EXPECT_THAT(written, Contains(HasSubstr("longest line 40 m s\u207b\u00b9")));
  EXPECT_THAT(written, Contains(HasSubstr("below 12.5 m s\u207b\u00b9 not drawn")));
  EXPECT_THAT(written, Contains("cloud"));
  EXPECT_THAT(written, Contains("kg m\u207b\u00b3"));
  for (const char* tick : {"0", "10", "20", "30", "40"}) EXPECT_THAT(written, Contains(tick));
}

// Units and names of any length keep their texts upright and within their card.
TEST(Legend, LongUnitsLeaveTheirTextsReadable) {
  std::vector<data::FieldInfo> fields{scene::scalar_info(
      "cloud", std::string("kilograms per cubic metre, ") + std::string(90, 'm'))};
  const Shown shown(scene::atmosphere_grid(), fields, [](protocol::View& view) {
    view.scalars.emplace().push_back({});
    view.scalars->front().field = "cloud";
  });
  Figure figure = empty_figure(shown);
  const Style style = style_of(shown.subject());
  add_legend(shown.subject(), style, figure);
  ASSERT_THAT(texts(figure.above), Contains("cloud"));
  const Rectangle card = figure.taken.front();
  for (const Item& item : figure.above) {
    const Text* text = std::get_if<Text>(&item);
    if (text == nullptr) continue;
    EXPECT_GT(text->size, 0) << text->text;
    if (text->text == "cloud") {
      EXPECT_DOUBLE_EQ(text->size, style.text);
    }
    EXPECT_GE(bounds_of(*text).low.x, card.low.x) << text->text;
    EXPECT_LE(bounds_of(*text).high.x, card.high.x) << text->text;
  }
}

// A medium by height: the ticks are pressures, at the colours of their heights.
TEST(Legend, TellsHeightsInTheCoordinatesOfTheData) {
  std::vector<data::FieldInfo> fields{scene::wind_info()};
  const Shown shown(scene::atmosphere_grid(), fields, [](protocol::View& view) {
    view.vector.color.by = protocol::ColorBy::world_z;
  });
  Figure figure = empty_figure(shown);
  add_legend(shown.subject(), style_of(shown.subject()), figure);
  const auto written = texts(figure.above);
  EXPECT_THAT(written, Contains("wind: pressure"));
  EXPECT_THAT(written, Contains("hPa"));
  EXPECT_THAT(written, Contains("500"));
  EXPECT_THAT(written, Not(Contains("world units")));
}

TEST(Style, ContrastsWithTheBackground) {
  const auto style_on = [](const std::string& background) {
    const Shown shown(scene::atmosphere_grid(), one_scalar(),
                      [&](protocol::View& view) { view.image.background = background; });
    return style_of(shown.subject());
  };
  EXPECT_GT(style_on("#000000").color.red, 0.8);
  EXPECT_LT(style_on("#ffffff").color.red, 0.2);
  EXPECT_GT(style_on("#ffffff").rim.red, 0.8);
}

}  // namespace
}  // namespace windsplat::annotate
