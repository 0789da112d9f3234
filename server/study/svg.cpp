// Numbers and words -> SVG.
#include "server/study/svg.hpp"

#include <algorithm>
#include <cmath>

#include "server/study/report.hpp"

namespace windsplat::study {

double LogAxis::at(double value) const {
  const double share = std::log(value / low) / std::log(high / low);
  return from + std::clamp(share, 0.0, 1.0) * (to - from);
}

LogAxis make_axis(double low, double high, double from, double to) {
  if (!(low <= high)) low = high = 1;
  const double spread = std::max(std::log10(high / low), 0.5);
  const double margin = std::pow(10, 0.06 * spread + 0.5 * (spread - std::log10(high / low)));
  return {low / margin, high * margin, from, to};
}

std::vector<double> ticks(const LogAxis& axis) {
  const double decades = std::log10(axis.high / axis.low);
  std::vector<double> out;
  const int last = static_cast<int>(std::floor(std::log10(axis.high)));
  for (int power = static_cast<int>(std::floor(std::log10(axis.low))); power <= last; ++power) {
    for (const double factor : {1.0, 2.0, 5.0}) {
      if (factor > 1 && decades > 2.5) break;
      const double value = factor * std::pow(10, power);
      if (value >= axis.low * 0.999 && value <= axis.high * 1.001) out.push_back(value);
    }
  }
  return out;
}

bool drawable(double value) { return std::isfinite(value) && value > 0; }

std::string svg_head(double width, double height, const std::string& title) {
  std::string text = joined({"<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 ",
                             number(width), " ", number(height)});
  text += "\" font-family=\"sans-serif\" font-size=\"12\" role=\"img\">\n";
  text += "<title>" + escaped(title) + "</title>\n";
  text += "<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n";
  return text;
}

std::string number(double value) { return format_number("%.1f", value); }

std::string joined(std::initializer_list<std::string_view> parts) {
  std::string text;
  for (const std::string_view part : parts) text += part;
  return text;
}

std::string attribute(const char* name, double value) {
  std::string text(1, ' ');
  text += name;
  text += "=\"";
  text += number(value);
  text += '"';
  return text;
}

std::string line(double x1, double y1, double x2, double y2, const std::string& style) {
  std::string text = "<line" + attribute("x1", x1);
  text += attribute("y1", y1) + attribute("x2", x2) + attribute("y2", y2);
  text += " style=\"" + style + "\"/>\n";
  return text;
}

std::string label(double x, double y, const std::string& words, const std::string& extra) {
  std::string text = "<text" + attribute("x", x);
  text += attribute("y", y) + extra + ">" + escaped(words) + "</text>\n";
  return text;
}

std::string axes(const LogAxis& x, const LogAxis& y, const char* y_format) {
  std::string text;
  for (const double tick : ticks(x)) {
    text += line(x.at(tick), y.to, x.at(tick), y.from, "stroke:#e4e4e8");
    text += label(x.at(tick), y.from + 17, format_number("%g", tick),
                  " text-anchor=\"middle\" fill=\"#555555\"");
  }
  for (const double tick : ticks(y)) {
    text += line(x.from, y.at(tick), x.to, y.at(tick), "stroke:#e4e4e8");
    text += label(x.from - 7, y.at(tick) + 4, format_number(y_format, tick),
                  " text-anchor=\"end\" fill=\"#555555\"");
  }
  text += "<rect" + attribute("x", x.from) + attribute("y", y.to);
  text += attribute("width", x.to - x.from) + attribute("height", y.from - y.to);
  text += " fill=\"none\" stroke=\"#777777\"/>\n";
  return text;
}

}  // namespace windsplat::study
