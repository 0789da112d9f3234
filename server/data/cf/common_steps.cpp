#include "server/data/cf/common_steps.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "server/data/cf/coordinates.hpp"
#include "server/data/cf/time.hpp"

namespace windsplat::data::cf {

namespace {

// Whether a time is among ascending ones.
bool has_time(const std::vector<double>& times, double time, double tolerance) {
  const auto near = std::lower_bound(times.begin(), times.end(), time - tolerance);
  return near != times.end() && *near <= time + tolerance;
}

}  // namespace

void keep_common_steps(const std::vector<SeriesFile*>& parts) {
  const auto damaged = [](const SeriesFile* part) { return part->has_damaged_files(); };
  if (parts.size() < 2 || std::none_of(parts.begin(), parts.end(), damaged)) return;
  std::vector<std::vector<double>> times;  // of each part, in the unit of the first
  for (const SeriesFile* part : parts) {
    const FileVariable* own = part->time_coordinate();
    const FileVariable* first = parts.front()->time_coordinate();
    if (own == nullptr || first == nullptr) return;
    const auto converted =
        convert_times(part->times(), {own->units, own->calendar}, {first->units, first->calendar});
    if (!converted) return;
    times.push_back(*converted);
  }
  std::vector<std::vector<std::size_t>> kept(parts.size());
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const double tolerance = time_tolerance(times[p]);
    for (std::size_t step = 0; step < times[p].size(); ++step) {
      bool common = true;
      for (std::size_t other = 0; other < parts.size(); ++other) {
        common =
            common && (!damaged(parts[other]) || has_time(times[other], times[p][step], tolerance));
      }
      if (common) kept[p].push_back(step);
    }
    if (kept[p].empty()) return;
  }
  for (std::size_t p = 0; p < parts.size(); ++p) parts[p]->keep_steps(kept[p]);
}

}  // namespace windsplat::data::cf
