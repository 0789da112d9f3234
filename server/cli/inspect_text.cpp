// Formats a description as text: one paragraph each for the grid, the fields, the steps, and notes.
#include "server/cli/inspect_text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"

namespace windsplat::cli {
namespace {

using Row = std::vector<std::string>;

// Float32 coordinates deviate from even spacing by rounding.
constexpr double uneven_tolerance = 1e-3;  // relative to the mean spacing
constexpr std::size_t steps_listed_max = 12;
constexpr std::size_t line_bytes_max = 80;  // for notes and reasons

std::string number(double value) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.7g", value);
  return text.data();
}

std::string short_number(double value) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.3g", value);
  return text.data();
}

// A name or unit from the file.
std::string word(std::string_view text, std::string_view if_empty = "-") {
  return text.empty() ? std::string(if_empty) : printable(text, 80);
}

// Text without truncation.
std::string whole(std::string_view text) { return printable(text, std::string::npos); }

std::string byte_count(std::uint64_t bytes) {
  constexpr std::array<const char*, 5> units{"B", "KiB", "MiB", "GiB", "TiB"};
  auto scaled = static_cast<double>(bytes);
  std::size_t unit = 0;
  for (; scaled >= 1024 && unit + 1 < units.size(); ++unit) scaled /= 1024;
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), unit == 0 ? "%.0f %s" : "%.1f %s", scaled, units[unit]);
  return text.data();
}

// Columns as wide as their widest cell, two spaces between, indented by two.
std::string table(const std::vector<Row>& rows) {
  std::vector<std::size_t> widths;
  for (const Row& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], row[c].size());
  }
  std::string out;
  for (const Row& row : rows) {
    std::string line;
    for (std::size_t c = 0; c < row.size(); ++c) {
      line += "  " + row[c] + std::string(widths[c] - row[c].size(), ' ');
    }
    line.erase(line.find_last_not_of(' ') + 1);
    out += line + '\n';
  }
  return out;
}

// Wraps words into lines of at most `line_bytes_max`; the first line has the given number of bytes
// before it, the others are indented.
std::string wrapped(std::string_view text, std::size_t indent) {
  std::string out;
  std::size_t line = indent;
  while (!text.empty()) {
    const std::string_view word = text.substr(0, text.find(' '));
    text.remove_prefix(std::min(text.size(), word.size() + 1));
    if (line > indent && line + 1 + word.size() > line_bytes_max) {
      out += '\n' + std::string(indent, ' ');
      line = indent;
    } else if (line > indent) {
      out += ' ';
      ++line;
    }
    out += word;
    line += word.size();
  }
  return out;
}

bool is_uneven(const std::vector<double>& coordinates) {
  if (coordinates.size() < 3) return false;
  const double mean =
      (coordinates.back() - coordinates.front()) / static_cast<double>(coordinates.size() - 1);
  for (std::size_t i = 1; i < coordinates.size(); ++i) {
    const double spacing = coordinates[i] - coordinates[i - 1];
    if (std::abs(spacing - mean) > uneven_tolerance * std::abs(mean)) return true;
  }
  return false;
}

// Whether longitudes of an even axis go around the globe, and it can be shown so.
bool is_whole_globe(const protocol::DatasetDescription& dataset) {
  const std::vector<double>& at = dataset.axes[0].coordinates;
  const bool may_be = std::count(dataset.mappings.begin(), dataset.mappings.end(), "sphere") > 0;
  if (!may_be || dataset.axes[0].kind != "longitude" || at.size() < 3) return false;
  const double span = std::abs(at.back() - at.front());
  return span + 1.5 * span / static_cast<double>(at.size() - 1) >= 360;
}

// The keys of a view that draw the ground. Where samples have heights above sea level of their own,
// the vertical axis does not tell where the ground is.
std::string ground_keys(const protocol::DatasetDescription& dataset) {
  for (const protocol::FieldDescription& field : dataset.fields) {
    if (field.standard_name != "geopotential_height" && field.standard_name != "altitude") continue;
    return "(/geometry/heightField=" + word(field.name) + " with /ground/show=on)";
  }
  return "(/ground/show=on)";
}

