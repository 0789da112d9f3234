// Coastlines and borders of the Earth (natural_earth/README.md) at three levels of detail: what
// lies near a place, and whether it is land.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace windsplat::ground {

// Degrees.
struct Place {
  double longitude = 0, latitude = 0;
};

// Degrees; a line may continue beyond 180, and its ends are less than 180 apart.
struct Segment {
  std::array<float, 2> from{}, to{};  // longitude, latitude
};

// A segment with longitudes within 180 degrees of a place, at least at its beginning.
struct Ends {
  double ax, ay, bx, by;
};
Ends ends_near(const Segment& segment, double longitude);

// Whether a segment separates two places: a way along the parallel of the first and then along the
// meridian of the second crosses it once.
bool separates(const Ends& ends, const Place& from, const Place& to);
// The same in two parts: the longitude at which it crosses the parallel of the first, NaN if it
// does not, and what follows from it.
double crossing_of(const Ends& ends, double latitude);
bool separates(const Ends& ends, double crossing, const Place& from, const Place& to);

// Some of the numbers from 0, and how many of them are below one: a bit for each, and a count for
// every 64.
class Marked {
 public:
  void resize(std::size_t count) { words_.assign(count / bits + 1, {}); }
  void mark(std::size_t n) { words_[n / bits].set |= std::uint64_t{1} << n % bits; }
  // Call it after the last mark().
  void count();
  [[nodiscard]] bool has(std::size_t n) const {
    return (words_[n / bits].set >> n % bits & 1U) != 0;
  }
  [[nodiscard]] std::size_t rank(std::size_t n) const {
    const Word& word = words_[n / bits];
    const std::uint64_t below = word.set & ((std::uint64_t{1} << n % bits) - 1);
    return word.before + static_cast<std::size_t>(std::popcount(below));
  }
  [[nodiscard]] std::size_t bytes() const { return words_.size() * sizeof(Word); }

 private:
  static constexpr std::size_t bits = 64;
  struct Word {
    std::uint64_t set = 0;
    std::uint64_t before = 0;
  };
  std::vector<Word> words_;
};

// The lines of one level, by cells of equal degrees.
class Level {
 public:
  // Segments of coasts first, of which there are `coasts`. rows: of cells from pole to pole.
  Level(std::vector<Segment> segments, std::size_t coasts, int rows, double tolerance);

  // Degrees by which lines may be moved from where the data have them.
  [[nodiscard]] double tolerance() const { return tolerance_; }
  [[nodiscard]] bool is_land(const Place& place) const;

  // Columns and rows of cells, both ends included; columns may be beyond those of the map and then
  // continue around it.
  struct Cells {
    int x = 0, x_last = 0;
    int y = 0, y_last = 0;
  };
  [[nodiscard]] Cells cells(double west, double east, double south, double north) const;
  // Calls see(segment, is_coast) for the segments in the cells, some of them more than once.
  template <class See>
  void each(const Cells& cells, bool borders, const See& see) const {
    for (int y = cells.y; y <= cells.y_last; ++y) {
      for (int x = cells.x; x <= cells.x_last; ++x) {
        const std::size_t cell = cell_at(x, y);
        if (!crossed_.has(cell)) continue;
        const std::size_t at = crossed_.rank(cell);
        for (std::uint32_t n = first_[at]; n < first_[at + 1]; ++n) {
          const bool coast = index_[n] < coasts_;
          if (coast || borders) see(segments_[index_[n]], coast);
        }
      }
    }
  }
  [[nodiscard]] std::size_t bytes() const;

 private:
  [[nodiscard]] std::size_t cell_at(int x, int y) const;
  [[nodiscard]] std::size_t cells_count() const {
    return static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  }
  void set_index();
  void set_corners();

  std::vector<Segment> segments_;
  std::size_t coasts_;
  int width_, height_;
  double cell_;  // degrees
  double tolerance_;
  Marked crossed_;                    // the cells with segments
  std::vector<std::uint32_t> first_;  // of each of these, in index_; coasts before borders
  std::vector<std::uint32_t> index_;
  std::vector<bool> land_;  // at the south-west corner of each cell
};

// The finest first. Degrees by which their lines may be moved, as in scripts/ground_data.
constexpr std::size_t levels = 3;
constexpr std::array<double, levels> tolerances{0.015, 0.05, 0.2};

// Each level is read by the first call for it, which takes some milliseconds, and stays: 3.0, 1.0
// and 0.2 MB. Thread-safe.
const Level& atlas(std::size_t level);
// Bytes of the levels that were read.
std::size_t atlas_bytes();

// The coarsest level whose lines are moved by at most half of that many degrees, else the finest.
std::size_t level_number(double degrees_per_pixel);
inline const Level& level_for(double degrees_per_pixel) {
  return atlas(level_number(degrees_per_pixel));
}

}  // namespace windsplat::ground
