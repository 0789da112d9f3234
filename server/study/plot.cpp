// A scene's points and curves -> one SVG, its axes logarithmic. Drawn on white, so that it may be
// printed and stand in any page.
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "server/study/report.hpp"
#include "server/study/svg.hpp"

namespace windsplat::study {

namespace {

// Pixels of the drawing.
constexpr double width = 980;
constexpr double height = 520;
constexpr double left = 70;
constexpr double right = 620;
constexpr double top = 40;
constexpr double bottom = 460;
constexpr double legend_left = 640;
constexpr double legend_step = 17;

const char* dash_of(Knob knob) {
  switch (knob) {
    case Knob::stride:
      return "7,4";
    case Knob::span:
      return "2,3";
    case Knob::slab_thickness:
      return "none";
    case Knob::stop_transmittance:
      return "9,3,2,3";
    case Knob::width:
      return "4,4";
  }
  return "none";
}

class Plot {
 public:
  explicit Plot(const SceneReport& scene) : scene_(scene) {
    constexpr double none = std::numeric_limits<double>::infinity();
    double ms_low = none;
    double ms_high = 0;
    double error_low = none;
    double error_high = 0;
    for (const Point& point : scene.points) {
      const Measurement& m = point.measured;
      if (drawable(m.ms_min)) ms_low = std::min(ms_low, m.ms_min);
      if (drawable(m.ms)) ms_high = std::max(ms_high, m.ms);
      if (!m.stable || !drawable(m.rmse)) continue;
      error_low = std::min(error_low, m.rmse);
      error_high = std::max(error_high, m.rmse);
    }
    if (drawable(scene.reconstruction_ripple)) {
      error_low = std::min(error_low, scene.reconstruction_ripple);
      error_high = std::max(error_high, scene.reconstruction_ripple);
    }
    x_ = make_axis(ms_low, ms_high, left, right);
    y_ = make_axis(error_low, error_high, bottom, top);
  }

  std::string svg() {
    text_ = svg_head(width, height, scene_.name + ": error against run time");
    frame();
    ripple();
    for (const Curve& curve : scene_.curves) draw(curve);
    front();
    for (const Point& point : scene_.points) mark(point);
    legend();
    text_ += "</svg>\n";
    return std::move(text_);
  }

 private:
  // Where a point stands; what has no error that can be drawn stands on the upper edge.
  [[nodiscard]] double x_of(const Point& p) const { return x_.at(p.measured.ms); }
  [[nodiscard]] double y_of(const Point& p) const {
    const double rmse = p.measured.rmse;
    if (rmse <= 0) return bottom;
    return drawable(rmse) ? y_.at(rmse) : top;
  }

  void frame() {
    text_ += axes(x_, y_, "%.0e");
    text_ += label(left, top - 14, scene_.name, " font-size=\"16\" font-weight=\"bold\"");
    text_ += label((left + right) / 2, bottom + 40, "run time, ms (median, least to most)",
                   " text-anchor=\"middle\"");
    text_ += "<text transform=\"translate(18 " + number((top + bottom) / 2) +
             ") rotate(-90)\" text-anchor=\"middle\">error, RMS of linear RGBA</text>\n";
  }

  void ripple() {
    if (!drawable(scene_.reconstruction_ripple)) return;
    const double y = y_.at(scene_.reconstruction_ripple);
    text_ += line(left, y, right, y, "stroke:#888888;stroke-dasharray:3,3");
    // Points crowd on the right where little is left to err.
    text_ += "<rect" + attribute("x", left + 6) + attribute("y", y - 17) +
             " width=\"222\" height=\"15\" fill=\"#ffffff\" opacity=\"0.8\"/>\n";
    text_ += label(left + 9, y - 5, "reconstruction ripple (not in these errors)",
                   " fill=\"#666666\" font-size=\"10.5\"");
  }

  void draw(const Curve& curve) {
    const std::string color = color_of(curve.method, curve.compositing);
    std::string path;
    bool pen_down = false;
    for (const std::size_t i : curve.points) {
      const Point& point = scene_.points[i];
      const bool shown = point.measured.stable && drawable(point.measured.rmse);
      if (shown) {
        path += pen_down ? 'L' : 'M';
        path += number(x_of(point)) + " " + number(y_of(point)) + " ";
      }
      pen_down = shown;
    }
    if (path.empty()) return;
    text_ += "<path d=\"" + path + "\" fill=\"none\" stroke=\"" + color +
             "\" stroke-width=\"1.6\" stroke-dasharray=\"" + dash_of(curve.knob) + "\"/>\n";
  }

  void front() {
    std::vector<const Point*> on_front;
    for (const Point& point : scene_.points) {
      if (point.pareto) on_front.push_back(&point);
    }
    std::sort(on_front.begin(), on_front.end(),
              [](const Point* a, const Point* b) { return a->measured.ms < b->measured.ms; });
    std::string path;
    for (const Point* point : on_front) {
      if (path.empty()) {
        path = joined({"M", number(x_of(*point)), " ", number(y_of(*point))});
      } else {
        path += joined({"H", number(x_of(*point)), "V", number(y_of(*point))});
      }
      text_ += "<circle" + attribute("cx", x_of(*point)) + attribute("cy", y_of(*point)) +
               " r=\"7\" fill=\"none\" stroke=\"#111111\" stroke-width=\"1.3\"/>\n";
    }
    if (path.empty()) return;
    text_ += "<path d=\"" + path +
             "\" fill=\"none\" stroke=\"#111111\" stroke-width=\"0.8\" opacity=\"0.55\"/>\n";
  }

