// What the legend says of where sections lie.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/annotate/legend.hpp"
#include "server/annotate/section_text.hpp"
#include "tests/unit/annotate/shown.hpp"

namespace windsplat::annotate {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

// Layers of surfaces and of the whole view, and planes, in the coordinates of the data.
TEST(Legend, TellsWhereSectionsLie) {
  using protocol::GridAxis;
  using protocol::PlaneView;
  using protocol::SliceView;
  const auto texts_of = [](const std::function<void(protocol::View&)>& change) {
    const Shown shown(scene::atmosphere_grid(), one_scalar(), change);
    Figure figure = empty_figure(shown);
    add_legend(shown.subject(), style_of(shown.subject()), figure);
    return texts(figure.above);
  };
  const auto of_surface = [&](std::optional<SliceView> slice, std::optional<PlaneView> plane) {
    return texts_of([&](protocol::View& view) {
      view.scalars.emplace();
      protocol::SurfaceView& surface = view.surfaces.emplace_back();
      surface.field = "cloud";
      surface.slice = slice;
      surface.plane = plane;
    });
  };
  EXPECT_THAT(of_surface(SliceView{GridAxis::z, 1}, {}), Contains("section at 500 hPa"));
  // Midway in the logarithm of pressure, as the box places levels.
  EXPECT_THAT(of_surface(SliceView{GridAxis::z, 0.5}, {}), Contains("section at 707.11 hPa"));
  EXPECT_THAT(of_surface(SliceView{GridAxis::x, 1}, {}), Contains("section at 10\u00b0E"));
  EXPECT_THAT(of_surface(SliceView{GridAxis::y, 0.25}, {}), Contains("section at 7.5\u00b0S"));
  // The middle of the box is the equator; longitudes are 0 to 30.
  EXPECT_THAT(of_surface({}, PlaneView{{0, 0, 0}, {0, 2, 0}}), Contains("section at 0\u00b0"));
  EXPECT_THAT(of_surface({}, PlaneView{{0, 0, 0}, {1, 1, 0}}),
              Contains("vertical section through 15\u00b0E, 0\u00b0"));
  EXPECT_THAT(of_surface({}, PlaneView{{0, 0, 0}, {1, 0, 1}}),
              Contains("oblique section through 15\u00b0E, 0\u00b0, 500 hPa"));
  const auto of_view = [&](const std::function<void(protocol::View&)>& change) {
    return texts_of(change);
  };
  EXPECT_THAT(of_view([](protocol::View& view) {
                view.geometry.slice = SliceView{GridAxis::z, 2};
              }),
              Contains("section at 250 hPa"));
  EXPECT_THAT(of_view([](protocol::View& view) {
                view.geometry.plane = PlaneView{{0, 0, 0}, {0, 0, 1}};
              }),
              Contains("section at 500 hPa"));
  EXPECT_THAT(of_view([](protocol::View&) {}), Not(Contains(HasSubstr("section"))));
}

// Values of the field are those of a float at each sample, below a thousand.
TEST(Legend, TellsWhichIsosurfaceIsEmpty) {
  const auto texts_of = [](double isovalue) {
    const Shown shown(scene::atmosphere_grid(), one_scalar(), [&](protocol::View& view) {
      protocol::SurfaceView& surface = view.surfaces.emplace_back();
      surface.field = "cloud";
      surface.isovalue = isovalue;
    });
    Figure figure = empty_figure(shown);
    add_legend(shown.subject(), style_of(shown.subject()), figure);
    return texts(figure.above);
  };
  EXPECT_THAT(texts_of(5000), Contains("nothing of it lies in the data shown"));
  EXPECT_THAT(texts_of(12.5), Not(Contains("nothing of it lies in the data shown")));
}

TEST(Legend, TellsWhereASectionOfOtherGridsLies) {
  using protocol::GridAxis;
  using protocol::SliceView;
  const auto texts_of = [](const data::Grid& grid, const SliceView& slice,
                           protocol::GeometryMapping mapping = protocol::GeometryMapping::flat) {
    const Shown shown(grid, one_scalar(), [&](protocol::View& view) {
      view.scalars.emplace();
      view.geometry.mapping = mapping;
      protocol::SurfaceView& surface = view.surfaces.emplace_back();
      surface.field = "cloud";
      surface.slice = slice;
    });
    Figure figure = empty_figure(shown);
    add_legend(shown.subject(), style_of(shown.subject()), figure);
    return texts(figure.above);
  };
  data::Grid metres = scene::atmosphere_grid();
  metres.axes[0] = scene::axis(data::AxisKind::cartesian, "m", {-4e6, -2e6, 0, 2e6});
  metres.axes[0].name = "x";
  metres.axes[2] = scene::axis(data::AxisKind::height, "m", {120, 340, 870});
  EXPECT_THAT(texts_of(metres, {GridAxis::x, 1}), Contains("section at x = \u22122000 km"));
  EXPECT_THAT(texts_of(metres, {GridAxis::z, 2}), Contains("section at height 870 m"));
  EXPECT_THAT(
      texts_of(scene::atmosphere_grid(), {GridAxis::z, 1}, protocol::GeometryMapping::sphere),
      Contains("section at 500 hPa"));
}

}  // namespace
}  // namespace windsplat::annotate
