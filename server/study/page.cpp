// Report -> one self-contained HTML page: plots inline, pictures as base64 PNG, no scripts.
#include <algorithm>
#include <cmath>
#include <vector>

#include "protocol/codec.hpp"
#include "server/image/encode.hpp"
#include "server/study/report.hpp"

namespace windsplat::study {

namespace {

constexpr const char* style =
    "body{font:15px/1.5 system-ui,sans-serif;color:#1b1d22;background:#fafafb;max-width:1080px;"
    "margin:2em auto;padding:0 1em}"
    "h1{font-size:1.6em}h2{margin-top:2.2em;border-bottom:1px solid #d8d8de}"
    "table{border-collapse:collapse;font-size:13px;margin:.8em 0}"
    "th,td{padding:.15em .7em;text-align:right;border-bottom:1px solid #e6e6ea}"
    "th{background:#f0f0f4}td:first-child,th:first-child{text-align:left}"
    "tr.front td{background:#fff6dd}tr.bad td{color:#b00020}"
    ".plot{background:#fff;border:1px solid #e0e0e6;max-width:980px}"
    ".pictures{display:flex;flex-wrap:wrap;gap:14px 28px}.pair{display:flex;gap:6px}"
    "figure{margin:0}figcaption{font-size:13px;color:#555}"
    "img{display:block;image-rendering:pixelated;background:#000}"
    "details{margin:.6em 0}pre{white-space:pre-wrap;font-size:12px;background:#f0f0f4;padding:.8em}"
    ".scroll{overflow-x:auto}";

std::string base64(const image::Bytes& bytes) {
  constexpr const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t have = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k) word = word << 8U | (k < have ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k) {
      text += k <= have ? digits[word >> (18 - 6 * k) & 63U] : '=';
    }
  }
  return text;
}

Result<std::string> figure(const std::vector<std::uint8_t>& rgb, const SceneReport& scene,
                           const std::string& caption) {
  const auto png = image::encode_png(rgb, scene.width, scene.height);
  if (!png) return png.error();
  std::string text = "<figure><img alt=\"" + escaped(scene.name + ", " + caption);
  text += "\" width=\"" + std::to_string(std::max(200, std::min(2 * scene.width, 320)));
  text += "\" src=\"data:image/png;base64," + base64(*png);
  text += "\"><figcaption>" + escaped(caption) + "</figcaption></figure>\n";
  return text;
}

Result<std::string> pictures(const SceneReport& scene) {
  std::string text = "<div class=\"pictures\">\n";
  for (const Shown& shown : scene.pictures) {
    text += "<div class=\"pair\">";
    const auto picture = figure(shown.rgb, scene, shown.title);
    if (!picture) return picture.error();
    text += *picture;
    if (!shown.difference_rgb.empty()) {
      const auto apart = figure(shown.difference_rgb, scene, "difference x 10");
      if (!apart) return apart.error();
      text += *apart;
    }
    text += "</div>\n";
  }
  text += "</div>\n";
  return text;
}

void cell(std::string& text, const std::string& words) { text += "<td>" + words + "</td>"; }

