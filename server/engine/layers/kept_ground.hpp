// What blocks of pixels show of a painted or rough body, kept between frames: those with the same
// camera, size and ground find it instead of painting it again, with the same bits.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "server/engine/kernels/frame_data.hpp"
#include "server/ground/identity.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::engine {

// The blocks of one picture. Each is found and kept by the thread that draws its tile.
class KeptGround {
 public:
  // Forgets all blocks and keeps storage. bytes_max: of blocks beyond it none are kept.
  void begin(int width, int height, int tile_pixels, std::size_t bytes_max);

  // What add_terrain() sets, except normals, which only paint_body() uses. False: not kept, or the
  // body is painted and the colours of the block are not kept, so that they need the normals.
  bool find_surface(bool painted, kernels::BodyPixels& pixels) const;
  void keep_surface(const kernels::BodyPixels& pixels);
  // What paint_body() sets.
  bool find_colors(const kernels::BodyPixels& pixels, float rgb[3][kernels::block_pixels]) const;
  void keep_colors(const kernels::BodyPixels& pixels, const float rgb[3][kernels::block_pixels]);

  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  struct Surface {
    std::array<double, kernels::block_pixels> depth, coverage;
    std::array<float, kernels::block_pixels> cosine, relief;
  };
  using Rgb = std::array<float, 3>;
  using Colors = std::array<float, std::size_t{3} * kernels::block_pixels>;
  static constexpr std::uint32_t even_max = 15;  // colours of blocks of one colour
  struct Tile {
    // Of each block: 0, or 1 more than its place in `even`, or even_max + 1 more than in `colors`.
    std::vector<std::uint32_t> color_at;
    std::vector<std::uint32_t> surface_at;  // 0, or 1 more than its place in `surfaces`
    std::vector<Rgb> even;
    std::vector<Colors> colors;
    std::vector<Surface> surfaces;
  };
  struct Place {
    std::size_t tile = 0, block = 0;
  };
  [[nodiscard]] Place place_of(const kernels::BodyPixels& pixels) const;
  // Room for one more; false: there is none.
  template <class T>
  bool has_room(std::vector<T>& in);

  int tile_pixels_ = 1, tiles_x_ = 0;
  std::size_t bytes_max_ = 0;
  std::atomic<std::size_t> bytes_{0};
  std::vector<Tile> tiles_;
};

// The last few pictures.
class KeptGrounds {
 public:
  static constexpr std::size_t pictures_max = 4;

  // Of all pictures together.
  void set_limit(std::size_t bytes) { bytes_max_ = bytes; }
  // That of the frame, new or with what was kept; null: its body is neither painted nor rough.
  // table: the kernels that draw it.
  KeptGround* of(const scene::Scene& scene, int tile_pixels, const void* table);
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Picture {
    ground::Identity of;
    const void* table = nullptr;
    std::uint64_t used = 0;
    KeptGround blocks;
  };
  Picture& replaceable(std::size_t coming);

  std::size_t bytes_max_ = std::size_t{64} << 20U;
  std::uint64_t frame_ = 0;
  std::vector<std::unique_ptr<Picture>> pictures_;
  ground::Identity key_;  // of the frame
};

}  // namespace windsplat::engine
