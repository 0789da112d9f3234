// Report -> files for people and programs.
#pragma once

#include <filesystem>
#include <string>

#include "server/base/error.hpp"
#include "server/study/study.hpp"

namespace windsplat::study {

std::string report_json(const Report& report);  // protocol/study.schema.json
std::string report_csv(const Report& report);   // one line per point

// A self-contained HTML page: the document of report_json and the pictures as JSON, and the script
// of web/report that draws its figures and tables. Errors: internal.
Result<std::string> report_page(const Report& report);

// study.json, study.csv (of extreme cases: extremes.csv) and index.html. Errors: internal.
Result<void> write_report(const Report& report, const std::filesystem::path& folder);

// Quoted if it contains a comma or a quote (RFC 4180).
std::string csv_text(const std::string& text);

// A printf format such as "%.3g"; "-" for NaN.
std::string format_number(const char* format, double value);

}  // namespace windsplat::study
