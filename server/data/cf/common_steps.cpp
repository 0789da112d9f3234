#include "server/data/cf/common_steps.hpp"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/cf/coordinates.hpp"

namespace windsplat::data::cf {

namespace {

// Whether a time is among ascending ones.
bool has_time(const std::vector<double>& times, double time, double tolerance) {
  const auto near = std::lower_bound(times.begin(), times.end(), time - tolerance);
  return near != times.end() && *near <= time + tolerance;
}

}  // namespace

Result<void> keep_common_steps(const std::vector<SeriesFile*>& parts) {
  const auto damaged = [](const SeriesFile* part) { return part->has_damaged_files(); };
  if (parts.size() < 2 || std::none_of(parts.begin(), parts.end(), damaged)) return {};
  const auto numbered = std::find_if(parts.begin(), parts.end(), [](const SeriesFile* part) {
    return part->time_coordinate() == nullptr;
  });
  if (numbered != parts.end()) {
    std::string text = in_quotes((*numbered)->origin()) +
                       " cannot be joined: its steps are numbered and files are damaged";
    for (const SeriesFile* part : parts) text += damage_of(*part);
    return make_error(ErrorKind::bad_data, text);
  }
  std::vector<RoundedTimes> times;  // of each part, in the unit of the first
  for (const SeriesFile* part : parts) {
    auto own = times_in(part->times(), *part->time_coordinate(), *parts.front()->time_coordinate());
    if (!own) return {};
    times.push_back(std::move(*own));
  }
  std::vector<std::vector<std::size_t>> kept(parts.size());
  for (std::size_t p = 0; p < parts.size(); ++p) {
    for (std::size_t step = 0; step < times[p].values.size(); ++step) {
      bool common = true;
      for (std::size_t other = 0; other < parts.size(); ++other) {
        common = common &&
                 (!damaged(parts[other]) || has_time(times[other].values, times[p].values[step],
                                                     time_tolerance(times[p], times[other])));
      }
      if (common) kept[p].push_back(step);
    }
    if (kept[p].empty()) return {};
  }
  for (std::size_t p = 0; p < parts.size(); ++p) parts[p]->keep_steps(kept[p]);
  return {};
}

}  // namespace windsplat::data::cf
