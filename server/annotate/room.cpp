#include "server/annotate/room.hpp"

#include <algorithm>
#include <utility>

#include "server/annotate/paint/type.hpp"

namespace windsplat::annotate {
namespace {

bool overlap(const Rectangle& a, const Rectangle& b) {
  return a.low.x < b.high.x && b.low.x < a.high.x && a.low.y < b.high.y && b.low.y < a.high.y;
}

}  // namespace

Rectangle bounds_of(const Text& text) {
  constexpr double ascent = 0.8;   // em
  constexpr double descent = 0.2;  // em
  const double width = width_of(text.text, text.size);
  const double left = text.at.x - text.align * width;
  return {{left, text.at.y - ascent * text.size}, {left + width, text.at.y + descent * text.size}};
}

bool move_inside(const Figure& figure, Text& text) {
  const Rectangle box = bounds_of(text);
  const double width = box.high.x - box.low.x;
  const double height = box.high.y - box.low.y;
  if (width > figure.width || height > figure.height) return false;
  text.at.x += std::clamp(box.low.x, 0.0, figure.width - width) - box.low.x;
  text.at.y += std::clamp(box.low.y, 0.0, figure.height - height) - box.low.y;
  return true;
}

bool add_if_free(Text text, Figure& figure) {
  const Rectangle box = bounds_of(text);
  const bool inside =
      box.low.x >= 0 && box.low.y >= 0 && box.high.x <= figure.width && box.high.y <= figure.height;
  if (!inside || std::any_of(figure.taken.begin(), figure.taken.end(),
                             [&](const Rectangle& other) { return overlap(box, other); })) {
    return false;
  }
  figure.taken.push_back(box);
  figure.above.emplace_back(std::move(text));
  return true;
}

}  // namespace windsplat::annotate
