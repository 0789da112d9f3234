// The page of a report without its data, embedded in the binary: made by web/embed.cmake from
// web/report.
#pragma once

#include <string_view>

namespace windsplat::study {

std::string_view report_template();  // with the marker %STUDY% in place of the JSON

}  // namespace windsplat::study