std::string grid_text(const protocol::DatasetDescription& dataset) {
  constexpr std::array<const char*, 3> letters{"x", "y", "z"};
  std::vector<Row> rows;
  for (std::size_t a = 0; a < 3; ++a) {
    const protocol::AxisDescription& axis = dataset.axes[a];
    const bool one = axis.coordinates.size() < 2;
    std::string span = axis.coordinates.empty() ? "-" : number(axis.coordinates.front());
    if (!one) span.append(" .. ").append(number(axis.coordinates.back()));
    if (!axis.units.empty()) span.append(" ").append(word(axis.units));
    rows.push_back({letters[a], word(axis.name), std::to_string(dataset.dims[a]), span, axis.kind,
                    one ? "" : (is_uneven(axis.coordinates) ? "uneven" : "even")});
  }
  std::string world = "world  ";
  for (std::size_t a = 0; a < 3; ++a) {
    if (a > 0) world += ", ";
    world += letters[a];
    world += ' ';
    world += number(dataset.world_min[a]);
    world += " .. ";
    world += number(dataset.world_max[a]);
  }
  if (const auto& times = dataset.vertical_exaggeration) {
    const bool by_pressure = dataset.axes[2].kind == "pressure";
    world += by_pressure ? "\nheights are drawn about " : "\nheights are drawn ";
    const bool to_scale = !by_pressure && std::abs(*times - 1) < 0.005;
    world += to_scale ? "to scale" : short_number(*times) + " times as high as to scale";
    if (by_pressure) world += ", by the standard atmosphere";
  }
  if (const auto& ground = dataset.ground) {
    world += ground->kind == "land" ? "\nground " : "\nsea floor ";
    world += word(ground->name) + ", " + number(ground->range[0]) + " .. " +
             number(ground->range[1]) + " m above sea level " + ground_keys(dataset);
  }
  if (std::count(dataset.mappings.begin(), dataset.mappings.end(), "curvilinear") > 0) {
    world +=
        "\neach column has a longitude and latitude: /geometry/mapping=curvilinear draws a map";
  }
  if (is_whole_globe(dataset)) {
    world += "\nthe longitudes go around: /geometry/mapping=sphere draws a globe, flat a map";
  }
  return "axes (first .. last)\n" + table(rows) + world + '\n';
}

std::string masked_text(const protocol::DatasetDescription& dataset,
                        const protocol::FieldDescription& field) {
  if (!field.masked) return "";
  if (*field.masked == 0) return "none masked";
  double samples = field.range_of == "all" ? static_cast<double>(dataset.steps.size()) : 1;
  for (const int dim : dataset.dims) samples *= dim;
  std::array<char, 40> share{};
  std::snprintf(share.data(), share.size(), " masked (%.3g %%)",
                100 * static_cast<double>(*field.masked) / samples);
  return std::to_string(*field.masked) + share.data();
}

std::string fields_text(const protocol::DatasetDescription& dataset) {
  std::vector<Row> rows;
  bool whole = false;
  const bool any_range = std::any_of(dataset.fields.begin(), dataset.fields.end(),
                                     [](const auto& field) { return !field.range_of.empty(); });
  for (const protocol::FieldDescription& field : dataset.fields) {
    whole = whole || field.range_of == "all";
    std::string kind = field.kind;
    if (field.kind == "vector") {
      kind += " (";
      for (const std::string& component : field.components) {
        if (kind.back() != '(') kind += ", ";
        kind += word(component);
      }
      kind += ')';
    }
    const bool waits = any_range && field.dtype == "derived";
    std::string range = field.masked ? "no value" : waits ? "computed when shown" : "not read";
    if (field.range) {
      range = field.kind == "vector" ? "|v| " : "";
      range.append(number((*field.range)[0])).append(" .. ").append(number((*field.range)[1]));
    }
    const std::string& meaning =
        field.standard_name.empty() ? field.long_name : field.standard_name;
    rows.push_back({word(field.name), kind, range, word(field.units, "(no units)"),
                    masked_text(dataset, field), field.dtype, word(meaning, "")});
  }
  if (rows.empty()) return "fields: none\n";
  if (!any_range) return "fields\n" + table(rows);
  return std::string("fields (ranges over ") +
         (whole && dataset.steps.size() > 1 ? "all steps" : "the first step") + ")\n" + table(rows);
}

