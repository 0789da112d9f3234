// Deltas -> segments -> cells, and land by counting the coasts that are crossed.
#include "server/ground/atlas.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>

#include "server/base/check.hpp"
#include "server/ground/lines.hpp"

namespace windsplat::ground {

namespace {

// Corners of cells and ends of segments lie on round degrees, and segments through a corner may
// have any simple slope: places to count from lie beside, degrees to the east and the north.
constexpr double beside_x = 0.001237;
constexpr double beside_y = 0.002113;

// Longitudes are moved by a multiple of 360 degrees to within 180 of `near`.
double wrapped(double longitude, double near) {
  const double away = longitude - near;
  return std::abs(away) <= 180 ? longitude : near + std::remainder(away, 360.0);
}

// The latitude at which a segment crosses a meridian, if it does.
bool meets_meridian(const Ends& s, double x, double& y) {
  if ((s.ax <= x) == (s.bx <= x)) return false;
  y = s.ay + (s.by - s.ay) * ((x - s.ax) / (s.bx - s.ax));
  return true;
}

// The longitude at which a segment crosses a parallel, if it does.
bool meets_parallel(const Ends& s, double y, double& x) {
  if ((s.ay <= y) == (s.by <= y)) return false;
  x = s.ax + (s.bx - s.ax) * ((y - s.ay) / (s.by - s.ay));
  return true;
}

bool is_between(double value, double a, double b) {
  return value > std::min(a, b) && value <= std::max(a, b);
}

int floored(double value) { return static_cast<int>(std::floor(value)); }

}  // namespace

Ends ends_near(const Segment& segment, double longitude) {
  const double ax = wrapped(static_cast<double>(segment.from[0]), longitude);
  return {ax, static_cast<double>(segment.from[1]),
          ax + (static_cast<double>(segment.to[0]) - static_cast<double>(segment.from[0])),
          static_cast<double>(segment.to[1])};
}

double crossing_of(const Ends& ends, double latitude) {
  double at = 0;
  return meets_parallel(ends, latitude, at) ? at : std::numeric_limits<double>::quiet_NaN();
}

// No comparison with NaN holds.
bool separates(const Ends& ends, double crossing, const Place& from, const Place& to) {
  bool odd = is_between(crossing, from.longitude, to.longitude);
  double at = 0;
  if (meets_meridian(ends, to.longitude, at) && is_between(at, from.latitude, to.latitude)) {
    odd = !odd;
  }
  return odd;
}

bool separates(const Ends& ends, const Place& from, const Place& to) {
  return separates(ends, crossing_of(ends, from.latitude), from, to);
}

void Marked::count() {
  std::uint64_t before = 0;
  for (Word& word : words_) {
    word.before = before;
    before += static_cast<std::uint64_t>(std::popcount(word.set));
  }
}

Level::Level(std::vector<Segment> segments, std::size_t coasts, int rows, double tolerance)
    : segments_(std::move(segments)),
      coasts_(coasts),
      width_(2 * rows),
      height_(rows),
      cell_(180.0 / rows),
      tolerance_(tolerance) {
  WINDSPLAT_CHECK(rows > 0 && coasts <= segments_.size());
  set_index();
  set_corners();
}

std::size_t Level::cell_at(int x, int y) const {
  const int column = ((x % width_) + width_) % width_;
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
         static_cast<std::size_t>(column);
}

Level::Cells Level::cells(double west, double east, double south, double north) const {
  Cells of;
  of.x = floored((west + 180) / cell_);
  of.x_last = std::min(floored((east + 180) / cell_), of.x + width_ - 1);
  of.y = std::clamp(floored((south + 90) / cell_), 0, height_ - 1);
  of.y_last = std::clamp(floored((north + 90) / cell_), 0, height_ - 1);
  return of;
}

// A segment is listed in all cells of its bounding box.
void Level::set_index() {
  crossed_.resize(cells_count());
  const auto each_cell = [this](const Segment& s, const auto& use) {
    const auto [west, east] = std::minmax(s.from[0], s.to[0]);
    const auto [south, north] = std::minmax(s.from[1], s.to[1]);
    const Cells in = cells(static_cast<double>(west), static_cast<double>(east),
                           static_cast<double>(south), static_cast<double>(north));
    for (int y = in.y; y <= in.y_last; ++y) {
      for (int x = in.x; x <= in.x_last; ++x) use(cell_at(x, y));
    }
  };
  for (const Segment& s : segments_) {
    each_cell(s, [this](std::size_t cell) { crossed_.mark(cell); });
  }
  crossed_.count();
  first_.assign(crossed_.rank(cells_count()) + 1, 0);
  for (const Segment& s : segments_) {
    each_cell(s, [this](std::size_t cell) { ++first_[crossed_.rank(cell)]; });
  }
  for (std::size_t n = 1; n < first_.size(); ++n) first_[n] += first_[n - 1];
  index_.resize(first_.back());
  // From the end of each cell to its beginning.
  for (std::size_t n = segments_.size(); n-- > 0;) {
    each_cell(segments_[n], [&](std::size_t cell) {
      index_[--first_[crossed_.rank(cell)]] = static_cast<std::uint32_t>(n);
    });
  }
}

// Along the western edge of each column of cells from the north pole, which is sea.
void Level::set_corners() {
  std::vector<std::vector<double>> crossed(static_cast<std::size_t>(width_));
  for (std::size_t n = 0; n < coasts_; ++n) {
    const auto [west, east] = std::minmax(segments_[n].from[0], segments_[n].to[0]);
    const int last = floored((static_cast<double>(east) + 180) / cell_);
    for (int x = floored((static_cast<double>(west) + 180) / cell_); x <= last; ++x) {
      const double meridian = -180.0 + x * cell_ + beside_x;
      double latitude = 0;
      if (!meets_meridian(ends_near(segments_[n], meridian), meridian, latitude)) continue;
      crossed[cell_at(x, 0)].push_back(latitude);
    }
  }
  land_.resize(cells_count());
  for (int x = 0; x < width_; ++x) {
    const std::vector<double>& at = crossed[static_cast<std::size_t>(x)];
    for (int y = 0; y < height_; ++y) {
      const double south = -90.0 + y * cell_ + beside_y;
      const auto north_of =
          std::count_if(at.begin(), at.end(), [&](double c) { return c > south; });
      land_[cell_at(x, y)] = north_of % 2 != 0;
    }
  }
}

bool Level::is_land(const Place& place) const {
  const double latitude = std::clamp(place.latitude, -90.0, 90.0);
  const double longitude = wrapped(place.longitude, 0);
  const Cells in = cells(longitude, longitude, latitude, latitude);
  const Place corner{-180.0 + in.x * cell_ + beside_x, -90.0 + in.y * cell_ + beside_y};
  bool land = land_[cell_at(in.x, in.y)];
  each(in, false, [&](const Segment& segment, bool) {
    if (separates(ends_near(segment, longitude), corner, {longitude, latitude})) land = !land;
  });
  return land;
}

std::size_t Level::bytes() const {
  return segments_.size() * sizeof(Segment) +
         (first_.size() + index_.size()) * sizeof(std::uint32_t) + crossed_.bytes() +
         land_.size() / 8;
}

namespace {

std::atomic<std::size_t> read_bytes{0};

template <std::size_t number>
const Level& kept_level() {
  static const Level level = [] {
    Level read = read_level(number);
    read_bytes += read.bytes();
    return read;
  }();
  return level;
}

}  // namespace

const Level& atlas(std::size_t level) {
  static_assert(levels == 3);
  WINDSPLAT_CHECK(level < levels);
  if (level == 0) return kept_level<0>();
  return level == 1 ? kept_level<1>() : kept_level<2>();
}

std::size_t atlas_bytes() { return read_bytes; }

std::size_t level_number(double degrees_per_pixel) {
  std::size_t n = levels - 1;
  while (n > 0 && tolerances.at(n) > 0.5 * degrees_per_pixel) --n;
  return n;
}

}  // namespace windsplat::ground
