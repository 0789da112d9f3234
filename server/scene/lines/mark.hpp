// Widths and marks of lines in pixels; marks show their direction and their order in depth.
#pragma once

#include <string>

#include "protocol/view.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// Whether nine tenths of the colours of lines change visibly if they are whitened as by default.
bool shows_white_heads(const protocol::VectorColorView& color);

// Fills in how heads and tails are told apart: white heads, or dark tails where lines keep the hue
// of the map. Plain lines do so by default over a dark background in colours that hardly change if
// they are whitened. The colours of the lines must be known.
void complete_heads(protocol::VectorView& vector, const std::string& background);

// Changes the lines of a completed view to the colours of the map.
void draw_true_colors(protocol::VectorView& completed);

// Line radii in pixels of this picture. A line thinner than the pixel filter is drawn with the
// width of the filter and less opacity: with the half width h = (r1 + r2) / 2, r1 = max(0, h -
// 1/2), r2 = max(1, h + 1/2), opacity times min(1, 2 h).
void set_radii(const protocol::VectorView& from, int height, VectorLayer& layer);

// The mark of the lines of a completed view, in a picture of this height.
LineMark mark_of(const protocol::VectorView& from, int height);

}  // namespace windsplat::scene