std::string points_table(const SceneReport& scene) {
  std::vector<const Point*> points;
  for (const Point& point : scene.points) points.push_back(&point);
  std::stable_sort(points.begin(), points.end(), [](const Point* a, const Point* b) {
    const double x = a->measured.rmse;
    const double y = b->measured.rmse;
    return std::isnan(y) ? !std::isnan(x) : x < y;
  });
  std::string text =
      "<div class=\"scroll\"><table><tr><th>method</th><th>stride</th><th>span</th>"
      "<th>slab thickness</th><th>stop</th><th>width</th><th>RMSE</th><th>max</th><th>PSNR</th>"
      "<th>FLIP</th><th>ms</th><th>least</th><th>most</th></tr>\n";
  for (const Point* point : points) {
    const auto& [setting, m, pareto] = *point;
    text += !m.stable ? "<tr class=\"bad\">" : pareto ? "<tr class=\"front\">" : "<tr>";
    cell(text, std::string(name_of(setting.method)) + " " + name_of(setting.compositing));
    cell(text, std::to_string(setting.knobs.stride));
    cell(text, format_number("%g", setting.knobs.span));
    const bool slab = setting.method == scene::Method::slab;
    cell(text, slab ? format_number("%g", setting.knobs.slab_thickness) : "");
    cell(text, format_number("%g", setting.knobs.stop_transmittance));
    cell(text, std::to_string(setting.knobs.width));
    cell(text, format_number("%.2e", m.rmse));
    cell(text, format_number("%.2e", m.max));
    cell(text, format_number("%.1f", m.psnr));
    cell(text, format_number("%.4f", m.flip));
    cell(text, format_number("%.2f", m.ms));
    cell(text, format_number("%.2f", m.ms_min));
    cell(text, format_number("%.2f", m.ms_max));
    text += "</tr>\n";
  }
  return text + "</table></div>\n";
}

std::string encoding_table(const SceneReport& scene) {
  std::string text =
      "<table><tr><th>JPEG quality</th><th>RMSE, linear</th><th>PSNR</th><th>FLIP</th>"
      "<th>bytes</th></tr>\n";
  for (const Encoded& e : scene.encoded) {
    text += "<tr>";
    cell(text, std::to_string(e.quality));
    cell(text, format_number("%.2e", e.rmse));
    cell(text, format_number("%.1f", e.psnr));
    cell(text, format_number("%.4f", e.flip));
    cell(text, std::to_string(e.bytes));
    text += "</tr>\n";
  }
  return text + "</table>\n";
}

std::string reference_words(const SceneReport& scene) {
  std::string text = std::to_string(scene.width) + " x " + std::to_string(scene.height);
  text += " pixels. ";
  if (!scene.integral) {
    return text +
           "No integral was taken: the truth is extrapolated from slabs of thickness 1/4 "
           "and 1/8, its own error about " +
           format_number("%.1e", scene.truth_estimate) + ".";
  }
  text += "The truth is the integral in double precision: ";
  text += std::to_string(scene.pieces) + " pieces, " + std::to_string(scene.evaluations);
  text += " evaluations";
  text += ", tolerance " + format_number("%g", scene.tolerance);
  if (std::isfinite(scene.truth_seconds)) {
    text += ", " + format_number("%.1f", scene.truth_seconds) + " s";
  }
  return text + ".";
}

Result<std::string> section(const SceneReport& scene) {
  std::string text = "<h2 id=\"" + escaped(scene.name) + "\">" + escaped(scene.name) + "</h2>\n";
  text += "<p>" + reference_words(scene) + "</p>\n<div class=\"plot\">" + plot_svg(scene);
  text += "</div>\n";
  if (scene.reconstruction_ripple > 0) {
    text += "<p>Reconstruction ripple (not in these errors): ";
    text += format_number("%.1e", scene.reconstruction_ripple);
    text +=
        " of overlapping footprints against an even medium of optical depth 1. The truth is made "
        "of the same footprints and ripples alike.</p>\n";
  }
  text += "<details><summary>Every point, the most exact first</summary>" + points_table(scene);
  text += "</details>\n<details><summary>The encoding alone</summary>" + encoding_table(scene);
  text += "</details>\n<details><summary>The view</summary><pre>";
  text += escaped(protocol::encode_view(scene.view)) + "</pre></details>\n";
  const auto shown = pictures(scene);
  if (!shown) return shown.error();
  return text + *shown + calibration_section(scene);
}

std::string optical_depth(double tau) {
  return tau >= 1e30 ? "1e30 (the largest)" : format_number("%g", tau);
}

