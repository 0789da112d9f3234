// Triangles of several surfaces -> what each pixel of a picture shows of them: fragments, nearest
// first, the same for every rendering method.
//
// Each triangle covers some of the 4 x 4 samples of a pixel; those of one sheet of a surface are
// one fragment. (L. Carpenter: The A-buffer, an Antialiased Hidden Surface Method, SIGGRAPH 1984.)
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/thread_pool.hpp"
#include "server/surface/shown.hpp"
#include "server/terrain/terrain_pixel.hpp"

namespace windsplat::surface {

// A part of a pixel: opacity includes the share of the pixel that is covered, as seen after the
// fragments before it.
struct Fragment {
  double depth = 0;  // view depth
  float opacity = 0;
  Color rgb{};
};

// Of more fragments in a pixel the farthest are one, at the depth of the nearest of them.
constexpr int fragments_max = 16;
constexpr int cell_side = 16;  // pixels

// The fragments of a cell of pixels: those of pixel n, rows first, from first[n] to first[n + 1].
struct Cell {
  std::array<std::uint32_t, static_cast<std::size_t>(cell_side) * cell_side + 1> first{};
  std::vector<Fragment> fragments;
  // The triangles of each pixel, as lists.
  struct Piece {
    double depth = 0;
    double slack = 0;  // change of depth within about a pixel
    float opacity = 0;
    Color rgb{};
    std::uint16_t mask = 0;  // samples that it covers
    std::uint16_t surface = 0;
    bool front = false;  // seen from the side of larger values
    std::uint32_t next = 0, order = 0;
  };
  std::vector<Piece> pieces;
  std::vector<Piece> sorted;
  std::vector<std::uint8_t> sheets;  // of sorted pieces
};

// The triangles by the cells of a picture that they may cover. Keeps its storage between pictures.
class Pixels {
 public:
  // `shown` must outlive the calls of look(). After cancellation the result is invalid.
  void list(const std::vector<Shown>& shown, const terrain::View& view, int width, int height,
            ThreadPool& pool, const CancelToken& cancel);

  // Storage for the triangles of a mesh that each lie in up to two cells.
  static std::uint64_t bytes_for(const Mesh& mesh) {
    return mesh.places.size() * sizeof(Vertex) + mesh.triangles.size() * 2 * sizeof(std::uint32_t);
  }
  [[nodiscard]] static std::uint64_t bytes_for(const std::vector<Shown>& shown) {
    std::uint64_t bytes = 0;
    for (const Shown& one : shown) bytes += bytes_for(*one.mesh);
    return bytes;
  }
  // Frees the storage if there is more of it; then list() comes before look().
  void release_beyond(std::size_t bytes);

  [[nodiscard]] bool any(int column, int row) const {
    const std::size_t cell = cell_at(column, row);
    return first_[cell + 1] > first_[cell];
  }
  // The fragments of a cell; those outside of the picture are undefined.
  void look(int column, int row, Cell& to) const;

 private:
  class Clipper;
  struct Vertex {
    std::int32_t x = 0, y = 0;  // parts of a pixel, from the corner of the picture
    double depth = 0;
  };
  struct Corner {  // of a triangle that was clipped
    Vertex at;
    Point normal{};
    float value = 0;
  };
  struct Range {
    std::size_t vertex = 0, triangle = 0;  // the first ones of a surface
  };
  struct Extra {
    std::uint16_t surface = 0;
    std::array<std::uint32_t, 3> corners{};
  };

  [[nodiscard]] std::size_t cell_at(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }
  [[nodiscard]] Vertex project(const Point& place) const;
  [[nodiscard]] std::size_t surface_of(std::size_t triangle) const;
  template <class Visit>
  void each_cell(const std::array<Vertex, 3>& triangle, const Visit& visit) const;
  template <class Visit, class Cross>
  void each_of_part(std::size_t part, const Visit& visit, const Cross& cross) const;
  void clip(const std::vector<std::uint32_t>& crossing);
  void project_all(ThreadPool& pool, const CancelToken& cancel);
  // Sums of the counts of all parts, as the places of their entries.
  void sum_counts();
  [[nodiscard]] std::array<Vertex, 3> clipped(const Extra& of) const {
    return {corners_[of.corners[0]].at, corners_[of.corners[1]].at, corners_[of.corners[2]].at};
  }

  const std::vector<Shown>* shown_ = nullptr;
  terrain::View view_;
  int width_ = 0, height_ = 0, columns_ = 0, rows_ = 0;
  std::vector<Range> ranges_;  // of surfaces, and the end
  std::vector<Vertex> vertices_;
  std::vector<Corner> corners_;
  std::vector<Extra> extra_;
  std::vector<std::uint32_t> first_, entries_;  // triangles by cell; then those of extra_
  // Of consecutive triangles: numbers by cell, and those to be clipped; the last part is extra_.
  std::vector<std::vector<std::uint32_t>> counts_, crossing_;
};

}  // namespace windsplat::surface
