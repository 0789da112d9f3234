#include "server/annotate/legend.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "server/annotate/legend_entries.hpp"
#include "server/annotate/paint/type.hpp"

namespace windsplat::annotate {
namespace {

// Lengths of a card in ems of its text.
constexpr double pad = 0.8;
constexpr double card_width = strip_width + 2 * pad;
constexpr double title_height = 1.7;
constexpr double strip_height = 1;
constexpr double ticks_height = 1.6;
constexpr double note_height = 1.3;
constexpr double gap = 0.6;

double height_of(const LegendEntry& entry) {
  return 2 * pad + title_height + strip_height + (entry.ticks.empty() ? 0.3 : ticks_height) +
         note_height * static_cast<double>(entry.notes.size()) - 0.5;
}

// Writes a text that is at most `room` pixels wide, in a smaller size where it is longer.
void write(const std::string& text, const Point& at, double size, double align, double room,
           const Color& color, Figure& figure) {
  const double width = width_of(text, size);
  const double fitted = width > room ? size * room / width : size;
  figure.above.emplace_back(Text{text, at, fitted, align, color, {0, 0, 0, 0}});
}

// Triangles in the colours of the ends: more values lie beyond them, as in the legends of maps.
void add_arrows(const LegendEntry& entry, const Point& corner, double width, double em,
                Figure& figure) {
  constexpr double tip = 0.65 * pad;
  const double middle = corner.y + 0.5 * strip_height * em;
  const double bottom = corner.y + strip_height * em;
  if (entry.beyond[0]) {
    figure.above.emplace_back(
        Area{{corner, {corner.x - tip * em, middle}, {corner.x, bottom}}, entry.colors.front()});
  }
  if (entry.beyond[1]) {
    const double right = corner.x + width;
    figure.above.emplace_back(Area{{{right, corner.y}, {right + tip * em, middle}, {right, bottom}},
                                   entry.colors.back()});
  }
}

void add_opacity(const LegendEntry& entry, const Point& corner, double width, double height,
                 double em, const Style& style, Figure& figure) {
  if (entry.opacity.empty()) return;
  std::vector<Point> curve;
  for (const Point& at : entry.opacity) {
    constexpr double margin = 0.06;  // of the height, above and below the curve
    const double x = std::clamp(at.x, 0.0, 1.0);
    curve.push_back(
        {corner.x + x * width, corner.y + height * (1 - margin - (1 - 2 * margin) * at.y)});
  }
  std::vector<Point> covered = curve;
  covered.insert(covered.begin(), {curve.front().x, corner.y});
  covered.push_back({curve.back().x, corner.y});
  Color cover = style.rim;
  cover.alpha = 0.72;
  figure.above.emplace_back(Area{covered, cover});
  figure.above.emplace_back(Line{curve, 0.11 * em, style.color});
}

void add_card(const LegendEntry& entry, const Point& corner, double em, const Style& style,
              Figure& figure) {
  const double width = card_width * em;
  const double height = height_of(entry) * em;
  Color ground = style.rim;
  ground.alpha = 0.68;
  figure.above.emplace_back(Area{{corner,
                                  {corner.x + width, corner.y},
                                  {corner.x + width, corner.y + height},
                                  {corner.x, corner.y + height}},
                                 ground});
  figure.taken.push_back({corner, {corner.x + width, corner.y + height}});
  const double left = corner.x + pad * em;
  const double inner = width - 2 * pad * em;
  double line = corner.y + (pad + 0.9) * em;
  // Long units take at most half of the line.
  const double units_width = std::min(width_of(entry.units, em), 0.5 * inner);
  const double title_room = entry.units.empty() ? inner : inner - units_width - em;
  write(entry.title, {left, line}, em, 0, title_room, style.color, figure);
  if (!entry.units.empty()) {
    write(entry.units, {left + inner, line}, em, 1, units_width, style.quiet, figure);
  }
  const Point strip{left, corner.y + (pad + title_height) * em};
  figure.above.emplace_back(Strip{strip, inner, strip_height * em, entry.colors});
  add_arrows(entry, strip, inner, em, figure);
  add_opacity(entry, strip, inner, strip_height * em, em, style, figure);
  line = strip.y + strip_height * em;
  for (const Tick& tick : entry.ticks) {
    constexpr double beyond = 1e-6;
    if (tick.at < -beyond || tick.at > 1 + beyond) continue;
    const double x = left + tick.at * inner;
    figure.above.emplace_back(Line{{{x, line}, {x, line + 0.35 * em}}, 0.08 * em, style.color});
    const double middle = left + tick_middle(tick) * em;
    write(tick.text, {middle, line + 1.3 * em}, tick_size * em, 0.5, inner, style.color, figure);
  }
  line += (entry.ticks.empty() ? 0.3 : ticks_height) * em;
  for (const std::string& note : entry.notes) {
    write(note, {left, line + 0.95 * em}, 0.88 * em, 0, inner, style.quiet, figure);
    line += note_height * em;
  }
}

}  // namespace

void add_legend(const Subject& subject, const Style& style, Figure& figure) {
  const std::vector<LegendEntry> entries = legend_entries(subject);
  if (entries.empty()) return;
  const double edge = 1.2 * style.text;
  // Cards are made smaller until they fit the width, and in height 0.6 of the picture.
  double em = std::min(style.text, (figure.width - 2 * edge) / card_width);
  std::vector<double> rows;  // the greatest height of each
  int columns = 1;
  for (int tries = 0; tries < 2; ++tries) {
    columns = std::max(
        1, static_cast<int>((figure.width - 2 * edge + gap * em) / ((card_width + gap) * em)));
    rows.assign((entries.size() + static_cast<std::size_t>(columns) - 1) /
                    static_cast<std::size_t>(columns),
                0);
    double total = 0;
    for (std::size_t n = 0; n < entries.size(); ++n) {
      double& row = rows[n / static_cast<std::size_t>(columns)];
      row = std::max(row, height_of(entries[n]));
    }
    for (const double row : rows) total += row + gap;
    constexpr double share_most = 0.6;
    const double fits = (share_most * figure.height) / total;
    if (em <= fits) break;
    em = fits;
  }
  double bottom = figure.height - edge;
  for (std::size_t n = 0; n < entries.size(); ++n) {
    const std::size_t column = n % static_cast<std::size_t>(columns);
    if (n > 0 && column == 0) {
      bottom -= (rows[n / static_cast<std::size_t>(columns) - 1] + gap) * em;
    }
    const double x = edge + static_cast<double>(column) * (card_width + gap) * em;
    add_card(entries[n], {x, bottom - height_of(entries[n]) * em}, em, style, figure);
  }
}

}  // namespace windsplat::annotate
