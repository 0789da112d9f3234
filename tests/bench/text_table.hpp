// Rows of text -> Markdown or an aligned table for a terminal, and formatting of numbers.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <string>
#include <vector>

namespace windsplat::bench {

using Row = std::vector<std::string>;
using Table = std::vector<Row>;  // the first row names the columns

inline double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

inline std::string number(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

inline std::string markdown(const Table& table) {
  std::string text;
  for (std::size_t r = 0; r < table.size(); ++r) {
    text += "|";
    for (const std::string& cell : table[r]) {
      text += " ";
      text += cell;
      text += " |";
    }
    text += "\n";
    if (r > 0) continue;
    text += "|";
    for (std::size_t c = 0; c < table[r].size(); ++c) text += "---|";
    text += "\n";
  }
  return text;
}

// The first `left` columns are text, aligned left; the others are numbers.
inline std::string plain(const Table& table, std::size_t left = 2) {
  std::vector<std::size_t> widths(table.front().size());
  for (const Row& row : table) {
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], row[c].size());
  }
  std::string text;
  for (const Row& row : table) {
    for (std::size_t c = 0; c < row.size(); ++c) {
      const std::string space(widths[c] - row[c].size(), ' ');
      text += c < left ? row[c] + space : space + row[c];
      text += "  ";
    }
    text += "\n";
  }
  return text;
}

}  // namespace windsplat::bench