  void mark(const Point& point) {
    const Measurement& m = point.measured;
    const std::string color = color_of(point.setting.method, point.setting.compositing);
    const double x = x_of(point);
    const double y = y_of(point);
    const double spread_high = std::min(m.ms_max, x_.high);
    if (drawable(m.ms_min)) {
      text_ += line(x_.at(m.ms_min), y, x_.at(spread_high), y,
                    "stroke:" + color + ";opacity:0.35;stroke-width:3");
    }
    if (m.stable && std::isfinite(m.rmse)) {
      text_ += symbol(point.setting.method, x, y, color, escaped(describe(point)));
      return;
    }
    text_ += line(x - 5, y - 5, x + 5, y + 5, "stroke:" + color + ";stroke-width:2.2");
    text_ += line(x - 5, y + 5, x + 5, y - 5, "stroke:" + color + ";stroke-width:2.2");
  }

  // A disc for method kernel, a square for method slab.
  static std::string symbol(scene::Method method, double x, double y, const std::string& color,
                            const std::string& says) {
    std::string text;
    const bool square = method == scene::Method::slab;
    if (square) {
      text = "<rect" + attribute("x", x - 3.2) + attribute("y", y - 3.2) +
             " width=\"6.4\" height=\"6.4\"";
    } else {
      text = "<circle" + attribute("cx", x) + attribute("cy", y) + " r=\"3.4\"";
    }
    text += " fill=\"" + color + "\">";
    if (!says.empty()) text += "<title>" + says + "</title>";
    text += square ? "</rect>\n" : "</circle>\n";
    return text;
  }

  static std::string describe(const Point& point) {
    std::string text = name_of(point.setting.method);
    text += ' ';
    text += name_of(point.setting.compositing);
    for (const Knob knob :
         {Knob::stride, Knob::span, Knob::slab_thickness, Knob::stop_transmittance, Knob::width}) {
      if (knob == Knob::slab_thickness && point.setting.method != scene::Method::slab) continue;
      text += ", ";
      text += name_of(knob);
      text += ' ' + format_number("%g", value_of(point.setting.knobs, knob));
    }
    text += ": " + format_number("%.2e", point.measured.rmse);
    text += " in " + format_number("%.3g", point.measured.ms) + " ms";
    return text;
  }

  void legend() {
    double y = top + 4;
    for (const Curve& curve : scene_.curves) {
      if (curve.points.size() < 2) continue;
      entry(curve, y);
    }
    for (const Curve& curve : scene_.curves) {
      if (curve.points.size() < 2) entry(curve, y);
    }
    y += 6;
    for (const char* const says : {"disc: kernel; square: slab; bar: least to most time",
                                   "ring, thin steps: the Pareto front",
                                   "cross: outside [0, 1] (on the upper edge: beyond it)",
                                   "slope: of log error over log knob"}) {
      text_ += label(legend_left, y, says, " fill=\"#555555\" font-size=\"11\"");
      y += legend_step - 2;
    }
  }

  void entry(const Curve& curve, double& y) {
    const std::string color = color_of(curve.method, curve.compositing);
    const bool single = curve.points.size() < 2;
    if (!single) {
      text_ +=
          line(legend_left, y - 4, legend_left + 26, y - 4,
               "stroke:" + color + ";stroke-width:1.8;stroke-dasharray:" + dash_of(curve.knob));
    }
    text_ += symbol(curve.method, legend_left + 13, y - 4, color, "");
    std::string words = name_of(curve.method);
    words += ' ';
    words += name_of(curve.compositing);
    if (!single) {
      words += ", ";
      words += name_of(curve.knob);
      if (std::isfinite(curve.order)) words += ": slope " + format_number("%.2f", curve.order);
    }
    text_ += label(legend_left + 33, y, words, " font-size=\"11\"");
    y += legend_step;
  }

  const SceneReport& scene_;
  LogAxis x_;
  LogAxis y_;
  std::string text_;
};

}  // namespace

const char* color_of(scene::Method method, scene::Compositing compositing) {
  const bool slab = method == scene::Method::slab;
  switch (compositing) {
    case scene::Compositing::analytic:
      return slab ? "#1f5fbf" : "#d1421f";
    case scene::Compositing::cd:
      return slab ? "#17a2b8" : "#e39a1d";
    case scene::Compositing::cd_naive:
      return slab ? "#6f5bd0" : "#b0478f";
    case scene::Compositing::simple:
      return slab ? "#3f8f4f" : "#8a6b3a";
    case scene::Compositing::cd_euler:
      return slab ? "#5a7f99" : "#6b6b6b";
  }
  return "#000000";
}

std::string plot_svg(const SceneReport& scene) { return Plot(scene).svg(); }

}  // namespace windsplat::study