std::string stability_table(const std::vector<Stiffness>& all) {
  std::string text =
      "<h2 id=\"stability\">Stiffness</h2>\n<p>One kernel, a line of opacity 0.6 at nine depths of "
      "a cell of optical depth &tau;, against its closed form; and " +
      std::to_string(stiff_layers) +
      " such cells of medium alone behind each other. Drawn by the engine itself. Extinctions of a "
      "view are "
      "bounded by 1e30 per world unit, so that the last &tau; is the largest.</p>\n"
      "<div class=\"scroll\"><table><tr><th>compositing</th><th>&tau;</th><th>largest error</th>"
      "<th>least</th><th>most</th><th>within [0, 1]</th><th>monotone in &tau;</th>"
      "<th>layers, least</th><th>layers, most</th><th>diverges</th></tr>\n";
  for (const Stiffness& s : all) {
    const bool fit = s.bounded && s.monotone && !s.diverges;
    text += fit ? "<tr>" : "<tr class=\"bad\">";
    cell(text, name_of(s.compositing));
    cell(text, optical_depth(s.tau));
    cell(text, format_number("%.1e", s.error));
    cell(text, format_number("%.4g", s.min));
    cell(text, format_number("%.4g", s.max));
    cell(text, s.bounded ? "yes" : "no");
    cell(text, s.monotone ? "yes" : "no");
    cell(text, format_number("%.4g", s.layers_min));
    cell(text, format_number("%.4g", s.layers_max));
    cell(text, s.diverges ? "yes" : "no");
    text += "</tr>\n";
  }
  return text + "</table></div>\n";
}

// Both methods at each view's own knobs.
std::string summary(const Report& report) {
  std::string text =
      "<table><tr><th>scene</th><th>kernel analytic, RMSE</th><th>ms</th>"
      "<th>slab analytic, RMSE</th><th>ms</th><th>on the front</th></tr>\n";
  for (const SceneReport& scene : report.scenes) {
    text += "<tr><td><a href=\"#" + escaped(scene.name) + "\">" + escaped(scene.name) + "</a></td>";
    for (const scene::Method method : {scene::Method::kernel, scene::Method::slab}) {
      const Knobs wanted = own_knobs(scene.view);
      const auto own = std::find_if(scene.points.begin(), scene.points.end(), [&](const Point& p) {
        Knobs knobs = p.setting.knobs;
        if (method == scene::Method::kernel) knobs.slab_thickness = wanted.slab_thickness;
        return p.setting.method == method &&
               p.setting.compositing == scene::Compositing::analytic && knobs == wanted;
      });
      const bool there = own != scene.points.end();
      cell(text, there ? format_number("%.2e", own->measured.rmse) : "");
      cell(text, there ? format_number("%.2f", own->measured.ms) : "");
    }
    cell(text, std::to_string(std::count_if(scene.points.begin(), scene.points.end(),
                                            [](const Point& p) { return p.pareto; })));
    text += "</tr>\n";
  }
  return text + "</table>\n";
}

}  // namespace

Result<std::string> report_page(const Report& report) {
  const Machine& machine = report.machine;
  std::string text =
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width\">"
      "<title>windsplat: error against run time</title><style>";
  text += style;
  text += "</style></head><body>\n<h1>windsplat: error against run time</h1>\n<p>windsplat ";
  text += escaped(machine.version) + " (" + escaped(machine.kernels) + "), built by ";
  text += escaped(machine.compiler) + ", on " + escaped(machine.processor) + ", ";
  text += escaped(machine.system) + ": " + std::to_string(machine.threads) + " threads of ";
  text += std::to_string(machine.hardware_threads) + ". Each time is the median of ";
  text += std::to_string(report.runs) + " runs after one to warm up. ";
  text += std::to_string(report.measured) + " points measured";
  if (report.skipped > 0) text += ", " + std::to_string(report.skipped) + " taken from before";
  text += ", in " + format_number("%.1f", report.seconds) + " s.";
  text += report.quick ? " A quick study: small pictures and few points.</p>\n" : "</p>\n";
  text += summary(report);
  for (const SceneReport& scene : report.scenes) {
    const auto one = section(scene);
    if (!one) return one.error();
    text += *one;
  }
  text += stability_table(report.stability);
  text += "</body></html>\n";
  return text;
}

}  // namespace windsplat::study
