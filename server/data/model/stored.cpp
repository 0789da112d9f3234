// Checks of what is stored, and the search for a level among it.
#include "server/data/model/stored.hpp"

#include <algorithm>
#include <cmath>

#include "server/base/error.hpp"
#include "server/data/model/middles.hpp"

namespace windsplat::data {

namespace {

constexpr std::array<int, 3> full{0, 0, 0};

const StoredField* field_of(const DatasetInfo& info, std::size_t field) {
  const bool is_there = info.stored != nullptr && field < info.stored->fields.size();
  return is_there ? &info.stored->fields[field] : nullptr;
}

bool are_widths(const std::vector<double>& widths, std::size_t samples) {
  constexpr double most = 1e200;  // sums are finite
  return widths.empty() ||
         (widths.size() == samples &&
          std::all_of(widths.begin(), widths.end(), [](double w) { return w > 0 && w < most; }));
}

bool is_range(const StoredRange& of, std::size_t samples) {
  const auto all = static_cast<std::int64_t>(samples);
  return std::isfinite(of.range[0]) && std::isfinite(of.range[1]) && of.range[0] <= of.range[1] &&
         of.masked >= 0 && of.masked <= all;
}

std::string fault_of_levels(const StoredLevels& stored, const DatasetInfo& info) {
  const auto& levels = stored.levels;
  if (levels.empty() || levels.size() > stored_levels_max || levels[0] != full) {
    return "the number of levels is not 1 to " + std::to_string(stored_levels_max) +
           ", or the first has halvings";
  }
  for (std::size_t n = 1; n < levels.size(); ++n) {
    for (std::size_t a = 0; a < 3; ++a) {
      const int h = levels[n].at(a);
      if (h < levels[n - 1].at(a) || h > stored_halvings_max) {
        return "the halvings of level " + std::to_string(n) + " do not ascend to at most " +
               std::to_string(stored_halvings_max);
      }
    }
    if (levels[n] == levels[n - 1]) {
      return "level " + std::to_string(n) + " has the halvings of the one before";
    }
  }
  if (!stored.bytes.empty() && stored.bytes.size() != levels.size()) {
    return "the bytes of levels are not those of each level";
  }
  for (std::size_t a = 0; a < 3; ++a) {
    if (!are_widths(stored.widths.at(a), info.grid.axes.at(a).coordinates.size())) {
      return "the cell widths of an axis are not positive numbers, one for each sample";
    }
  }
  return {};
}

std::string fault_of_field(const StoredField& stored, const FieldInfo& field, std::size_t levels,
                           const DatasetInfo& info) {
  const bool is_vector = field.kind == FieldKind::vector;
  if (stored.has_levels && !field.is_read_by_boxes()) {
    return "its samples are converted when they are read, those of levels are not";
  }
  if (stored.has_levels && !is_vector && stored.ranges.empty()) return "its ranges are not stored";
  const int strided_most =
      stored.has_levels && is_vector
          ? std::min(strided_levels_max, static_cast<int>(std::min(levels, stored_levels_max)) - 1)
          : 0;
  if (stored.strided < 0 || stored.strided > strided_most) {
    return "it may have middles of kernels at " + std::to_string(strided_most) + " levels";
  }
  if (!stored.ranges.empty() && stored.ranges.size() != info.steps.size()) {
    return "its ranges are not of every step";
  }
  const std::size_t samples = info.grid.samples();
  for (const StoredRange& range : stored.ranges) {
    if (!is_range(range, samples)) return "a range is not one of numbers";
  }
  return {};
}

// Equal widths of an axis whose widths are not stored.
Coarsening with_widths(const StoredLevels& stored, const Coarsening& how) {
  Coarsening out = how;
  for (std::size_t a = 0; a < 3; ++a) {
    if (how.halvings.at(a) == 0) continue;
    out.widths.at(a) = stored.widths.at(a);
    if (out.widths.at(a).empty()) out.widths.at(a).assign(how.widths.at(a).size(), 1.0);
  }
  return out;
}

// Counts masked samples. False: as in measure_part().
bool measure_two_values(Volume& volume) {
  const std::size_t samples = volume.samples();
  std::array<const float*, TwoValues::components> of{};
  for (int c = 0; c < TwoValues::components; ++c) {
    of.at(static_cast<std::size_t>(c)) = volume.component(c);
  }
  std::int64_t masked = 0;
  bool sound = true;
  for (std::size_t n = 0; n < samples; ++n) {
    const auto is_number = [n](const float* values) { return std::isfinite(values[n]) ? 1 : 0; };
    const int numbers = is_number(of[0]) + is_number(of[1]) + is_number(of[2]) + is_number(of[3]);
    masked += numbers == 0 ? 1 : 0;
    const float low = of[TwoValues::low_share][n];
    const float high = of[TwoValues::high_share][n];
    constexpr float whole = 1.0001F;  // sums of rounded weights
    const bool is_share = low >= 0 && low <= whole && high >= 0 && high <= whole;
    const bool is_masked =
        std::isnan(of[0][n]) && std::isnan(of[1][n]) && std::isnan(low) && std::isnan(high);
    sound = sound && ((numbers == TwoValues::components && is_share) || is_masked);
  }
  volume.masked = masked;
  return sound;
}

}  // namespace

std::string fault_of(const StoredLevels& stored, const DatasetInfo& info) {
  if (std::string fault = fault_of_levels(stored, info); !fault.empty()) return fault;
  if (stored.fields.size() > info.fields.size()) return "levels of fields that there are not";
  for (std::size_t f = 0; f < stored.fields.size(); ++f) {
    const std::string fault =
        fault_of_field(stored.fields[f], info.fields[f], stored.levels.size(), info);
    if (!fault.empty()) return in_quotes(info.fields[f].name) + ": " + fault;
  }
  return {};
}

std::optional<std::array<int, 3>> stored_dims(const DatasetInfo& info, std::size_t field,
                                              std::size_t level, StoredAs as) {
  std::array<int, 3> dims = info.grid.dims();
  if (level == 0 && as == StoredAs::samples) return dims;
  const StoredField* const of = field_of(info, field);
  if (of == nullptr || !of->has_levels || level == 0 || level >= info.stored->levels.size()) {
    return std::nullopt;
  }
  const bool is_vector = info.fields.at(field).kind == FieldKind::vector;
  const bool is_there = as == StoredAs::drawn        ? is_vector
                        : as == StoredAs::two_values ? !is_vector
                        : as == StoredAs::strided    ? static_cast<int>(level) <= of->strided
                                                     : false;
  if (!is_there) return std::nullopt;
  for (std::size_t a = 0; a < 3; ++a) {
    const int h =
        as == StoredAs::strided ? static_cast<int>(level) : info.stored->levels[level].at(a);
    dims.at(a) = halved(dims.at(a), h);
  }
  return dims;
}

bool is_stored(const DatasetInfo& info, std::size_t field, const StoredPart& part) {
  if (part.level == 0 && !info.fields.at(field).is_read_by_boxes()) return false;
  const auto dims = stored_dims(info, field, part.level, part.as);
  return dims && is_within(part.box, *dims);
}

std::optional<std::size_t> level_of(const DatasetInfo& info, const std::array<int, 3>& halvings) {
  if (info.stored == nullptr) return std::nullopt;
  const auto& levels = info.stored->levels;
  const auto found = std::find(levels.begin(), levels.end(), halvings);
  if (found == levels.end()) return std::nullopt;
  return static_cast<std::size_t>(found - levels.begin());
}

std::uint64_t bricks_of(const DatasetInfo& info, std::size_t field, const StoredPart& part) {
  const FieldInfo& of = info.fields.at(field);
  const bool has_bricks = info.stored != nullptr && of.is_read_by_boxes();
  return has_bricks ? chunks_of(part.box, of) : 0;
}

int components_of(const FieldInfo& field, StoredAs as) {
  return as == StoredAs::two_values ? TwoValues::components
                                    : static_cast<int>(field.components.size());
}

std::optional<StoredPart> stored_level(const DatasetInfo& info, std::size_t field,
                                       const Coarsening& how) {
  if (info.stored == nullptr || how.halvings == full) return std::nullopt;
  const bool drawn = how.reduction == Reduction::drawn;
  if (drawn && how.stride > 1 && how.halvings == middles_of(how.stride).halvings) {
    return stored_middles(info, field, how.stride);
  }
  const auto level = level_of(info, how.halvings);
  if (!level) return std::nullopt;
  StoredPart part;
  part.level = *level;
  part.as = drawn ? StoredAs::drawn : StoredAs::two_values;
  const auto dims = stored_dims(info, field, part.level, part.as);
  if (!dims) return std::nullopt;
  if (drawn ? how.stride != 1 : key_of(with_widths(*info.stored, how)) != key_of(how)) {
    return std::nullopt;
  }
  part.box = whole_box(*dims);
  return part;
}

std::optional<StoredPart> stored_middles(const DatasetInfo& info, std::size_t field, int stride) {
  for (int level = 1; level <= strided_levels_max; ++level) {
    if (1 << level != stride) continue;
    StoredPart part;
    part.level = static_cast<std::size_t>(level);
    part.as = StoredAs::strided;
    const auto dims = stored_dims(info, field, part.level, part.as);
    if (!dims) return std::nullopt;
    part.box = whole_box(*dims);
    return part;
  }
  return std::nullopt;
}

const StoredRange* stored_range(const DatasetInfo& info, std::size_t field, std::size_t step) {
  const StoredField* const of = field_of(info, field);
  return of != nullptr && step < of->ranges.size() ? &of->ranges[step] : nullptr;
}

bool measure_part(const DatasetInfo& info, std::size_t field, std::size_t step, StoredAs as,
                  Volume& volume) {
  if (as != StoredAs::two_values) return measure_volume(volume);
  const StoredRange* const range = stored_range(info, field, step);
  if (range == nullptr) return false;
  volume.range = range->range;
  return measure_two_values(volume);
}

}  // namespace windsplat::data
