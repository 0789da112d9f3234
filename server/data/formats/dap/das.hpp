// Dataset Attribute Structure: the attributes of the variables of an OPeNDAP dataset (DAP 2.0, 4.4
// and 7.2).
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"

namespace windsplat::data::dap {

inline constexpr std::size_t attributes_max = 100'000;

struct Attribute {
  bool is_text = false;
  bool is_floating = false;     // Float32 or Float64
  std::string text;             // texts joined by line breaks
  std::vector<double> numbers;  // empty for text
};

using Attributes = std::map<std::string, Attribute>;

// By the name of the variable; NC_GLOBAL has those of the dataset. Attributes within attributes
// (those of structures) are left out. Errors: bad_data without the name of the file.
Result<std::map<std::string, Attributes>> parse_das(std::string_view text);

}  // namespace windsplat::data::dap
