#include "server/convert/coordinates.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "server/data/cf/written/attributes.hpp"

namespace windsplat::convert {

namespace {

using data::zarr::OrderedJson;

// Means of groups of 2^halvings numbers along one axis of rows of numbers, `inner` apart.
std::vector<double> means_along(const std::vector<double>& values, std::size_t samples,
                                std::size_t inner, int halvings,
                                const std::vector<double>& widths) {
  if (halvings == 0) return values;
  const std::size_t size = std::size_t{1} << static_cast<unsigned>(halvings);
  std::vector<double> out;
  out.reserve(values.size() / 2 + inner);
  for (std::size_t base = 0; base < values.size(); base += samples * inner) {
    for (std::size_t first = 0; first < samples; first += size) {
      for (std::size_t n = 0; n < inner; ++n) {
        double sum = 0;
        double weight = 0;
        for (std::size_t i = first; i < std::min(first + size, samples); ++i) {
          const double value = values[base + i * inner + n];
          if (std::isnan(value)) continue;
          sum += widths[i] * value;
          weight += widths[i];
        }
        out.push_back(weight > 0 ? sum / weight : std::numeric_limits<double>::quiet_NaN());
      }
    }
  }
  return out;
}

class Listing {
 public:
  Listing(const data::DatasetInfo& info, const Plan& plan, std::size_t number)
      : info_(info), plan_(plan), number_(number), level_(plan.levels[number]) {}

  std::vector<Coordinates> list() {
    if (data::cf::has_times(info_)) {
      std::vector<double> times;
      for (const std::size_t step : plan_.steps) times.push_back(info_.steps[step].value);
      add("time", {"time"}, std::move(times), data::cf::time_attributes(info_));
    }
    for (std::size_t a = 0; a < 3; ++a) {
      const data::Axis& axis = info_.grid.axes[a];
      add(name_of(a), {name_of(a)}, along(axis.coordinates, a), data::cf::axis_attributes(axis, a));
      const std::string widths = widths_name(info_, plan_, a);
      if (number_ == 0 && !widths.empty()) add(widths, {name_of(a)}, plan_.widths[a], {});
    }
    if (info_.grid.columns) {
      const auto [longitude, latitude] = data::cf::position_names(info_);
      add(longitude, across(), of_columns(info_.grid.columns->longitude),
          data::cf::longitude_attributes());
      add(latitude, across(), of_columns(info_.grid.columns->latitude),
          data::cf::latitude_attributes());
    }
    if (info_.grid.ground) {
      const data::Ground& ground = *info_.grid.ground;
      std::vector<double> values(ground.heights.begin(), ground.heights.end());
      if (ground.kind != data::GroundKind::land) {  // depths
        for (double& height : values) height = -height;
      }
      add(plain_name(ground.name), across(), of_columns(values),
          data::cf::ground_attributes(ground));
    }
    return std::move(out_);
  }

 private:
  [[nodiscard]] std::string name_of(std::size_t axis) const {
    return plain_name(data::cf::axis_name(info_, axis));
  }
  [[nodiscard]] std::vector<std::string> across() const { return {name_of(1), name_of(0)}; }

  [[nodiscard]] std::vector<double> along(const std::vector<double>& values, std::size_t a) const {
    return means_along(values, values.size(), 1, level_.how.halvings[a], level_.how.widths[a]);
  }
  // y, x
  [[nodiscard]] std::vector<double> of_columns(const std::vector<double>& values) const {
    const auto x = static_cast<std::size_t>(plan_.dims[0]);
    const auto y = static_cast<std::size_t>(plan_.dims[1]);
    const auto merged = means_along(values, x, 1, level_.how.halvings[0], level_.how.widths[0]);
    return means_along(merged, y, static_cast<std::size_t>(level_.dims[0]), level_.how.halvings[1],
                       level_.how.widths[1]);
  }

  void add(const std::string& name, const std::vector<std::string>& dimensions,
           std::vector<double> values, const data::cf::WrittenAttributes& attributes) {
    Coordinates made;
    made.array.path = std::to_string(number_) + '/' + name;
    made.array.shape = {values.size()};
    if (dimensions.size() == 2) {
      made.array.shape = {static_cast<std::size_t>(level_.dims[1]),
                          static_cast<std::size_t>(level_.dims[0])};
    }
    made.array.chunk = made.array.shape;
    made.array.dtype = {'f', 8};
    made.array.dimensions = dimensions;
    for (const auto& [key, text] : attributes) made.array.attributes[key] = text;
    made.array.compression = plan_.compression;
    made.array.format = plan_.format;
    made.values = std::move(values);
    out_.push_back(std::move(made));
  }

  const data::DatasetInfo& info_;
  const Plan& plan_;
  std::size_t number_;
  const Level& level_;
  std::vector<Coordinates> out_;
};

}  // namespace

std::string plain_name(const std::string& name) {
  std::string out = name.empty() ? "_" : name;
  for (char& c : out) {
    if (c == '/' || c == '\\' || static_cast<unsigned char>(c) < ' ' || c == '\x7f') c = '_';
  }
  if (out.front() == '.' || out.starts_with("__")) out.insert(0, "v");
  return out;
}

std::vector<Coordinates> coordinates_of(const data::DatasetInfo& info, const Plan& plan,
                                        std::size_t level) {
  return Listing(info, plan, level).list();
}

std::vector<std::string> coordinate_paths(const data::DatasetInfo& info, const Plan& plan) {
  std::vector<std::string> out;
  for (std::size_t level = 0; level < plan.levels.size(); ++level) {
    const std::string group = std::to_string(level) + '/';
    out.push_back(group + "time");  // a dimension in any case
    for (std::size_t a = 0; a < 3; ++a) {
      out.push_back(group + plain_name(data::cf::axis_name(info, a)));
      const std::string widths = widths_name(info, plan, a);
      if (level == 0 && !widths.empty()) out.push_back(group + widths);
    }
    if (info.grid.columns) {
      for (const std::string& name : data::cf::position_names(info)) out.push_back(group + name);
    }
    if (info.grid.ground) out.push_back(group + plain_name(info.grid.ground->name));
  }
  return out;
}

std::string widths_name(const data::DatasetInfo& info, const Plan& plan, std::size_t axis) {
  if (plan.widths.at(axis).empty()) return {};
  return plain_name(data::cf::axis_name(info, axis)) + "_widths";
}

}  // namespace windsplat::convert
