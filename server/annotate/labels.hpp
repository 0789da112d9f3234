// Values -> round ticks and text as people write it.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "server/data/model/dataset_info.hpp"

namespace windsplat::annotate {

struct Tick {
  double value = 0;
  double at = 0;  // position along an edge or a strip
  std::string text;
};

// The step of 1, 2 or 5 times a power of ten that divides `range` into at most `most` parts; 0 for
// a range or number of parts that is not positive and finite.
double round_step(double range, int most);
// The same for degrees: 1, 2, 5, 10, 15, 30, 45 or 90, and below 1 as for other values.
double round_degrees(double range, int most);

// A value in as many decimals as its step has, with a true minus sign; with a power of ten where
// that takes more than 7 digits.
std::string number_text(double value, double step);
// `digits` significant digits.
std::string number_text_of(double value, int digits);

// Multiples of one round step within [low, high] (in either order), at most `most` + 1; positions
// are (value - low) / (high - low).
std::vector<Tick> even_ticks(double low, double high, int most);
// Multiples of `step`, which is positive.
std::vector<Tick> ticks_of_step(double low, double high, double step);

// Round values within [low, high] (in either order) at the positions `place` gives them, the
// roundest first, none nearer than `gap` to another: for axes that are not even. In order of value.
std::vector<Tick> uneven_ticks(double low, double high, double gap,
                               const std::function<double(double)>& place);

// As people write it: "m s-1", "m s**-1", "m s^-1", "meter second-1", "meters per second" -> "m
// s⁻¹";
// "" for "1".
std::string unit_text(std::string_view units);

// A coordinate of an axis: "10°E", "45°N", "500".
std::string coordinate_text(const data::Axis& axis, double value, double step);

// The name of an axis with its unit; empty for longitudes and latitudes, whose values tell it.
std::string axis_title(const data::Axis& axis);

// 2001-01-01T03:00:00Z -> 2001-01-01 03:00Z; other texts unchanged.
std::string time_text(std::string_view text);

}  // namespace windsplat::annotate
