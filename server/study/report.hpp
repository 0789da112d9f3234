// Report -> the files that people and programs read.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "server/base/error.hpp"
#include "server/study/study.hpp"

namespace windsplat::study {

std::string report_json(const Report& report);
std::string report_csv(const Report& report);  // one line a point

// Error against run time, both logarithmic: a line a curve, rings on the Pareto front, crosses for
// unstable points (on the upper edge when beyond it), the reconstruction ripple dashed, orders
// in the legend.
std::string plot_svg(const SceneReport& scene);

// Errors told against true ones, both logarithmic, with the band of a factor of 2; and that with
// its tables for the page. Empty where nothing was calibrated.
std::string calibration_svg(const SceneReport& scene);
std::string calibration_section(const SceneReport& scene);

// One page that needs nothing else: plots, tables, and the pictures beside their differences.
Result<std::string> report_page(const Report& report);

// study.json, study.csv, plot-NAME.svg, calibration-NAME.svg and index.html. Errors: internal.
Result<void> write_report(const Report& report, const std::filesystem::path& folder);

// "#rrggbb" of a method and compositing, the same in every plot.
const char* color_of(scene::Method method, scene::Compositing compositing);

// "%.3g" and the like; "-" for what is not a number.
std::string format_number(const char* format, double value);

// Text made fit for XML.
std::string escaped(std::string_view text);

}  // namespace windsplat::study
