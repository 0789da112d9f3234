// Where texts may still be written.
#pragma once

#include "server/annotate/figure.hpp"

namespace windsplat::annotate {

// The rectangle of a text, from its ascent to its descent.
Rectangle bounds_of(const Text& text);

// Moves a text so that it lies within the picture. False: it is larger than the picture.
bool move_inside(const Figure& figure, Text& text);

// Adds a text over the picture if it lies within the picture and no rectangle taken. Its own is
// taken then.
bool add_if_free(Text text, Figure& figure);

}  // namespace windsplat::annotate
