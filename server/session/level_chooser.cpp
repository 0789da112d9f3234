// Expected cost of each level: measured where it was drawn lately, else reckoned from the level
// drawn last.
#include "server/session/level_chooser.hpp"

#include <algorithm>
#include <cmath>

namespace windsplat::session {
namespace {

// Before anything was drawn: about what two cores need for a large field.
constexpr double first_guess_us_per_pixel = 0.06;
// A level has four times the next one's pixels, but part of the cost is a sample's, not a pixel's.
constexpr double cost_ratio = 3;
// How long a measured cost stands although the view has moved on.
constexpr Micros measure_life_us = 3'000'000;

double pixels_of(int width, int height) {
  return static_cast<double>(width) * static_cast<double>(height);
}

}  // namespace

void LevelChooser::learn(int level, int width, int height, Micros cost, Micros now) {
  if (level < 0 || level > level_max) return;
  Measure& measure = measures_[static_cast<std::size_t>(level)];
  const double pixels = pixels_of(width, height);
  const double cost_us = static_cast<double>(std::max<Micros>(cost, 1));
  const bool fresh = measure.known && now - measure.at < measure_life_us;
  // Half of each new cost: one slow frame among fast ones does not change the level for long.
  const double before = fresh ? measure.cost_us * pixels / measure.pixels : cost_us;
  measure = {0.5 * (before + cost_us), pixels, now, true};
  newest_ = level;
}

Micros LevelChooser::expected(int level, int width, int height, Micros now) const {
  const double pixels = pixels_of(width, height);
  if (newest_ < 0) {
    return static_cast<Micros>(first_guess_us_per_pixel * pixels / std::pow(4.0, level));
  }
  const Measure& own = measures_[static_cast<std::size_t>(level)];
  if (own.known && (level == newest_ || now - own.at < measure_life_us)) {
    return static_cast<Micros>(own.cost_us * pixels / own.pixels);
  }
  const Measure& last = measures_[static_cast<std::size_t>(newest_)];
  return static_cast<Micros>(last.cost_us * pixels / last.pixels *
                             std::pow(cost_ratio, newest_ - level));
}

int LevelChooser::choose(int width, int height, Micros budget, Micros now) const {
  int level = 0;
  while (level < level_max && (std::min(width, height) >> (level + 1)) >= edge_min &&
         expected(level, width, height, now) > budget) {
    ++level;
  }
  return level;
}

}  // namespace windsplat::session