std::string steps_text(const protocol::DatasetDescription& dataset) {
  const std::size_t count = dataset.steps.size();
  std::string out = "steps: " + std::to_string(count);
  if (!dataset.time_units.empty()) out += "  (" + word(dataset.time_units) + ')';
  if (count > 1) out += "; the first is /step=0";
  out += '\n';
  std::vector<Row> rows;
  for (std::size_t i = 0; i < count; ++i) {
    const bool left_out = count > steps_listed_max && i >= steps_listed_max - 2 && i + 1 < count;
    if (left_out) {
      if (i == steps_listed_max - 2) rows.push_back({"...", ""});
      continue;
    }
    rows.push_back({std::to_string(i), word(dataset.steps[i].text)});
  }
  return out + table(rows);
}

// For each dimension that is chosen from: its entry and the others.
std::string choices_text(const protocol::DatasetDescription& dataset) {
  constexpr std::size_t listed_max = 12;
  if (dataset.choices.empty()) return "";
  std::vector<Row> rows;
  for (const protocol::ChoiceDescription& choice : dataset.choices) {
    std::string values = "of " + std::to_string(choice.length) + ':';
    for (std::size_t i = 0; i < std::min(choice.values.size(), listed_max); ++i) {
      values += ' ' + word(choice.values[i]);
    }
    if (choice.length > listed_max) values += " ...";
    rows.push_back({word(choice.name), word(choice.chosen), values});
  }
  return "\nchosen\n" + table(rows);
}

std::string levels_text(const protocol::DatasetDescription& dataset) {
  if (dataset.levels.empty()) return "";
  std::vector<Row> rows;
  for (std::size_t n = 0; n < dataset.levels.size(); ++n) {
    const protocol::LevelDescription& level = dataset.levels[n];
    std::string dims;
    for (const int dim : level.dims) dims += (dims.empty() ? "" : " x ") + std::to_string(dim);
    rows.push_back({std::to_string(n), dims + " samples",
                    std::to_string(level.bricks) + (level.bricks == 1 ? " brick" : " bricks"),
                    byte_count(level.bytes) + " in memory at a step",
                    level.stored_bytes ? byte_count(*level.stored_bytes) + " on disk" : ""});
  }
  return "\nlevels\n" + table(rows);
}

}  // namespace

std::string inspect_text(const protocol::DatasetDescription& dataset) {
  std::string out = word(dataset.id) + ": " + word(dataset.title, "(no title)") + '\n';
  out += "from   " + word(dataset.source) + ", " + dataset.format + '\n';
  out += "grid   " + std::to_string(dataset.dims[0]) + " x " + std::to_string(dataset.dims[1]) +
         " x " + std::to_string(dataset.dims[2]) + " samples\n";
  out += "memory " + byte_count(dataset.bytes_when_resident) +
         " with every field resident at every step\n\n";
  out += grid_text(dataset) + '\n' + fields_text(dataset) + '\n' + steps_text(dataset);
  out += levels_text(dataset) + choices_text(dataset);
  if (!dataset.left_out.empty()) {
    std::size_t width = 0;
    for (const auto& left : dataset.left_out) width = std::max(width, word(left.first).size());
    out += "\nomitted\n";
    for (const auto& [variable, reason] : dataset.left_out) {
      const std::string name = word(variable);
      out += "  " + name + std::string(width - name.size() + 2, ' ');
      out += wrapped(whole(reason), width + 4) + '\n';
    }
  }
  if (!dataset.notes.empty()) {
    out += "\nnotes\n";
    for (const std::string& note : dataset.notes) {
      out += "  " + wrapped(whole(note), 4) + '\n';
    }
  }
  return out;
}

}  // namespace windsplat::cli
