// Where texts may still be written.
#pragma once

#include <array>
#include <optional>
#include <string>

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

// Adds a text over the picture if it lies within the picture and no rectangle taken. Its own is
// taken then.
bool add_if_free(Text text, Figure& figure);

}  // namespace windsplat::annotate
