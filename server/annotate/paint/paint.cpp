#include "server/annotate/paint/paint.hpp"

#include <cairo/cairo.h>

#include <variant>

#include "server/annotate/paint/type.hpp"

namespace windsplat::annotate {
namespace {

class Painter {
 public:
  explicit Painter(cairo_t* target) : target_(target) {}

  void operator()(const Line& line) const {
    path(line.points);
    color(line.color);
    cairo_set_line_width(target_, line.width);
    cairo_set_line_cap(target_, CAIRO_LINE_CAP_ROUND);
    cairo_set_line_join(target_, CAIRO_LINE_JOIN_ROUND);
    cairo_stroke(target_);
  }
  void operator()(const Area& area) const {
    path(area.points);
    cairo_close_path(target_);
    color(area.color);
    cairo_fill(target_);
  }
  void operator()(const Strip& strip) const {
    cairo_pattern_t* const colors =
        cairo_pattern_create_linear(strip.corner.x, 0, strip.corner.x + strip.width, 0);
    const double last = strip.colors.size() > 1 ? static_cast<double>(strip.colors.size() - 1) : 1;
    for (std::size_t n = 0; n < strip.colors.size(); ++n) {
      const Color& at = strip.colors[n];
      cairo_pattern_add_color_stop_rgba(colors, static_cast<double>(n) / last, at.red, at.green,
                                        at.blue, at.alpha);
    }
    cairo_rectangle(target_, strip.corner.x, strip.corner.y, strip.width, strip.height);
    cairo_set_source(target_, colors);
    cairo_fill(target_);
    cairo_pattern_destroy(colors);
  }
  void operator()(const Text& text) const { draw_text(target_, text); }

 private:
  void path(const std::vector<Point>& points) const {
    cairo_new_path(target_);
    for (const Point& point : points) cairo_line_to(target_, point.x, point.y);
  }
  void color(const Color& color) const {
    cairo_set_source_rgba(target_, color.red, color.green, color.blue, color.alpha);
  }

  cairo_t* target_;
};

}  // namespace

void paint(const std::vector<Item>& items, cairo_t* target) {
  for (const Item& item : items) std::visit(Painter(target), item);
}

}  // namespace windsplat::annotate
