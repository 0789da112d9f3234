#include "server/annotate/room.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/annotate/paint/type.hpp"

namespace windsplat::annotate {
namespace {

bool overlap(const Rectangle& a, const Rectangle& b) {
  return a.low.x < b.high.x && b.low.x < a.high.x && a.low.y < b.high.y && b.low.y < a.high.y;
}

}  // namespace

std::optional<std::array<Point, 2>> visible_part(const Figure& figure,
                                                 const std::array<Point, 2>& ends, double margin) {
  const Point by{ends[1].x - ends[0].x, ends[1].y - ends[0].y};
  // Shares of the line (Liang and Barsky 1984, doi:10.1145/357332.357333).
  double first = 0;
  double last = 1;
  const auto keep = [&](double from, double step, double low, double high) {
    if (step == 0) return from >= low && from <= high;
    const double enters = ((step > 0 ? low : high) - from) / step;
    const double leaves = ((step > 0 ? high : low) - from) / step;
    first = std::max(first, enters);
    last = std::min(last, leaves);
    return first <= last;
  };
  if (!keep(ends[0].x, by.x, -margin, figure.width + margin)) return std::nullopt;
  if (!keep(ends[0].y, by.y, -margin, figure.height + margin)) return std::nullopt;
  return std::array{Point{ends[0].x + first * by.x, ends[0].y + first * by.y},
                    Point{ends[0].x + last * by.x, ends[0].y + last * by.y}};
}

std::string fitted(std::string text, double size, double room) {
  if (width_of(text, size) <= room) return text;
  static constexpr const char* ellipsis = "\u2026";
  const auto continues = [&](std::size_t at) {
    return at < text.size() && (static_cast<unsigned char>(text[at]) & 0xc0U) == 0x80U;
  };
  const auto cut = [&](std::size_t length) {
    while (length > 0 && continues(length)) --length;
    return text.substr(0, length) + ellipsis;
  };
  std::size_t fits = 0;
  std::size_t too_long = text.size();
  while (too_long - fits > 1) {
    const std::size_t middle = fits + (too_long - fits) / 2;
    (width_of(cut(middle), size) <= room ? fits : too_long) = middle;
  }
  std::string out = cut(fits);
  return width_of(out, size) <= room ? out : std::string();
}

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
  const double margin = 0.5 * text.size;
  if (width + 2 * margin > figure.width || height + 2 * margin > figure.height) return false;
  text.at.x += std::clamp(box.low.x, margin, figure.width - margin - width) - box.low.x;
  text.at.y += std::clamp(box.low.y, margin, figure.height - margin - height) - box.low.y;
  return true;
}

bool is_taken(const Figure& figure, const Point& at) {
  return std::any_of(figure.taken.begin(), figure.taken.end(), [&at](const Rectangle& other) {
    return other.low.x <= at.x && at.x <= other.high.x && other.low.y <= at.y &&
           at.y <= other.high.y;
  });
}

bool is_free(const Text& text, const Figure& figure) {
  const Rectangle box = bounds_of(text);
  const bool inside =
      box.low.x >= 0 && box.low.y >= 0 && box.high.x <= figure.width && box.high.y <= figure.height;
  return inside && std::none_of(figure.taken.begin(), figure.taken.end(),
                                [&](const Rectangle& other) { return overlap(box, other); });
}

bool add_if_free(Text text, Figure& figure) {
  if (!is_free(text, figure)) return false;
  figure.taken.push_back(bounds_of(text));
  figure.above.emplace_back(std::move(text));
  return true;
}

Occupied::Occupied(const Figure& figure, double cell)
    : cell_(std::max(cell, 1.0)),
      columns_(count_of(figure.width)),
      rows_(count_of(figure.height)),
      cells_(columns_ * rows_) {
  for (const Rectangle& one : figure.taken) add(one);
}

std::size_t Occupied::count_of(int pixels) const {
  return static_cast<std::size_t>(std::max(std::ceil(pixels / cell_), 1.0));
}

// Rectangles beyond the edges of the picture belong to its outermost cells.
std::array<std::size_t, 2> Occupied::cells_between(double low, double high,
                                                   std::size_t count) const {
  const double last = static_cast<double>(count) - 1;
  return {static_cast<std::size_t>(std::clamp(std::floor(low / cell_), 0.0, last)),
          static_cast<std::size_t>(std::clamp(std::floor(high / cell_), 0.0, last))};
}

void Occupied::add(const Rectangle& one) {
  const auto [left, right] = cells_between(one.low.x, one.high.x, columns_);
  const auto [top, bottom] = cells_between(one.low.y, one.high.y, rows_);
  for (std::size_t y = top; y <= bottom; ++y) {
    for (std::size_t x = left; x <= right; ++x) cells_[y * columns_ + x].push_back(one);
  }
}

bool Occupied::meets(const Rectangle& one) const {
  const auto [left, right] = cells_between(one.low.x, one.high.x, columns_);
  const auto [top, bottom] = cells_between(one.low.y, one.high.y, rows_);
  for (std::size_t y = top; y <= bottom; ++y) {
    for (std::size_t x = left; x <= right; ++x) {
      const auto& near = cells_[y * columns_ + x];
      const auto met = [&one](const Rectangle& other) { return overlap(one, other); };
      if (std::any_of(near.begin(), near.end(), met)) return true;
    }
  }
  return false;
}

}  // namespace windsplat::annotate
