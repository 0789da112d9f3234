// Edge functions in integers, so that each sample of a closed sheet belongs to one triangle.
#include "server/surface/raster.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

namespace windsplat::surface {

namespace {

constexpr std::uint32_t nothing = 0xFFFFFFFFU;
constexpr int samples_side = 4;
constexpr int samples = samples_side * samples_side;
constexpr std::uint16_t all_samples = 0xFFFF;
constexpr Color masked_color{0.214F, 0.214F, 0.214F};  // as lines of a masked scalar
constexpr double opaque_from = 1 - 1e-5;

// Parts of a pixel from its corner to a sample.
constexpr int sample_at(int n) { return (2 * n + 1) * pixel_parts / (2 * samples_side); }

struct Edge {
  std::int64_t dx = 0, dy = 0, at = 0;  // value at the corner of a pixel, after set()
  std::int64_t x = 0, y = 0;
  std::int64_t least = 0;  // samples at which it is at least this lie inside

  void set(std::int64_t px, std::int64_t py) { at = value(px, py); }
  [[nodiscard]] std::int64_t value(std::int64_t px, std::int64_t py) const {
    return dx * (py - y) - dy * (px - x);
  }
};

}  // namespace

struct CellRaster::Triangle {
  std::array<RasterVertex, 3> corners;
  std::array<Edge, 3> edges;  // edge n is opposite to corner n
  double inverse_area = 0;
  bool front = false;

