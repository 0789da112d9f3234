#include "server/annotate/paint/overlay.hpp"

#include <cairo/cairo.h>

#include <algorithm>
#include <array>
#include <memory>
#include <string>

#include "server/annotate/paint/paint.hpp"
#include "server/scene/colormap.hpp"

namespace windsplat::annotate {
namespace {

constexpr int code_bits = 8;
constexpr std::uint32_t code_most = 255;

struct Pixel {
  float red, green, blue, alpha;
};

// Linear light of 8-bit sRGB codes.
const std::array<float, code_most + 1>& linear_codes() {
  static const auto table = [] {
    std::array<float, code_most + 1> out{};
    for (std::size_t n = 0; n < out.size(); ++n) {
      out.at(n) = scene::linear_from_srgb(static_cast<float>(n) / float{code_most});
    }
    return out;
  }();
  return table;
}

// Linear and premultiplied.
Pixel linear(std::uint32_t code) {
  const std::uint32_t alpha = code >> 3 * code_bits;
  const float share = static_cast<float>(alpha) / float{code_most};
  const auto channel = [&](int shift) {
    const std::uint32_t value = code >> shift & code_most;
    const std::uint32_t own = std::min((value * code_most + alpha / 2) / alpha, code_most);
    return share * linear_codes()[own];
  };
  return {channel(2 * code_bits), channel(code_bits), channel(0), share};
}

void over(const Pixel& front, float* behind) {
  const float through = 1 - front.alpha;
  behind[0] = front.red + through * behind[0];
  behind[1] = front.green + through * behind[1];
  behind[2] = front.blue + through * behind[2];
  behind[3] = front.alpha + through * behind[3];
}

void under(const Pixel& behind, float* front) {
  const float through = 1 - front[3];
  front[0] += through * behind.red;
  front[1] += through * behind.green;
  front[2] += through * behind.blue;
  front[3] += through * behind.alpha;
}

Result<std::vector<std::uint32_t>> painted(const std::vector<Item>& items, int width, int height) {
  std::vector<std::uint32_t> pixels;
  if (items.empty()) return pixels;
  pixels.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface(
      cairo_image_surface_create_for_data(reinterpret_cast<unsigned char*>(pixels.data()),
                                          CAIRO_FORMAT_ARGB32, width, height, width * 4),
      &cairo_surface_destroy);
  const std::unique_ptr<cairo_t, decltype(&cairo_destroy)> target(cairo_create(surface.get()),
                                                                  &cairo_destroy);
  paint(items, target.get());
  cairo_surface_flush(surface.get());
  const cairo_status_t status = cairo_status(target.get());
  if (status != CAIRO_STATUS_SUCCESS) {
    return make_error(
        status == CAIRO_STATUS_NO_MEMORY ? ErrorKind::out_of_memory : ErrorKind::internal,
        std::string("annotations cannot be drawn: ") + cairo_status_to_string(status));
  }
  return pixels;
}

}  // namespace

std::uint64_t overlay_bytes(int width, int height) {
  return 2 * sizeof(std::uint32_t) * static_cast<std::uint64_t>(width) *
         static_cast<std::uint64_t>(height);
}

Result<Overlay> Overlay::of(const Figure& figure) {
  Overlay out;
  out.width_ = figure.width;
  out.height_ = figure.height;
  auto below = painted(figure.below, figure.width, figure.height);
  if (!below) return below.error();
  auto above = painted(figure.above, figure.width, figure.height);
  if (!above) return above.error();
  out.below_ = std::move(*below);
  out.above_ = std::move(*above);
  out.spans_.resize(static_cast<std::size_t>(figure.height));
  for (int y = 0; y < figure.height; ++y) {
    Span& span = out.spans_[static_cast<std::size_t>(y)];
    span = {figure.width, 0};
    for (const auto* layer : {&out.below_, &out.above_}) {
      if (layer->empty()) continue;
      const std::uint32_t* const row =
          layer->data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(figure.width);
      int first = 0;
      while (first < figure.width && row[first] == 0) ++first;
      int last = figure.width;
      while (last > first && row[last - 1] == 0) --last;
      if (first == last) continue;
      span = {std::min(span.begin, first), std::max(span.end, last)};
    }
  }
  return out;
}

bool Overlay::covers(int x, int y, int count) const {
  const Span& span = spans_[static_cast<std::size_t>(y)];
  return span.begin < x + count && span.end > x;
}

void Overlay::composite(int x, int y, int count, float* rgba) const {
  const Span& span = spans_[static_cast<std::size_t>(y)];
  const std::size_t row = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_);
  for (int at = std::max(x, span.begin); at < std::min(x + count, span.end); ++at) {
    float* const pixel = rgba + 4 * static_cast<std::size_t>(at - x);
    const std::size_t n = row + static_cast<std::size_t>(at);
    if (!below_.empty() && below_[n] != 0) under(linear(below_[n]), pixel);
    if (!above_.empty() && above_[n] != 0) over(linear(above_[n]), pixel);
  }
}

}  // namespace windsplat::annotate
