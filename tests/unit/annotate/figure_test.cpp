// Figures against the camera, the engine's pixels and closed forms.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
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
#include "tests/unit/annotate/shown.hpp"

namespace windsplat::annotate {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

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

// Of the default camera: the box lies above a row of cards, within the picture.
TEST(Axes, AreFramedAboveTheLegend) {
  for (const auto projection :
       {protocol::Projection::perspective, protocol::Projection::orthographic}) {
    for (const auto& [width, height] : {std::array{640, 480}, {1280, 720}, {480, 800}}) {
      for (const double tall : {0.2, 1.0, 8.0}) {
        auto fields = one_scalar();
        fields.push_back(scene::wind_info());
        const int across = width;
        const int down = height;
        const Shown shown(scene::atmosphere_grid(), fields, [&](protocol::View& view) {
          view.camera.projection = projection;
          view.image.width = across;
          view.image.height = down;
          view.geometry.scale = {1, 1, tall};
          view.annotations.axes = true;
          view.annotations.legend = true;
          view.scalars.emplace();
        });
        Figure legend = empty_figure(shown);
        add_legend(shown.subject(), style_of(shown.subject()), legend);
        ASSERT_THAT(legend.taken, SizeIs(1));
        const scene::Lattice& lattice = shown.scene().lattice;
        for (int n = 0; n < 8; ++n) {
          const auto at =
              shown.projector().pixel({(n & 1) != 0 ? lattice.box_max.x : lattice.box_min.x,
                                       (n & 2) != 0 ? lattice.box_max.y : lattice.box_min.y,
                                       (n & 4) != 0 ? lattice.box_max.z : lattice.box_min.z});
          ASSERT_TRUE(at);
          EXPECT_LT(at->y, legend.taken.front().low.y) << width << ' ' << height << ' ' << tall;
          EXPECT_GT(at->y, 0) << width << ' ' << height << ' ' << tall;
        }
      }
    }
  }
}

// A map of one layer, which is faced.
TEST(Axes, OfOneLayerAreFramedAboveTheLegend) {
  for (const auto projection :
       {protocol::Projection::perspective, protocol::Projection::orthographic}) {
    data::Grid grid = scene::atmosphere_grid();
    grid.axes[0].coordinates = {0, 3, 6, 9};
    grid.axes[2].coordinates = {500};
    const Shown shown(grid, one_scalar(), [&](protocol::View& view) {
      view.camera.projection = projection;
      view.annotations.axes = true;
      view.annotations.legend = true;
    });
    Figure legend = empty_figure(shown);
    add_legend(shown.subject(), style_of(shown.subject()), legend);
    ASSERT_THAT(legend.taken, SizeIs(1));
    const scene::Lattice& lattice = shown.scene().lattice;
    double lowest = 0;
    for (int n = 0; n < 4; ++n) {
      const auto at = shown.projector().pixel({(n & 1) != 0 ? lattice.box_max.x : lattice.box_min.x,
                                               (n & 2) != 0 ? lattice.box_max.y : lattice.box_min.y,
                                               lattice.positions[2][0]});
      ASSERT_TRUE(at);
      EXPECT_LT(at->y, legend.taken.front().low.y);
      EXPECT_GT(at->y, 0);
      lowest = std::max(lowest, at->y);
    }
    EXPECT_GT(lowest, 0.6 * legend.taken.front().low.y) << "it fills the part above";
  }
}

TEST(Axes, HaveNoTicksWhereSomethingElseIsWritten) {
  const Shown shown(scene::atmosphere_grid(), one_scalar(),
                    [](protocol::View& view) { view.annotations.axes = true; });
  Figure figure = empty_figure(shown);
  figure.taken.push_back({{0, 0}, {640, 480}});
  add_axes(shown.subject(), style_of(shown.subject()), figure);
  EXPECT_THAT(figure.above, IsEmpty());
}

// The place in the box where the tick of a latitude of zero begins, from two candidates.
bool equator_is_at(const Shown& shown, double x, double z) {
  const auto at = shown.projector().pixel({x, shown.scene().lattice.positions[1][1], z});
  const Figure figure = figure_of(shown.subject());
  for (std::size_t n = 0; at && n + 1 < figure.above.size(); ++n) {
    const Line* const mark = std::get_if<Line>(&figure.above[n]);
    const Text* const text = std::get_if<Text>(&figure.above[n + 1]);
    if (mark == nullptr || text == nullptr || text->text != "0\u00b0") continue;
    const Point& from = mark->points.front();
    if (std::hypot(from.x - at->x, from.y - at->y) < 1e-6) return true;
  }
  return false;
}

// Latitudes lead to places on the ground: they are labelled at the floor of a box, unless labels
// there would lie over its sides. Longitudes begin at 10 degrees, so that only one zero is written.
TEST(Axes, OfTheGroundAreLabelledAtTheFloorWhereTheOutlineIsNear) {
  data::Grid grid = scene::atmosphere_grid();
  for (double& longitude : grid.axes[0].coordinates) longitude += 10;
  const auto seen = [&grid](const protocol::Vec3& eye, double tall) {
    return Shown(grid, one_scalar(), [&](protocol::View& view) {
      view.annotations.axes = true;
      view.camera.eye = eye;
      view.geometry.scale = {1, 1, tall};
    });
  };
  for (const auto& [eye, tall] : {std::pair(protocol::Vec3{0, -3, 2}, 0.15),
                                  {protocol::Vec3{3, -3, 2}, 0.15},
                                  {protocol::Vec3{3, -3, 2}, 3.0}}) {
    const Shown shown = seen(eye, tall);
    const scene::Lattice& lattice = shown.scene().lattice;
    EXPECT_TRUE(equator_is_at(shown, lattice.box_max.x, lattice.box_min.z)) << eye[0] << tall;
  }
  const Shown high = seen({0, -2.5, 3}, 6);
  const scene::Lattice& lattice = high.scene().lattice;
  EXPECT_FALSE(equator_is_at(high, lattice.box_min.x, lattice.box_min.z) ||
               equator_is_at(high, lattice.box_max.x, lattice.box_min.z));
  EXPECT_TRUE(equator_is_at(high, lattice.box_min.x, lattice.box_max.z) ||
              equator_is_at(high, lattice.box_max.x, lattice.box_max.z));
}

// Seen from the south and above, latitudes of a high box are labelled at its top; a line on the
// side behind the data leads from each label to the bottom, where the ground is.
TEST(Axes, LinesLeadFromTheirTicksToTheGround) {
  const auto from_south = [](bool box) {
    return [box](protocol::View& view) {
      view.annotations.axes = true;
      view.annotations.box = box;
      view.camera.eye = protocol::Vec3{0, -3, 2};
    };
  };
  const Shown shown(scene::atmosphere_grid(), one_scalar(), from_south(true));
  const scene::Lattice& lattice = shown.scene().lattice;
  const double equator = lattice.positions[1][1];  // of the latitudes -10, 0, 10
  for (const double side : {lattice.box_min.x, lattice.box_max.x}) {
    const auto top = shown.projector().pixel({side, equator, lattice.box_max.z});
    const auto bottom = shown.projector().pixel({side, equator, lattice.box_min.z});
    ASSERT_TRUE(top && bottom);
    const auto leads = [&](const Line& line) {
      const auto near = [](const Point& a, const Point& b) {
        return std::hypot(a.x - b.x, a.y - b.y) < 1e-6;
      };
      return line.points.size() == 2 && near(line.points[0], *bottom) && near(line.points[1], *top);
    };
    EXPECT_THAT(lines(figure_of(shown.subject()).below), Contains(testing::Truly(leads)));
  }
  const Shown bare(scene::atmosphere_grid(), one_scalar(), from_south(false));
  EXPECT_THAT(figure_of(bare.subject()).below, IsEmpty()) << "without a box";
}

// A steep box of a small region: the latitudes are foreshortened to a few lines of text.
TEST(Axes, AShortOneOfLatitudesNamesDegrees) {
  data::Grid grid = scene::atmosphere_grid();
  for (const std::vector<double>& rows :
       {std::vector<double>{30.9, 44.4, 57.9, 71.4}, {41, 44, 47, 50}}) {
    grid.axes[1].coordinates = rows;
    const Shown shown(grid, one_scalar(), [](protocol::View& view) {
      view.annotations.axes = true;
      view.camera.eye = protocol::Vec3{0, -3, 1};
      view.geometry.scale = {1, 0.6, 2};
    });
    const auto written = texts(figure_of(shown.subject()).above);
    const auto north = std::count_if(written.begin(), written.end(), [](const std::string& text) {
      return text.find("\u00b0N") != std::string::npos;
    });
    EXPECT_GE(north, 2) << rows.front();
  }
}

// An edge of 30 pixels has no room for round values: it has those of its outermost samples.
TEST(Axes, AShortVerticalOneHasItsEnds) {
  data::Grid grid = scene::atmosphere_grid();
  grid.axes[2] = scene::axis(data::AxisKind::height, "m", {120, 340, 870});
  const Shown shown(grid, one_scalar(), [](protocol::View& view) {
    view.annotations.axes = true;
    view.camera.eye = protocol::Vec3{-1, -5, 1};
    view.geometry.scale = {1, 1, 0.5};
  });
  const auto written = texts(figure_of(shown.subject()).above);
  EXPECT_THAT(written, Contains("120"));
  EXPECT_THAT(written, Contains("870"));
  EXPECT_THAT(written, Contains("height (m)"));
}

// Flat boxes of levels of pressure: where the value of one end has no room beside a longitude,
// another one is written.
TEST(Axes, AShortLogarithmicOneHasTwoValues) {
  data::Grid grid = scene::atmosphere_grid();
  grid.axes[0].coordinates = {-180, -90, 0, 90, 180};
  grid.axes[1].coordinates = {-90, -45, 0, 45, 90};
  int seen = 0;
  for (const std::vector<double>& levels :
       {std::vector<double>{1000, 850, 700, 500, 300, 200, 100, 50, 20, 10},
        {1000, 500, 100},
        {925, 700, 400, 100},
        {300, 200, 100}}) {
    grid.axes[2].coordinates = levels;
    for (const double tall : {0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.5, 0.7, 1.0, 1.5}) {
      for (const double height : {1.5, 2.0, 2.5, 3.0, 3.5}) {
        const Shown shown(grid, one_scalar(), [&](protocol::View& view) {
          view.annotations.axes = true;
          view.image.width = 900;
          view.image.height = 600;
          view.camera.eye = protocol::Vec3{0, -2.2, height};
          view.geometry.scale = {1, 1, tall};
        });
        const scene::Lattice& lattice = shown.scene().lattice;
        const auto low = shown.projector().pixel(lattice.box_min);
        const auto high =
            shown.projector().pixel({lattice.box_min.x, lattice.box_min.y, lattice.box_max.z});
        ASSERT_TRUE(low && high);
        const double em = style_of(shown.subject()).text;
        if (std::hypot(high->x - low->x, high->y - low->y) < 3.5 * em) continue;
        if (std::min(high->x, low->x) < 5 * em || low->y > 600 - 4 * em) continue;
        const auto written = texts(figure_of(shown.subject()).above);
        const auto pressures =
            std::count_if(written.begin(), written.end(), [](const std::string& text) {
              return std::isdigit(static_cast<unsigned char>(text.front())) != 0 &&
                     text.find("\u00b0") == std::string::npos;
            });
        EXPECT_GE(pressures, 2) << levels.size() << " levels, scale " << tall << ' ' << height;
        EXPECT_THAT(written, Contains("pressure (hPa)")) << tall << ' ' << height;
        ++seen;
      }
    }
  }
  EXPECT_GT(seen, 30);
}

TEST(Axes, OfMapProjectionsAreInKilometres) {
  data::Grid grid = scene::atmosphere_grid();
  grid.axes[0] = scene::axis(data::AxisKind::cartesian, "m", {-4e6, -2e6, 0, 2e6});
  grid.axes[1] = scene::axis(data::AxisKind::cartesian, "m", {0, 40e3, 80e3});
  const Shown shown(grid, one_scalar(), [](protocol::View& view) {
    view.annotations.axes = true;
    view.camera.eye = protocol::Vec3{-2, -5, 2};
    view.geometry.scale = {1, 40, 1};
  });
  const auto written = texts(figure_of(shown.subject()).above);
  EXPECT_THAT(written, Contains("\u22122000"));
  EXPECT_THAT(written, Contains(HasSubstr("(km)")));
  EXPECT_THAT(written, Contains(HasSubstr("(m)"))) << "samples within 100 km";
  const auto map = axis_map(shown.subject(), 0);
  EXPECT_NEAR(map->position(-2000), shown.scene().lattice.positions[0][1], 1e-12);
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
        show_all(view.annotations);
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

}  // namespace
}  // namespace windsplat::annotate
