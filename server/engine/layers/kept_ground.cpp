#include "server/engine/layers/kept_ground.hpp"

#include <algorithm>

#include "server/ground/paint.hpp"

namespace windsplat::engine {

using kernels::block_pixels;
using kernels::block_side;
using kernels::BodyPixels;

void KeptGround::begin(int width, int height, int tile_pixels, std::size_t bytes_max) {
  tile_pixels_ = tile_pixels;
  bytes_max_ = bytes_max;
  tiles_x_ = (width + tile_pixels - 1) / tile_pixels;
  const int tiles_y = (height + tile_pixels - 1) / tile_pixels;
  const auto side = static_cast<std::size_t>(tile_pixels / block_side);
  tiles_.resize(static_cast<std::size_t>(tiles_x_) * static_cast<std::size_t>(tiles_y));
  std::size_t bytes = tiles_.capacity() * sizeof(Tile);
  for (Tile& tile : tiles_) {
    tile.color_at.assign(side * side, 0);
    tile.surface_at.assign(side * side, 0);
    tile.even.clear();
    tile.colors.clear();
    tile.surfaces.clear();
    bytes += (tile.color_at.capacity() + tile.surface_at.capacity()) * sizeof(std::uint32_t) +
             tile.even.capacity() * sizeof(Rgb) + tile.colors.capacity() * sizeof(Colors) +
             tile.surfaces.capacity() * sizeof(Surface);
  }
  bytes_ = bytes;
}

KeptGround::Place KeptGround::place_of(const BodyPixels& pixels) const {
  const int x = static_cast<int>(pixels.left);
  const int y = static_cast<int>(pixels.top);
  const int side = tile_pixels_ / block_side;
  const int tile = y / tile_pixels_ * tiles_x_ + x / tile_pixels_;
  const int block = y % tile_pixels_ / block_side * side + x % tile_pixels_ / block_side;
  return {static_cast<std::size_t>(tile), static_cast<std::size_t>(block)};
}

template <class T>
bool KeptGround::has_room(std::vector<T>& in) {
  if (in.size() < in.capacity()) return true;
  const std::size_t next = std::max<std::size_t>(2 * in.capacity(), 16);
  const std::size_t more = (next - in.capacity()) * sizeof(T);
  if (bytes_.fetch_add(more) + more > bytes_max_) {
    bytes_ -= more;
    return false;
  }
  in.reserve(next);
  return true;
}

bool KeptGround::find_surface(bool painted, BodyPixels& pixels) const {
  const Place at = place_of(pixels);
  const Tile& tile = tiles_[at.tile];
  const std::uint32_t kept = tile.surface_at[at.block];
  if (kept == 0) return false;
  const Surface& from = tile.surfaces[kept - 1];
  const auto is_seen = [](double coverage) { return coverage > 0; };
  if (painted && tile.color_at[at.block] == 0 &&
      std::any_of(from.coverage.begin(), from.coverage.end(), is_seen)) {
    return false;
  }
  std::copy(from.depth.begin(), from.depth.end(), pixels.depth);
  std::copy(from.coverage.begin(), from.coverage.end(), pixels.coverage);
  std::copy(from.cosine.begin(), from.cosine.end(), pixels.cosine);
  std::copy(from.relief.begin(), from.relief.end(), pixels.relief);
  return true;
}

void KeptGround::keep_surface(const BodyPixels& pixels) {
  const Place at = place_of(pixels);
  Tile& tile = tiles_[at.tile];
  if (tile.surface_at[at.block] != 0 || !has_room(tile.surfaces)) return;
  Surface& to = tile.surfaces.emplace_back();
  for (std::size_t l = 0; l < block_pixels; ++l) {
    to.depth[l] = pixels.depth[l];
    to.coverage[l] = pixels.coverage[l];
    // Read as these.
    to.cosine[l] = static_cast<float>(pixels.cosine[l]);
    to.relief[l] = static_cast<float>(pixels.relief[l]);
  }
  tile.surface_at[at.block] = static_cast<std::uint32_t>(tile.surfaces.size());
}

bool KeptGround::find_colors(const BodyPixels& pixels, float rgb[3][block_pixels]) const {
  const Place at = place_of(pixels);
  const Tile& tile = tiles_[at.tile];
  const std::uint32_t kept = tile.color_at[at.block];
  if (kept == 0) return false;
  for (std::size_t c = 0; c < 3; ++c) {
    if (kept <= even_max) {
      std::fill_n(rgb[c], block_pixels, tile.even[kept - 1].at(c));
    } else {
      std::copy_n(tile.colors[kept - even_max - 1].data() + c * block_pixels, block_pixels, rgb[c]);
    }
  }
  return true;
}

void KeptGround::keep_colors(const BodyPixels& pixels, const float rgb[3][block_pixels]) {
  const Place at = place_of(pixels);
  Tile& tile = tiles_[at.tile];
  bool even = true;
  for (std::size_t c = 0; c < 3; ++c) {
    const float first = rgb[c][0];
    even = even && std::all_of(rgb[c], rgb[c] + block_pixels, [=](float f) { return f == first; });
  }
  if (even) {
    const Rgb color{rgb[0][0], rgb[1][0], rgb[2][0]};
    const auto found = std::find(tile.even.begin(), tile.even.end(), color);
    const auto place = static_cast<std::uint32_t>(found - tile.even.begin());
    if (place < even_max && (found != tile.even.end() || has_room(tile.even))) {
      if (place == tile.even.size()) tile.even.push_back(color);
      tile.color_at[at.block] = place + 1;
      return;
    }
  }
  if (!has_room(tile.colors)) return;
  Colors& to = tile.colors.emplace_back();
  for (std::size_t c = 0; c < 3; ++c) {
    std::copy_n(rgb[c], block_pixels, to.data() + c * block_pixels);
  }
  tile.color_at[at.block] = even_max + static_cast<std::uint32_t>(tile.colors.size());
}

namespace {

void add(const glm::dvec3& v, std::vector<double>& to) { to.insert(to.end(), {v.x, v.y, v.z}); }

void identify(const scene::Scene& scene, int tile_pixels, ground::Identity& to) {
  const scene::Camera& camera = scene.camera;
  const scene::Body& body = *scene.body;
  to.clear();
  for (const glm::dvec3& v : {camera.eye, camera.right, camera.up, camera.forward}) {
    add(v, to.numbers);
  }
  to.numbers.insert(to.numbers.end(),
                    {camera.half_height, camera.near, camera.perspective ? 1.0 : 0.0,
                     static_cast<double>(camera.width), static_cast<double>(camera.height),
                     static_cast<double>(tile_pixels), static_cast<double>(body.shape), body.radius,
                     body.low.x, body.low.y, body.high.x, body.high.y, body.height});
  for (const float channel : body.color) to.numbers.push_back(static_cast<double>(channel));
  to.shared.emplace_back(body.terrain);
  if (body.paint) body.paint->identify(to);
}

// Of all blocks, none of one colour.
std::size_t bytes_of(const scene::Scene& scene) {
  constexpr std::size_t painted = 3 * sizeof(float);
  constexpr std::size_t rough = 2 * sizeof(double) + 2 * sizeof(float);
  const auto pixels =
      static_cast<std::size_t>(scene.camera.width) * static_cast<std::size_t>(scene.camera.height);
  return pixels * ((scene.body->paint ? painted : 0) + (scene.body->terrain ? rough : 0));
}

}  // namespace

std::size_t KeptGrounds::bytes() const {
  std::size_t sum = 0;
  for (const auto& picture : pictures_) sum += picture->blocks.bytes();
  return sum;
}

// Drops those used least recently until the new one fits, or it is the only one.
KeptGrounds::Picture& KeptGrounds::replaceable(std::size_t coming) {
  const auto oldest = [this] {
    return std::min_element(pictures_.begin(), pictures_.end(),
                            [](const auto& a, const auto& b) { return a->used < b->used; });
  };
  const std::size_t needed = std::min(coming, bytes_max_);
  while (pictures_.size() > 1 && bytes() - (*oldest())->blocks.bytes() + needed > bytes_max_) {
    pictures_.erase(oldest());
  }
  const bool fits = bytes() + needed <= bytes_max_;
  if (pictures_.empty() || (fits && pictures_.size() < pictures_max)) {
    return *pictures_.emplace_back(std::make_unique<Picture>());
  }
  std::unique_ptr<Picture>& reused = *oldest();
  if (reused->blocks.bytes() > bytes_max_) reused = std::make_unique<Picture>();
  return *reused;
}

KeptGround* KeptGrounds::of(const scene::Scene& scene, int tile_pixels, const void* table) {
  if (!scene.body || (!scene.body->paint && !scene.body->terrain) || bytes_max_ == 0) {
    return nullptr;
  }
  identify(scene, tile_pixels, key_);
  ++frame_;
  for (const auto& picture : pictures_) {
    if (picture->table != table || !(picture->of == key_)) continue;
    picture->used = frame_;
    return &picture->blocks;
  }
  Picture& picture = replaceable(bytes_of(scene));
  picture.of = key_;
  picture.table = table;
  picture.used = frame_;
  const std::size_t others = bytes() - picture.blocks.bytes();
  picture.blocks.begin(scene.camera.width, scene.camera.height, tile_pixels, bytes_max_ - others);
  return &picture.blocks;
}

}  // namespace windsplat::engine