  // The samples of the pixel whose corner is (x, y) in parts.
  [[nodiscard]] std::uint16_t covered(std::int64_t x, std::int64_t y) {
    constexpr std::int64_t low = sample_at(0);
    constexpr std::int64_t high = sample_at(samples_side - 1);
    bool whole = true;
    for (Edge& e : edges) {
      e.set(x, y);
      const std::int64_t rise_least = std::min(e.dx * low, e.dx * high);
      const std::int64_t rise_most = std::max(e.dx * low, e.dx * high);
      const std::int64_t fall_least = std::min(e.dy * low, e.dy * high);
      const std::int64_t fall_most = std::max(e.dy * low, e.dy * high);
      if (e.at + rise_most - fall_least < e.least) return 0;
      whole = whole && e.at + rise_least - fall_most >= e.least;
    }
    if (whole) return all_samples;
    unsigned mask = 0;
    for (int n = 0; n < samples; ++n) {
      const int right = sample_at(n % samples_side);
      const int down = sample_at(n / samples_side);
      bool inside = true;
      for (const Edge& e : edges) inside = inside && e.at + e.dx * down - e.dy * right >= e.least;
      mask |= static_cast<unsigned>(inside) << static_cast<unsigned>(n);
    }
    return static_cast<std::uint16_t>(mask);
  }
};

CellRaster::CellRaster(const terrain::View& view, int left, int top, double middle_x,
                       double middle_y, Cell& to)
    : view_(view), left_(left), top_(top), middle_x_(middle_x), middle_y_(middle_y), to_(to) {
  to_.pieces.clear();
  to_.fragments.clear();
  heads_.fill(nothing);
}

void CellRaster::add(const Shown& shown, std::uint16_t surface,
                     std::array<RasterVertex, 3> corners) {
  const auto twice_area = [&] {
    return std::int64_t{corners[1].x - corners[0].x} * (corners[2].y - corners[0].y) -
           std::int64_t{corners[1].y - corners[0].y} * (corners[2].x - corners[0].x);
  };
  std::int64_t area = twice_area();
  if (area == 0) return;
  Triangle triangle;
  triangle.front = area > 0;
  if (area < 0) std::swap(corners[1], corners[2]);
  area = std::abs(area);
  triangle.corners = corners;
  triangle.inverse_area = 1 / static_cast<double>(area);
  for (std::size_t n = 0; n < 3; ++n) {
    const RasterVertex& p = corners.at((n + 1) % 3);
    const RasterVertex& q = corners.at((n + 2) % 3);
    Edge& e = triangle.edges.at(n);
    e.dx = q.x - p.x;
    e.dy = q.y - p.y;
    e.x = p.x;
    e.y = p.y;
    // A sample on an edge belongs to one of the two triangles there.
    e.least = e.dy > 0 || (e.dy == 0 && e.dx > 0) ? 0 : 1;
  }
  const auto [x_low, x_high] = std::minmax({corners[0].x, corners[1].x, corners[2].x});
  const auto [y_low, y_high] = std::minmax({corners[0].y, corners[1].y, corners[2].y});
  const auto pixel_of = [](std::int32_t at) { return at >> 8; };
  static_assert(pixel_parts == 1 << 8);
  const int x1 = std::min(pixel_of(x_high), left_ + cell_side - 1);
  const int y1 = std::min(pixel_of(y_high), top_ + cell_side - 1);
  for (int y = std::max(pixel_of(y_low), top_); y <= y1; ++y) {
    for (int x = std::max(pixel_of(x_low), left_); x <= x1; ++x) {
      const std::uint16_t mask =
          triangle.covered(std::int64_t{x} * pixel_parts, std::int64_t{y} * pixel_parts);
      if (mask != 0) add_piece(shown, surface, triangle, x, y, mask);
    }
  }
}

namespace {

// The middle of some samples, in parts from the corner of the pixel.
std::array<double, 2> middle_of(std::uint16_t mask) {
  if (mask == all_samples) return {pixel_parts / 2.0, pixel_parts / 2.0};
  std::array<int, 2> sum{};
  for (unsigned left = mask; left != 0; left &= left - 1U) {
    const int n = std::countr_zero(left);
    sum[0] += sample_at(n % samples_side);
    sum[1] += sample_at(n / samples_side);
  }
  const double count = std::popcount(mask);
  return {sum[0] / count, sum[1] / count};
}

Color color_at(const Shown& shown, double value) {
  if (shown.colors.size() == 1) return shown.colors.front();
  if (std::isnan(value)) return masked_color;
  const double entries = static_cast<double>(shown.colors.size() - 1);
  const double part = (value - shown.range[0]) / (shown.range[1] - shown.range[0]);
  const double at = std::clamp(part, 0.0, 1.0) * entries;
  const auto low = std::min(static_cast<std::size_t>(at), shown.colors.size() - 2);
  const auto share = static_cast<float>(at - static_cast<double>(low));
  Color out{};
  for (std::size_t c = 0; c < 3; ++c) {
    out.at(c) =
        shown.colors[low].at(c) + share * (shown.colors[low + 1].at(c) - shown.colors[low].at(c));
  }
  return out;
}

// The part of a pixel that lines of constant value cover; slope: change of the value by pixel.
double contour_part(const Contours& contours, double value, double slope) {
  if (!(slope > 0)) return 0;
  const double wide = std::max(contours.width, 1.0);
  const double faint = std::min(contours.width, 1.0);
  const auto part_of = [&](double off) {
    return std::clamp(0.5 * wide + 0.5 - std::abs(off) / slope, 0.0, 1.0) * faint;
  };
  // Of close levels the sum, whose mean is their width over their distance.
  double at_levels = 0;
  const double reach = (0.5 * wide + 0.5) * slope;
  auto level = std::lower_bound(contours.levels.begin(), contours.levels.end(), value - reach);
  for (; level != contours.levels.end() && *level <= value + reach; ++level) {
    at_levels += part_of(value - *level);
  }
  at_levels = std::min(at_levels, 1.0);
  if (!(contours.step > 0)) return at_levels;
  const double spacing = contours.step / slope;
  if (spacing < contours.width + 1) {
    return std::max(std::min(contours.width / spacing, 1.0), at_levels);
  }
  return std::max(part_of(std::remainder(value, contours.step)), at_levels);
}

// The brightness of a surface in sunlight.
double sunlit(const Sun& sun, const glm::dvec3& normal, const glm::dvec3& ray,
              const glm::dvec3& place) {
  // Where the gradient vanishes the surface faces the eye.
  glm::dvec3 seen = glm::dot(normal, normal) > 0 ? normal : -ray;
  if (glm::dot(seen, ray) > 0) seen = -seen;
  const double cosine = glm::dot(seen, sun.direction) / glm::length(seen);
  const double passes = sun.media ? sun.media->at(place) : 1;
  return sun.ambient +
         (1 - sun.ambient) * std::min(sun.strength * passes, 1.0) * std::clamp(cosine, 0.0, 1.0);
}

}  // namespace

double CellRaster::brightness(const Shown& shown, const glm::dvec3& normal, double right,
                              double down, double depth) const {
  const glm::dvec3 aside = view_.pixel * (right * view_.right + down * view_.down);
  const glm::dvec3 ray = view_.perspective ? view_.forward + aside : view_.forward;
  if (shown.sun) {
    const glm::dvec3 from = view_.perspective ? view_.eye : view_.eye + aside;
    return sunlit(*shown.sun, normal, ray, from + depth * ray);
  }
  const double lengths = glm::length(normal) * glm::length(ray);
  const double cosine = lengths > 0 ? std::abs(glm::dot(normal, ray)) / lengths : 1.0;
  return shown.ambient + (1 - shown.ambient) * cosine;
}

void CellRaster::add_piece(const Shown& shown, std::uint16_t surface, const Triangle& triangle,
                           int x, int y, std::uint16_t mask) {
  const auto middle = middle_of(mask);
  // Shares of the corners and their changes from one pixel to the next, divided by the depth in
  // perspective: these are linear in the picture.
  std::array<double, 3> share{};
  std::array<std::array<double, 2>, 3> change{};
  double sum = 0;
  std::array<double, 2> sum_change{};
  for (std::size_t n = 0; n < 3; ++n) {
    const Edge& e = triangle.edges.at(n);
    const double depth = view_.perspective ? triangle.corners.at(n).depth : 1.0;
    const double scale = triangle.inverse_area / depth;
    const double at = static_cast<double>(e.at) + static_cast<double>(e.dx) * middle[1] -
                      static_cast<double>(e.dy) * middle[0];
    share.at(n) = at * scale;
    change.at(n) = {-static_cast<double>(e.dy) * scale * pixel_parts,
                    static_cast<double>(e.dx) * scale * pixel_parts};
    sum += share.at(n);
    for (std::size_t a = 0; a < 2; ++a) sum_change.at(a) += change.at(n).at(a);
  }
  const auto interpolated = [&](const auto& of) {
    double value = 0;
    for (std::size_t n = 0; n < 3; ++n) value += share.at(n) * of(triangle.corners.at(n));
    return value / sum;
  };
  // Length of the gradient of a quantity with this value, by pixel.
  const auto slope_of = [&](const auto& of, double value) {
    std::array<double, 2> slope{};
    for (std::size_t a = 0; a < 2; ++a) {
      for (std::size_t n = 0; n < 3; ++n) {
        slope.at(a) += change.at(n).at(a) * (of(triangle.corners.at(n)) - value);
      }
    }
    return std::hypot(slope[0], slope[1]) / sum;
  };
  const auto depth_of = [](const RasterVertex& v) { return v.depth; };
  const auto value_of = [](const RasterVertex& v) { return static_cast<double>(v.value); };
  Cell::Piece piece;
  piece.depth = interpolated(depth_of);
  const double across = view_.pixel * (view_.perspective ? piece.depth : 1.0);
  piece.slack = across + 2 * slope_of(depth_of, piece.depth);
  piece.mask = mask;
  piece.surface = surface;
  piece.front = triangle.front;
  piece.opacity = static_cast<float>(shown.opacity);
  const double value = interpolated(value_of);
  piece.rgb = color_at(shown, value);
  if (shown.ambient < 1 || shown.sun) {
    glm::dvec3 normal(0);
    for (std::size_t n = 0; n < 3; ++n) normal += share.at(n) * triangle.corners.at(n).normal;
    const double right = x + middle[0] / pixel_parts - middle_x_;
    const double down = y + middle[1] / pixel_parts - middle_y_;
    const auto shade = static_cast<float>(brightness(shown, normal, right, down, piece.depth));
    for (float& channel : piece.rgb) channel *= shade;
  }
  const double line = contour_part(shown.contours, value, slope_of(value_of, value));
  if (line > 0) {
    const auto opaque = static_cast<float>(line);
    const float opacity = opaque + (1 - opaque) * piece.opacity;
    for (std::size_t c = 0; c < 3; ++c) {
      piece.rgb.at(c) =
          (opaque * shown.contours.color.at(c) + (1 - opaque) * piece.opacity * piece.rgb.at(c)) /
          opacity;
    }
    piece.opacity = opacity;
  }
  const auto at =
      static_cast<std::size_t>(y - top_) * cell_side + static_cast<std::size_t>(x - left_);
  piece.next = heads_.at(at);
  heads_.at(at) = static_cast<std::uint32_t>(to_.pieces.size());
  to_.pieces.push_back(piece);
}

namespace {

// Neighbouring triangles of one sheet.
struct Sheet {
  std::size_t first = 0;
  std::uint16_t mask = 0;
  double depth = 0, slack = 0;  // of its last piece
};

constexpr std::size_t sheets_max = 64;  // of a pixel; pieces beyond join the last one

bool joins(const Cell::Piece& piece, const Cell::Piece& first, const Sheet& sheet) {
  return piece.surface == first.surface && piece.front == first.front &&
         piece.depth - sheet.depth <= piece.slack + sheet.slack;
}

// The sheet of each piece, in order of depth, from the nearest on. Returns the number of sheets.
std::size_t find_sheets(const std::vector<Cell::Piece>& pieces, std::vector<std::uint8_t>& of) {
  std::array<Sheet, sheets_max> sheets;
  std::size_t count = 0;
  of.resize(pieces.size());
  for (std::size_t p = 0; p < pieces.size(); ++p) {
    const Cell::Piece& piece = pieces[p];
    std::size_t found = count;
    for (std::size_t s = count; s-- > 0;) {
      if ((sheets.at(s).mask & piece.mask) != 0) break;
      if (!joins(piece, pieces[sheets.at(s).first], sheets.at(s))) continue;
      found = s;
      break;
    }
    if (found == count && count == sheets_max) --found;
    if (found == count) sheets.at(count++) = {p, 0, 0, 0};
    Sheet& sheet = sheets.at(found);
    sheet.mask = static_cast<std::uint16_t>(sheet.mask | piece.mask);
    sheet.depth = piece.depth;
    sheet.slack = piece.slack;
    of[p] = static_cast<std::uint8_t>(found);
  }
  return count;
}

// Composites the sheets of a pixel sample by sample: the opacity of a fragment is the share of what
// still passes that it absorbs, so that fragments over one another hide what their samples do.
void composite(const std::vector<Cell::Piece>& pieces, const std::vector<std::uint8_t>& sheet_of,
               std::size_t sheets, std::vector<Fragment>& to) {
  std::array<float, samples> left;
  left.fill(1);
  double passes = samples;
  for (std::size_t s = 0; s < sheets; ++s) {
    double absorbed = 0;
    double depth = 0;
    std::array<double, 3> light{};
    for (std::size_t p = 0; p < pieces.size(); ++p) {
      if (sheet_of[p] != s) continue;
      const Cell::Piece& piece = pieces[p];
      double here = 0;
      for (unsigned bits = piece.mask; bits != 0; bits &= bits - 1U) {
        float& sample = left.at(static_cast<std::size_t>(std::countr_zero(bits)));
        here += static_cast<double>(sample * piece.opacity);
        sample *= 1 - piece.opacity;
      }
      absorbed += here;
      depth += here * piece.depth;
      for (std::size_t c = 0; c < 3; ++c)
        light.at(c) += here * static_cast<double>(piece.rgb.at(c));
    }
    if (!(absorbed > 0)) continue;
    Fragment fragment;
    fragment.depth = depth / absorbed;
    const double opacity = absorbed / passes;
    fragment.opacity = opacity > opaque_from ? 1.0F : static_cast<float>(opacity);
    for (std::size_t c = 0; c < 3; ++c) {
      fragment.rgb.at(c) = static_cast<float>(light.at(c) / absorbed);
    }
    to.push_back(fragment);
    if (fragment.opacity >= 1) return;
    passes -= absorbed;
  }
}

// Makes one of the fragments from `first` on.
void merge_tail(std::vector<Fragment>& fragments, std::size_t first) {
  double left = 1;
  std::array<double, 3> light{};
  for (std::size_t n = first; n < fragments.size(); ++n) {
    const double here = left * static_cast<double>(fragments[n].opacity);
    for (std::size_t c = 0; c < 3; ++c) {
      light.at(c) += here * static_cast<double>(fragments[n].rgb.at(c));
    }
    left *= 1 - static_cast<double>(fragments[n].opacity);
  }
  if (!(left < 1)) return fragments.resize(first);  // opacities that vanish beside 1
  fragments.resize(first + 1);
  fragments[first].opacity = static_cast<float>(1 - left);
  for (std::size_t c = 0; c < 3; ++c) {
    fragments[first].rgb.at(c) = static_cast<float>(light.at(c) / (1 - left));
  }
}

}  // namespace

void CellRaster::finish() {
  for (std::size_t pixel = 0; pixel < heads_.size(); ++pixel) {
    const std::size_t first = to_.fragments.size();
    to_.first.at(pixel) = static_cast<std::uint32_t>(first);
    if (heads_.at(pixel) == nothing) continue;
    std::vector<Cell::Piece>& sorted = to_.sorted;
    sorted.clear();
    for (std::uint32_t at = heads_.at(pixel); at != nothing; at = to_.pieces[at].next) {
      sorted.push_back(to_.pieces[at]);
      sorted.back().order = at;
    }
    std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
      return a.depth != b.depth ? a.depth < b.depth : a.order < b.order;
    });
    const std::size_t sheets = find_sheets(sorted, to_.sheets);
    composite(sorted, to_.sheets, sheets, to_.fragments);
    constexpr auto most = static_cast<std::size_t>(fragments_max);
    if (to_.fragments.size() - first > most) merge_tail(to_.fragments, first + most - 1);
  }
  to_.first.back() = static_cast<std::uint32_t>(to_.fragments.size());
}

}  // namespace windsplat::surface
