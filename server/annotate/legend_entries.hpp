// View and fields -> what the cards of the legend say.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "server/annotate/figure.hpp"
#include "server/annotate/labels.hpp"
#include "server/annotate/subject.hpp"

namespace windsplat::annotate {

// Lengths in ems of the text of a card: width of a strip, size of the numbers below it, and how far
// these may reach beyond its ends.
constexpr double strip_width = 20.4;
constexpr double tick_size = 0.92;
constexpr double tick_overhang = 0.5;

// A card of the legend. Positions of ticks and of the curve are fractions of the width of the
// strip; those of the curve also of its height, from below.
struct LegendEntry {
  std::string title;
  std::string units;
  std::vector<Color> colors;
  std::vector<Tick> ticks;
  std::vector<Point> opacity;
  std::vector<std::string> notes;
  // Whether values lie beyond the left and the right end, which have their colours.
  std::array<bool, 2> beyond{false, false};
};

// The middle of the number of a tick from the left end of the strip, in ems.
double tick_middle(const Tick& tick);

// Lines first, then media and surfaces that are seen.
std::vector<LegendEntry> legend_entries(const Subject& subject);

}  // namespace windsplat::annotate
