// Where texts may still be written.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "server/annotate/figure.hpp"

namespace windsplat::annotate {

// The part of a straight line of pixels within the picture and `margin` pixels around it; nullopt:
// none.
std::optional<std::array<Point, 2>> visible_part(const Figure& figure,
                                                 const std::array<Point, 2>& ends, double margin);

// A text, cut short with an ellipsis where it is wider than `room` pixels at its size; empty: not
// even that fits.
std::string fitted(std::string text, double size, double room);

// The rectangle of a text, from its ascent to its descent.
Rectangle bounds_of(const Text& text);

// Moves a text so that it lies within the picture, half an em from its edges. False: no room.
bool move_inside(const Figure& figure, Text& text);

// Whether something else is written at a point.
bool is_taken(const Figure& figure, const Point& at);

// Whether a text lies within the picture and meets no rectangle taken.
bool is_free(const Text& text, const Figure& figure);

// Adds a text over the picture if it is free. Its rectangle is taken then.
bool add_if_free(Text text, Figure& figure);

// Rectangles by the cells of a grid over the picture that they meet, for many of them: those taken
// of the figure, and those added.
class Occupied {
 public:
  // cell: width of a cell in pixels, best about that of the rectangles.
  Occupied(const Figure& figure, double cell);

  void add(const Rectangle& one);
  // Whether one of them overlaps; an edge in common is none.
  [[nodiscard]] bool meets(const Rectangle& one) const;

 private:
  [[nodiscard]] std::size_t count_of(int pixels) const;
  [[nodiscard]] std::array<std::size_t, 2> cells_between(double low, double high,
                                                         std::size_t count) const;

  double cell_;
  std::size_t columns_, rows_;
  std::vector<std::vector<Rectangle>> cells_;  // row by row
};

}  // namespace windsplat::annotate
