// Pieces of a drawing as SVG: logarithmic axes, lines and words.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace windsplat::study {

struct LogAxis {
  double low = 1;  // of the values
  double high = 10;
  double from = 0;  // pixels
  double to = 1;

  [[nodiscard]] double at(double value) const;
};

// Room around the values, at least half a decade.
LogAxis make_axis(double low, double high, double from, double to);

// Values of 1, 2 and 5 times powers of ten within the axis; few decades get all three.
std::vector<double> ticks(const LogAxis& axis);

bool drawable(double value);  // on a logarithmic axis

// White, with its title.
std::string svg_head(double width, double height, const std::string& title);
std::string number(double value);  // a tenth of a pixel is enough
std::string attribute(const char* name, double value);
std::string line(double x1, double y1, double x2, double y2, const std::string& style);
std::string label(double x, double y, const std::string& words, const std::string& extra = "");
std::string joined(std::initializer_list<std::string_view> parts);

// Both axes with their ticks, and the frame around them: the horizontal one along its lower edge.
std::string axes(const LogAxis& x, const LogAxis& y, const char* y_format);

}  // namespace windsplat::study
