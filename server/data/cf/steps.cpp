#include "server/data/cf/steps.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "server/data/cf/coordinates.hpp"
#include "server/data/cf/time.hpp"

namespace windsplat::data::cf {

namespace {

std::string times_text(std::size_t count) {
  return count == 1 ? std::string("once") : std::to_string(count) + " times";
}

// Sorts the times of a series; a single file keeps its own order.
void note_disorder(const std::string& name, const std::vector<double>& times, DatasetInfo& info) {
  std::size_t falls = 0;
  std::size_t repeats = 0;
  for (std::size_t i = 1; i < times.size(); ++i) {
    falls += times[i] < times[i - 1] ? 1U : 0U;
    repeats += times[i] == times[i - 1] ? 1U : 0U;
  }
  if (falls + repeats == 0) return;
  std::string note = in_quotes(name);
  if (falls > 0) note += " decreases " + times_text(falls);
  if (falls > 0 && repeats > 0) note += " and";
  if (repeats > 0) note += " does not increase " + times_text(repeats);
  note += ": steps are kept in the order of the file";
  info.notes.push_back(std::move(note));
}

std::string missing_text(const FileVariable& variable, const std::vector<double>& times) {
  std::size_t first = times.size();
  std::size_t count = 0;
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (std::isfinite(times[i])) continue;
    first = std::min(first, i);
    ++count;
  }
  const std::string steps = count > 1 ? std::to_string(count) + " steps, first at step " : "step ";
  const std::string what = variable.is_date_text
                               ? "the text of " + in_quotes(variable.name) +
                                     " is no date of the calendar " + variable.calendar + " at "
                               : "time is missing at ";
  return what + steps + std::to_string(first) + ": steps are numbered";
}

}  // namespace

Result<void> find_steps(const ArrayFile& file, int time, int coordinate, DatasetInfo& info) {
  const FileContents& contents = file.contents();
  const auto& variables = contents.variables;
  std::size_t count = 1;
  if (time >= 0) {
    count = contents.dimensions.at(at(time)).length;
  } else {
    for (std::size_t v = 0; v < variables.size(); ++v) {
      if (variables[v].dims.empty() && variables[v].numeric &&
          (variables[v].standard_name == "time" || variables[v].name == "time")) {
        coordinate = static_cast<int>(v);
      }
    }
  }
  std::vector<double> values;
  if (coordinate >= 0) {
    auto read = unpacked_values(file, coordinate);
    if (!read) {
      return read.error();
    }
    values = std::move(*read);
  }
  const bool complete = !values.empty() && std::all_of(values.begin(), values.end(),
                                                       [](double v) { return std::isfinite(v); });
  if (complete) {
    const auto& variable = variables[static_cast<std::size_t>(coordinate)];
    auto decoded = decode_time(values, variable.units, variable.calendar);
    info.steps = std::move(decoded.steps);
    info.time_units = variable.units;
    info.time_calendar = variable.calendar;
    if (!decoded.reason.empty()) {
      info.left_out.push_back({variable.name, "times are shown as numbers: " + decoded.reason});
    }
    note_disorder(variable.name, values, info);
    return {};
  }
  if (time >= 0) {
    info.left_out.push_back({contents.dimensions.at(at(time)).name,
                             !values.empty() ? missing_text(variables.at(at(coordinate)), values)
                                             : "dimension without a coordinate variable: steps "
                                               "are numbered"});
  }
  for (std::size_t i = 0; i < count; ++i) {
    info.steps.push_back({static_cast<double>(i), std::to_string(i)});
  }
  return {};
}

}  // namespace windsplat::data::cf
