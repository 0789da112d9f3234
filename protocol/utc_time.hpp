// Times of the form 2024-06-21T12:00:00Z.
#pragma once

#include <ctime>
#include <optional>
#include <string>
#include <string_view>

namespace windsplat::protocol {

// Days since 2000-01-01 12:00 UTC of YYYY-MM-DDThh:mmZ or YYYY-MM-DDThh:mm:ssZ in the Gregorian
// calendar. Empty: not of this form, or no such time.
std::optional<double> days_since_2000(std::string_view utc);

std::string utc_text(std::time_t time);  // to the second

}  // namespace windsplat::protocol
