// Words and numbers of text headers, and numbered file names.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace windsplat::data::bytes {

std::vector<std::string_view> words_of(std::string_view text);

// The entire text as a number, in the C locale; a leading + is allowed.
std::optional<double> to_double(std::string_view text);
std::optional<std::int64_t> to_integer(std::string_view text);
// The same for a sample: a value beyond the range of double becomes infinite or 0, with its sign.
std::optional<double> to_sample(std::string_view text);

// 0 to 15; -1 if it is not a hexadecimal digit.
int hex_digit(char c);

// Replaces the only %d, %4d or %04d of a name with a number. nullopt unless there is exactly one
// such conversion and none of another kind.
std::optional<std::string> numbered_name(std::string_view pattern, std::int64_t number);

}  // namespace windsplat::data::bytes
