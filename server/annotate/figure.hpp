// What is drawn over and under a picture, in pixels of that picture and independent of a device:
// the same figure is painted into pixels (paint/overlay.hpp), SVG and PDF
// (paint/document.hpp).
#pragma once

#include <string>
#include <variant>
#include <vector>

namespace windsplat::annotate {

// sRGB in [0, 1], not premultiplied.
struct Color {
  double red = 1, green = 1, blue = 1, alpha = 1;
};

// Pixels from the upper left corner of the picture; y points down.
struct Point {
  double x = 0, y = 0;
};

struct Rectangle {
  Point low, high;  // upper left and lower right corner
};

struct Line {
  std::vector<Point> points;
  double width = 1;  // pixels
  Color color;
};

struct Area {
  std::vector<Point> points;
  Color color;
};

// A rectangle of colours in equal steps from left to right.
struct Strip {
  Point corner;  // upper left
  double width = 0, height = 0;
  std::vector<Color> colors;
};

// `align` is the fraction of its width that lies left of `at`, which is on the baseline. It is
// turned about `at`.
struct Text {
  std::string text;  // UTF-8
  Point at;
  double size = 12;  // em, pixels
  double align = 0;
  Color color;
  Color rim;        // of its outline
  double turn = 0;  // clockwise, radians
};

using Item = std::variant<Line, Area, Strip, Text>;

struct Figure {
  int width = 0;
  int height = 0;
  std::vector<Item> below;  // hidden by the data; no texts
  std::vector<Item> above;
  std::vector<Rectangle> taken;  // where no other text is written
};

}  // namespace windsplat::annotate
