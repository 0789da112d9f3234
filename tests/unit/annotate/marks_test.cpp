// Scale bars, north, legends and colours of figures against closed forms.
#include "server/annotate/marks.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "server/annotate/annotate.hpp"
#include "server/annotate/box.hpp"
#include "server/annotate/legend.hpp"
#include "server/annotate/paint/type.hpp"
#include "server/annotate/projector.hpp"
#include "server/annotate/room.hpp"
#include "server/scene/angles.hpp"
#include "tests/unit/annotate/shown.hpp"

namespace windsplat::annotate {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

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

TEST(Legend, TellsWhereSurfacesAreAndWhatTheirColoursMean) {
  const Shown shown(scene::atmosphere_grid(), one_scalar(), [](protocol::View& view) {
    view.scalars.emplace();
    protocol::SurfaceView surface;
    surface.field = "cloud";
    surface.opacity = 0;
    surface.isovalue = 3;
    view.surfaces.push_back(surface);  // not seen
    surface.opacity = 1;
    surface.isovalue = 12.5;
    view.surfaces.push_back(surface);
    surface.isovalue.reset();
    surface.slice = protocol::SliceView{protocol::GridAxis::z, 1};
    surface.color.range = protocol::Range{0, 40};
    surface.contours = protocol::ContoursView{5, 1, "#000000", {}};
    view.surfaces.push_back(surface);
    surface.contours = protocol::ContoursView{{}, 1, "#000000", {1.25, 33}};
    view.surfaces.push_back(surface);
  });
  Figure figure = empty_figure(shown);
  add_legend(shown.subject(), style_of(shown.subject()), figure);
  const auto written = texts(figure.above);
  EXPECT_THAT(written, Contains("surface where it is 12.5 kg m\u207b\u00b3"));
  EXPECT_THAT(written, testing::Not(Contains(HasSubstr("is 3"))));
  EXPECT_THAT(written, Contains("contours every 5 kg m\u207b\u00b3"));
  EXPECT_THAT(written, Contains("contours at 1.25, 33 kg m\u207b\u00b3"));
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

// The numbers of a strip neither touch each other nor leave the card.
TEST(Legend, LongNumbersHaveRoom) {
  for (const double high : {0.00032, 0.0002, 2e-9, 30000.0, 123456.0, 1.0, 0.07}) {
    std::vector<data::FieldInfo> fields{scene::wind_info()};
    const Shown shown(scene::atmosphere_grid(), fields, [&](protocol::View& view) {
      view.vector.color.by = protocol::ColorBy::magnitude;
      view.vector.color.range = protocol::Range{0, high};
    });
    Figure figure = empty_figure(shown);
    const Style style = style_of(shown.subject());
    add_legend(shown.subject(), style, figure);
    std::vector<Rectangle> numbers;
    for (const Item& item : figure.above) {
      const Text* text = std::get_if<Text>(&item);
      if (text != nullptr && text->align == 0.5) numbers.push_back(bounds_of(*text));
    }
    ASSERT_GE(numbers.size(), 3U) << high;
    const Rectangle card = figure.taken.front();
    EXPECT_GE(numbers.front().low.x, card.low.x) << high;
    EXPECT_LE(numbers.back().high.x, card.high.x) << high;
    for (std::size_t n = 1; n < numbers.size(); ++n) {
      EXPECT_GT(numbers[n].low.x - numbers[n - 1].high.x, 0.2 * style.text) << high;
    }
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

TEST(Legend, NeverTellsWorldUnits) {
  using protocol::ColorBy;
  for (const ColorBy by : {ColorBy::screen_z, ColorBy::rise, ColorBy::world_z}) {
    std::vector<data::FieldInfo> fields{scene::wind_info()};
    const Shown shown(scene::atmosphere_grid(), fields, [&](protocol::View& view) {
      view.vector.color.by = by;
      view.geometry.vertical = protocol::VerticalPlacement::index;
    });
    Figure figure = empty_figure(shown);
    add_legend(shown.subject(), style_of(shown.subject()), figure);
    EXPECT_THAT(texts(figure.above), Not(Contains(HasSubstr("world unit"))));
    if (by == ColorBy::screen_z) {
      EXPECT_THAT(texts(figure.above), Contains(HasSubstr("from near to far")));
    }
  }
}

// Lines that are dimmed or whitened do not have the colours of the strip.
TEST(Legend, TellsHowLinesDifferFromTheirColors) {
  const auto written = [](bool true_colors) {
    std::vector<data::FieldInfo> fields{scene::wind_info()};
    const Shown shown(scene::atmosphere_grid(), fields, [&](protocol::View& view) {
      view.vector.color.by = protocol::ColorBy::magnitude;
      view.vector.color.true_colors = true_colors;
    });
    Figure figure = empty_figure(shown);
    add_legend(shown.subject(), style_of(shown.subject()), figure);
    return texts(figure.above);
  };
  EXPECT_THAT(written(false), Contains("weaker and farther lines are darker"));
  EXPECT_THAT(written(false), Contains(HasSubstr("white end ahead")));
  EXPECT_THAT(written(true), Not(Contains(HasSubstr("darker"))));
  EXPECT_THAT(written(true), Not(Contains(HasSubstr("white end ahead"))));
}

// Triangles at the ends of a strip, left and right, beyond which values lie.
std::array<int, 2> arrows(const Figure& figure) {
  std::array<int, 2> out{};
  double strip = 0;
  for (const Item& item : figure.above) {
    if (const Strip* colors = std::get_if<Strip>(&item)) strip = colors->corner.x;
    const Area* area = std::get_if<Area>(&item);
    if (area == nullptr || area->points.size() != 3) continue;
    ++out.at(area->points[1].x < strip ? 0 : 1);
  }
  return out;
}

// Issue 22: a legend ended at 50 where the jet is 84 and did not say that larger values exist.
TEST(Legend, MarksTheEndsBeyondWhichValuesLie) {
  const auto marked = [](double low, double high) {
    std::vector<data::FieldInfo> fields{scene::wind_info()};
    const Shown shown(scene::atmosphere_grid(), fields, [&](protocol::View& view) {
      view.vector.min_magnitude = 0;
      view.vector.color.by = protocol::ColorBy::magnitude;
      view.vector.color.range = protocol::Range{low, high};
    });
    Figure figure = empty_figure(shown);
    add_legend(shown.subject(), style_of(shown.subject()), figure);
    return arrows(figure);
  };
  EXPECT_EQ(marked(0, 1e-3), (std::array{0, 1}));
  EXPECT_EQ(marked(1e-3, 0), (std::array{0, 1})) << "its colours are reversed, not the strip";
  EXPECT_EQ(marked(0, 1e6), (std::array{0, 0}));
}

// Sample n of 36 has the components n, n + 100 and n + 200: 13 of them have more than 255.
TEST(Legend, TellsHowManyLinesLieBeyondItsColors) {
  const auto written = [](double high) {
    std::vector<data::FieldInfo> fields{scene::wind_info()};
    const Shown shown(scene::atmosphere_grid(), fields, [&](protocol::View& view) {
      view.vector.min_magnitude = 0;
      view.vector.color.by = protocol::ColorBy::magnitude;
      view.vector.color.range = protocol::Range{0, high};
    });
    Figure figure = empty_figure(shown);
    add_legend(shown.subject(), style_of(shown.subject()), figure);
    return texts(figure.above);
  };
  EXPECT_THAT(written(255), Contains("36 % of the lines lie beyond"));
  EXPECT_THAT(written(1e3), Not(Contains(HasSubstr("lie beyond"))));
}

TEST(Legend, OfLinesThroughSeedsTellsNothingOfAllSamples) {
  std::vector<data::FieldInfo> fields{scene::wind_info()};
  const Shown shown(scene::atmosphere_grid(), fields, [&](protocol::View& view) {
    view.vector.min_magnitude = 0;
    view.vector.color.by = protocol::ColorBy::magnitude;
    view.vector.color.range = protocol::Range{0, 255};
    view.vector.trace.emplace().seeds.emplace();
  });
  Figure figure = empty_figure(shown);
  add_legend(shown.subject(), style_of(shown.subject()), figure);
  EXPECT_THAT(texts(figure.above), Contains("wind: magnitude"));
  EXPECT_THAT(texts(figure.above), Not(Contains(HasSubstr("lie beyond"))));
  EXPECT_THAT(texts(figure.above), Not(Contains(HasSubstr("longest line"))));
}

// Values of t are n: a layer of it shows a part of them.
TEST(Legend, MarksTheEndsBeyondWhichASurfaceHasValues) {
  const auto marked = [](double low, double high, bool section) {
    const Shown shown(scene::atmosphere_grid(), one_scalar(), [&](protocol::View& view) {
      view.scalars.emplace();
      protocol::SurfaceView surface;
      surface.field = "cloud";
      if (section) {
        surface.slice = protocol::SliceView{protocol::GridAxis::z, 1};
      } else {
        surface.isovalue = 17;
        surface.color.field = "cloud";
      }
      surface.color.range = protocol::Range{low, high};
      view.surfaces.push_back(surface);
    });
    Figure figure = empty_figure(shown);
    add_legend(shown.subject(), style_of(shown.subject()), figure);
    return arrows(figure);
  };
  EXPECT_EQ(marked(12, 23, true), (std::array{0, 0})) << "values of other layers do not count";
  EXPECT_EQ(marked(12, 20, true), (std::array{0, 1}));
  EXPECT_EQ(marked(15, 23, true), (std::array{1, 0}));
  EXPECT_EQ(marked(23, 15, true), (std::array{1, 0})) << "its colours are reversed, not the strip";
  EXPECT_EQ(marked(0, 16, false), (std::array{0, 1})) << "the value of the isosurface";
  EXPECT_EQ(marked(16, 18, false), (std::array{0, 0}));
}

// Values that are transparent at that end are not drawn.
TEST(Legend, MarksNoEndBeyondWhichAMediumIsTransparent) {
  const auto marked = [](double low_extinction) {
    const Shown shown(scene::atmosphere_grid(), one_scalar(), [&](protocol::View& view) {
      view.scalars.emplace().push_back({});
      view.scalars->front().field = "cloud";
      view.scalars->front().color.range = protocol::Range{1e6, 2e6};
      view.scalars->front().extinction = {{1e6, low_extinction}, {2e6, 5}};
    });
    Figure figure = empty_figure(shown);
    add_legend(shown.subject(), style_of(shown.subject()), figure);
    return arrows(figure);
  };
  EXPECT_EQ(marked(1), (std::array{1, 0}));
  EXPECT_EQ(marked(0), (std::array{0, 0}));
}

}  // namespace
}  // namespace windsplat::annotate
