// Sizes and colours of annotations: of all, and of one part.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <variant>
#include <vector>

#include "server/annotate/annotate.hpp"
#include "server/annotate/room.hpp"
#include "tests/unit/annotate/shown.hpp"

namespace windsplat::annotate {
namespace {

// The items of one colour, whatever their opacity.
std::size_t items_of_color(const Figure& figure, double red, double green) {
  const auto is_it = [&](const Item& item) {
    return std::visit(
        [&](const auto& of) {
          if constexpr (requires { of.color; }) {
            return std::abs(of.color.red - red) + std::abs(of.color.green - green) < 0.01;
          } else {
            return false;
          }
        },
        item);
  };
  return static_cast<std::size_t>(std::count_if(figure.above.begin(), figure.above.end(), is_it) +
                                  std::count_if(figure.below.begin(), figure.below.end(), is_it));
}

TEST(Style, OfAPartChangesThatPartAlone) {
  using View = protocol::AnnotationsView;
  using PartStyle = protocol::AnnotationStyleView;
  const std::vector<std::pair<bool View::*, PartStyle View::*>> parts{
      {&View::box, &View::box_style},
      {&View::axes, &View::axes_style},
      {&View::north, &View::north_style},
      {&View::scale_bar, &View::scale_bar_style},
      {&View::legend, &View::legend_style},
      {&View::title, &View::title_style},
      {&View::step_time, &View::step_time_style}};
  const auto shown_with = [](const std::function<void(View&)>& change) {
    const Shown shown(scene::atmosphere_grid(), one_scalar(), [&](protocol::View& view) {
      view.camera.eye = protocol::Vec3{-2, -5, 3};
      view.annotations.text_color = "#00ff00";
      change(view.annotations);
    });
    return figure_of(shown.subject());
  };
  for (const auto& pair : parts) {
    const auto part = pair.first;
    const auto style = pair.second;
    const Figure alone = shown_with([&](View& view) {
      view.*part = true;
      (view.*style).text_color = "#ff0000";
    });
    EXPECT_GT(items_of_color(alone, 1, 0), 0U);
    EXPECT_EQ(items_of_color(alone, 0, 1), 0U);
    const Figure others = shown_with([&](View& view) {
      for (const auto& other : parts) view.*other.first = other.first != part;
      (view.*style).text_color = "#ff0000";
      (view.*style).size = 3;
    });
    EXPECT_EQ(items_of_color(others, 1, 0), 0U);
    EXPECT_GT(items_of_color(others, 0, 1), 0U);
  }
}

TEST(Style, SizesOfPartsMultiplyThatOfAll) {
  const Shown shown(scene::atmosphere_grid(), one_scalar(), [](protocol::View& view) {
    view.annotations.size = 1.5;
    view.annotations.title = true;
    view.annotations.title_text = "own";
    view.annotations.step_time = true;
    view.annotations.title_style.size = 2;
  });
  const Subject subject = shown.subject();
  EXPECT_DOUBLE_EQ(style_of(subject, {2, {}}).text, 2 * style_of(subject).text);
  EXPECT_DOUBLE_EQ(style_of(subject, {4, {}}).text, style_of(subject).text * 4 / 1.5)
      << "the limit";
  const Figure figure = figure_of(subject);
  std::vector<Text> written;
  for (const Item& item : figure.above) {
    if (const Text* text = std::get_if<Text>(&item)) written.push_back(*text);
  }
  ASSERT_EQ(written.size(), 2U);
  EXPECT_EQ(written[0].text, "own");
  EXPECT_DOUBLE_EQ(written[0].size, 1.25 * 2 * style_of(subject).text);
  EXPECT_DOUBLE_EQ(written[1].size, style_of(subject).text);
  EXPECT_LT(bounds_of(written[0]).high.y, bounds_of(written[1]).low.y);
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
