// Texts -> glyphs of the embedded font (DejaVu Sans), shaped by HarfBuzz.
#pragma once

#include <cairo/cairo.h>

#include <string>
#include <string_view>
#include <vector>

#include "server/annotate/figure.hpp"

namespace windsplat::annotate {

// Pixels from the start of a text to its end. Safe to call concurrently.
double width_of(std::string_view text, double size);

// The first character for which the font has no glyph; empty: it
// has all. Safe to call concurrently.
std::string character_without_glyph(std::string_view text);

// Draws a text with its outline in user space of `target`. Where a document keeps texts (PDF), it
// can be searched and copied. Safe to call concurrently.
void draw_text(cairo_t* target, const Text& text);

}  // namespace windsplat::annotate
