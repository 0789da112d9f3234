// Bricks, regions and units of a grid; arrays of fields; the order of units and pencils.
#include "server/convert/plan.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <set>
#include <utility>

#include "server/convert/coordinates.hpp"
#include "server/data/cf/written/attributes.hpp"
#include "server/data/model/middles.hpp"
#include "server/data/model/stored.hpp"

namespace windsplat::convert {

namespace {

using data::zarr::OrderedJson;
using data::zarr::WrittenArray;

constexpr int brick_length = 64;
constexpr int whole_length_max = 128;  // axes up to this length are not divided
constexpr std::size_t brick_samples_max = std::size_t{1} << 17;  // of bricks that are enlarged
constexpr int unit_bricks = 8;                                   // along divided axes

Error invalid(const std::string& what) { return make_error(ErrorKind::invalid, what); }

bool is_divided(int samples) { return samples > whole_length_max; }

Three brick_of(const Three& dims) {
  Three brick = dims;
  for (int& length : brick) length = is_divided(length) ? brick_length : length;
  for (bool grows = true; grows;) {
    grows = false;
    for (std::size_t a = 0; a < 3; ++a) {
      if (!is_divided(dims[a]) || 2 * brick[a] > dims[a]) continue;
      if (2 * product(brick) > brick_samples_max) continue;
      brick[a] *= 2;
      grows = true;
    }
  }
  return brick;
}

// Whether cells of these widths are weighted like equal ones, bit for bit.
bool are_even(const std::vector<double>& widths, std::size_t axis, int halvings) {
  data::Coarsening given;
  given.halvings.at(axis) = halvings;
  data::Coarsening equal = given;
  given.widths.at(axis) = widths;
  equal.widths.at(axis).assign(widths.size(), 1.0);
  return key_of(given) == key_of(equal);
}

Result<data::zarr::Compression> parse_compression(const std::string& text) {
  using data::zarr::Compression;
  if (text == "lz4") return Compression{Compression::Kind::lz4, 5};
  if (text == "none") return Compression{Compression::Kind::none, 1};
  if (text == "zstd") return Compression{Compression::Kind::zstd, 1};
  if (text.size() == 6 && text.starts_with("zstd:") && text[5] >= '1' && text[5] <= '9') {
    return Compression{Compression::Kind::zstd, text[5] - '0'};
  }
  return invalid("the compression " + in_quotes(text) +
                 " is not lz4, zstd, zstd:1 to zstd:9 or none");
}

// The text of attributes as JSON; `names` of them, all if it is empty.
OrderedJson json_of(const data::cf::WrittenAttributes& attributes,
                    const std::set<std::string>& names = {}) {
  OrderedJson out = OrderedJson::object();
  for (const auto& [name, text] : attributes) {
    if (names.empty() || names.contains(name)) out[name] = text;
  }
  return out;
}

class Planner {
 public:
  Planner(const data::DatasetInfo& info, const std::vector<data::Coarsening>& chain,
          const Options& options)
      : info_(info), chain_(chain), options_(options) {
    plan_.dims = info.grid.dims();
  }

  Result<Plan> plan() {
    auto compression = parse_compression(options_.compression);
    if (!compression) return compression.error();
    plan_.compression = *compression;
    plan_.compression_text = options_.compression;
    plan_.format = options_.zarr == 2 ? data::zarr::StoreFormat::v2 : data::zarr::StoreFormat::v3;
    if (auto done = choose_steps(); !done) return done.error();
    lay_out();
    if (auto done = choose_fields(); !done) return done.error();
    for (PlannedField& field : plan_.fields) add_arrays(field);
    if (auto done = check_names(); !done) return done.error();
    list_units();
    describe();
    return std::move(plan_);
  }

 private:
  Result<void> choose_steps() {
    plan_.steps = options_.steps;
    if (plan_.steps.empty()) {
      plan_.steps.resize(info_.steps.size());
      std::iota(plan_.steps.begin(), plan_.steps.end(), std::size_t{0});
    }
    if (plan_.steps.back() < info_.steps.size()) return {};
    return invalid("there is no step " + std::to_string(plan_.steps.back()) + ": the dataset has " +
                   std::to_string(info_.steps.size()) + ", counted from 0");
  }

  void lay_out() {
    const Three brick = brick_of(plan_.dims);
    Three halvings_max{0, 0, 0};
    for (const data::Coarsening& how : chain_) {
      for (std::size_t a = 0; a < 3; ++a) {
        halvings_max[a] = std::max(halvings_max[a], how.halvings[a]);
      }
    }
    for (std::size_t a = 0; a < 3; ++a) {
      const bool divided = is_divided(plan_.dims[a]);
      plan_.unit[a] = divided ? unit_bricks * brick[a] : plan_.dims[a];
      plan_.pencil[a] = divided ? std::max(brick[a], 1 << halvings_max[a]) : plan_.dims[a];
    }
    plan_.pencil[0] = plan_.unit[0];
    plan_.units_along = over(plan_.dims, plan_.unit);
    for (const data::Coarsening& how : chain_) plan_.levels.push_back(level_of(how, brick));
    for (int n = 0; n <= data::strided_levels_max && n < static_cast<int>(chain_.size()); ++n) {
      plan_.middles.push_back(level_of(data::middles_of(1 << n), brick));
    }
    for (std::size_t a = 0; a < 3; ++a) keep_widths(a);
  }

  [[nodiscard]] Level level_of(const data::Coarsening& how, const Three& brick) const {
    Level out;
    out.how = how;
    for (std::size_t a = 0; a < 3; ++a) {
      const int h = how.halvings[a];
      const int samples = data::halved(plan_.dims[a], h);
      const int of_unit = plan_.unit[a] >> h;
      out.dims[a] = samples;
      if (samples <= brick[a]) {
        out.brick[a] = out.region[a] = samples;
      } else {
        out.brick[a] = brick[a];
        out.region[a] = std::max(brick[a], of_unit);
      }
      out.by_unit = out.by_unit && (plan_.units_along[a] == 1 || out.region[a] == of_unit);
    }
    return out;
  }

  void keep_widths(std::size_t axis) {
    bool even = true;
    const std::vector<double>* widths = nullptr;
    for (const Level& level : plan_.levels) {
      const int h = level.how.halvings[axis];
      if (h == 0) continue;
      widths = &level.how.widths[axis];
      even = even && are_even(*widths, axis, h);
    }
    if (widths != nullptr && !even) plan_.widths[axis] = *widths;
  }

  Result<void> choose_fields() {
    std::vector<std::size_t> chosen;
    for (const std::string& name : options_.fields) {
      const data::FieldInfo* const found = info_.find(name);
      if (found == nullptr) {
        return invalid("there is no field " + in_quotes(name) + absence_text(info_, name));
      }
      chosen.push_back(static_cast<std::size_t>(found - info_.fields.data()));
    }
    if (options_.fields.empty()) {
      for (const auto& variable : data::cf::written_variables(info_)) {
        if (variable.component == 0) chosen.push_back(variable.field);
      }
    }
    if (chosen.empty()) return invalid("the dataset has no fields");
    for (const std::size_t index : chosen) {
      const data::FieldInfo& field = info_.fields[index];
      PlannedField planned;
      planned.index = index;
      planned.name = field.name;
      planned.components = static_cast<int>(field.components.size());
      plan_.fields.push_back(std::move(planned));
    }
    return {};
  }

  std::size_t add_array(WrittenArray array) {
    array.compression = plan_.compression;
    array.format = plan_.format;
    plan_.arrays.push_back(std::move(array));
    return plan_.arrays.size() - 1;
  }

  // An array of a field at a level. In its group a dimension has one length, so that those of
  // middles of kernels have other names where theirs is another.
  std::size_t add_level_array(std::size_t level, const Level& at, const std::string& name,
                              OrderedJson attributes) {
    const auto with_time = [](std::size_t steps, const Three& a) {
      return std::vector<std::size_t>{steps, static_cast<std::size_t>(a[2]),
                                      static_cast<std::size_t>(a[1]),
                                      static_cast<std::size_t>(a[0])};
    };
    WrittenArray array;
    array.path = std::to_string(level) + '/' + plain_name(name);
    array.shape = with_time(plan_.steps.size(), at.dims);
    array.shard = with_time(1, at.region);
    array.chunk = with_time(1, at.brick);
    array.dtype = {'f', 4};
    array.dimensions = dimension_names(info_);
    for (std::size_t a = 0; a < 3; ++a) {
      if (at.dims[a] != plan_.levels[level].dims[a]) array.dimensions[3 - a] += "_strided";
    }
    array.attributes = std::move(attributes);
    return add_array(std::move(array));
  }

  void add_arrays(PlannedField& field) {
    const data::FieldInfo& info = info_.fields[field.index];
    std::vector<data::cf::WrittenVariable> variables;
    for (std::size_t c = 0; c < info.components.size(); ++c) {
      variables.push_back({info.components[c], field.index, c});
    }
    const std::set<std::string> of_values{"units", "coordinates"};
    for (std::size_t level = 0; level < plan_.levels.size(); ++level) {
      const auto add = [&](Reduced as, const std::string& ending, const auto& attributes) {
        Product made{as, level, {}};
        for (const auto& variable : variables) {
          made.arrays.push_back(add_level_array(level, plan_.level_of(made), variable.name + ending,
                                                attributes(variable)));
        }
        field.products.push_back(std::move(made));
      };
      const auto whole = [&](const auto& v) { return json_of(placed_attributes(info_, v)); };
      const auto values = [&](const auto& v) {
        return json_of(placed_attributes(info_, v), {"units"});
      };
      if (level == 0) {
        add(Reduced::samples, "", whole);
      } else if (info.kind == data::FieldKind::scalar) {
        add(Reduced::mean, "", [&](const auto& v) { return json_of(mean_attributes(info_, v)); });
        Product made{Reduced::two_values, level, {}};
        for (const char* const ending : {"_low", "_high", "_low_share", "_high_share"}) {
          const bool share = std::string(ending).ends_with("share");
          made.arrays.push_back(
              add_level_array(level, plan_.levels[level], variables[0].name + ending,
                              json_of(placed_attributes(info_, variables[0]),
                                      share ? std::set<std::string>{"coordinates"} : of_values)));
        }
        field.products.push_back(std::move(made));
      } else {
        add(Reduced::drawn, "", whole);
        if (level < plan_.middles.size()) {
          add(Reduced::strided, "_strided", values);
          field.strided = static_cast<int>(level);
        }
        field.mean = plain_name(field.name + "_magnitude");
        field.products.push_back(
            {Reduced::mean_magnitude,
             level,
             {add_level_array(level, plan_.levels[level], field.mean,
                              json_of(mean_attributes(info_, variables[0])))}});
      }
    }
    add_statistics(field);
  }

  void add_statistics(PlannedField& field) {
    const Three bricks = over(plan_.dims, plan_.levels[0].brick);
    const std::string name = plain_name(field.name);
    const std::string& units = info_.fields[field.index].units;
    const auto add = [&](const std::string& path, std::vector<std::size_t> shape, char kind,
                         std::vector<std::string> dimensions, bool has_units) {
      WrittenArray array;
      array.path = "statistics/" + path;
      array.chunk = shape;
      array.chunk[0] = 1;
      array.shape = std::move(shape);
      array.dtype = {kind, 4};
      array.dimensions = std::move(dimensions);
      if (has_units && !units.empty()) array.attributes["units"] = units;
      return add_array(std::move(array));
    };
    const std::size_t steps = plan_.steps.size();
    const std::vector<std::size_t> by_brick{steps, static_cast<std::size_t>(bricks[2]),
                                            static_cast<std::size_t>(bricks[1]),
                                            static_cast<std::size_t>(bricks[0])};
    const std::vector<std::string> places{"time", "brick_z", "brick_y", "brick_x"};
    auto binned = by_brick;
    binned.push_back(histogram_bins);
    auto bins = places;
    bins.emplace_back("bin");
    field.low = add("0/" + name + "_low", by_brick, 'f', places, true);
    field.high = add("0/" + name + "_high", by_brick, 'f', places, true);
    field.masked = add("0/" + name + "_masked", by_brick, 'u', places, false);
    field.histogram = add("0/" + name + "_histogram", binned, 'u', bins, false);
    field.range = add(name + "_range", {steps, 2}, 'f', {"time", "end"}, true);
    plan_.arrays[field.range].chunk = {steps, 2};
    WrittenArray masked;
    masked.path = "statistics/" + name + "_masked";
    masked.shape = masked.chunk = {steps};
    const bool is_countable = product(plan_.dims) <= std::numeric_limits<std::uint32_t>::max();
    masked.dtype = is_countable ? data::zarr::Dtype{'u', 4} : data::zarr::Dtype{'f', 8};
    masked.dimensions = {"time"};
    field.masked_of_step = add_array(std::move(masked));
  }

  Result<void> check_names() const {
    std::set<std::string> paths;
    std::vector<std::string> all;
    for (const WrittenArray& array : plan_.arrays) {
      if (auto fit = check_array(array); !fit) return fit;
      all.push_back(array.path);
    }
    for (const std::string& path : coordinate_paths(info_, plan_)) all.push_back(path);
    for (const std::string& path : all) {
      if (paths.insert(path).second) continue;
      return invalid("two arrays of the store would have the name " + in_quotes(path) +
                     "; choose the fields by --field");
    }
    return {};
  }

  void list_units() {
    std::vector<Three> places;
    for (int z = 0; z < plan_.units_along[2]; ++z) {
      for (int y = 0; y < plan_.units_along[1]; ++y) {
        for (int x = 0; x < plan_.units_along[0]; ++x) places.push_back({x, y, z});
      }
    }
    const auto code = [](const Three& at) {
      constexpr std::uint32_t bits = 21;
      std::uint64_t out = 0;
      for (std::uint32_t bit = 0; bit < bits; ++bit) {
        for (std::uint32_t a = 0; a < 3; ++a) {
          out |= std::uint64_t{(static_cast<std::uint32_t>(at[a]) >> bit) & 1U} << (3 * bit + a);
        }
      }
      return out;
    };
    std::ranges::sort(places, {}, code);
    for (std::size_t step = 0; step < plan_.steps.size(); ++step) {
      for (std::size_t field = 0; field < plan_.fields.size(); ++field) {
        for (const Three& place : places) plan_.units.push_back({field, step, place});
      }
    }
  }

  void describe() {
    OrderedJson fields = OrderedJson::array();
    for (const PlannedField& field : plan_.fields) fields.push_back(field.name);
    OrderedJson levels = OrderedJson::array();
    for (const Level& level : plan_.levels) levels.push_back(level.how.halvings);
    plan_.identity = {{"program", WINDSPLAT_VERSION},
                      {"input", info_.source},
                      {"digest of the input", info_.digest},
                      {"dims", plan_.dims},
                      {"fields", std::move(fields)},
                      {"steps", plan_.steps},
                      {"levels", std::move(levels)},
                      {"compression", options_.compression},
                      {"zarr", options_.zarr}};
  }

  const data::DatasetInfo& info_;
  const std::vector<data::Coarsening>& chain_;
  const Options& options_;
  Plan plan_;
};

}  // namespace

data::Box Plan::box_of(const Unit& unit_at) const {
  data::Box out;
  for (std::size_t a = 0; a < 3; ++a) {
    out.first[a] = unit_at.place[a] * unit[a];
    out.count[a] = std::min(unit[a], dims[a] - out.first[a]);
  }
  return out;
}

data::Box Plan::box_at(const data::Box& box, const Level& level) const {
  data::Box out;
  for (std::size_t a = 0; a < 3; ++a) {
    const int h = level.how.halvings[a];
    out.first[a] = box.first[a] >> h;
    out.count[a] = ((box.first[a] + box.count[a] - 1) >> h) - out.first[a] + 1;
  }
  return out;
}

std::vector<std::string> dimension_names(const data::DatasetInfo& info) {
  std::vector<std::string> out{"time"};
  for (std::size_t a = 3; a-- > 0;) out.push_back(plain_name(data::cf::axis_name(info, a)));
  return out;
}

Result<Plan> make_plan(const data::DatasetInfo& info, const std::vector<data::Coarsening>& chain,
                       const Options& options) {
  return Planner(info, chain, options).plan();
}

std::uint64_t morton(std::uint32_t y, std::uint32_t z) {
  std::uint64_t out = 0;
  for (std::uint32_t bit = 0; bit < 32; ++bit) {
    out |= std::uint64_t{(y >> bit) & 1U} << (2 * bit);
    out |= std::uint64_t{(z >> bit) & 1U} << (2 * bit + 1);
  }
  return out;
}

std::vector<Reading> readings(const Plan& plan, const data::Box& unit,
                              const std::array<int, 2>& across) {
  const Three along = over(unit.count, plan.pencil);
  std::vector<std::array<int, 2>> order;  // y, z
  for (int z = 0; z < along[2]; ++z) {
    for (int y = 0; y < along[1]; ++y) order.push_back({y, z});
  }
  std::ranges::sort(order, {}, [](const std::array<int, 2>& at) {
    return morton(static_cast<std::uint32_t>(at[0]), static_cast<std::uint32_t>(at[1]));
  });
  std::vector<Reading> out;
  std::array<int, 2> last{-1, -1};
  for (const auto& [y, z] : order) {
    data::Box pencil = unit;
    for (const auto& [axis, n] : {std::pair{std::size_t{1}, y}, std::pair{std::size_t{2}, z}}) {
      pencil.first[axis] = unit.first[axis] + n * plan.pencil[axis];
      pencil.count[axis] =
          std::min(plan.pencil[axis], unit.first[axis] + unit.count[axis] - pencil.first[axis]);
    }
    const std::array<int, 2> group{y >> across[0], z >> across[1]};
    if (group != last) out.push_back({pencil, {}});
    last = group;
    Reading& reading = out.back();
    for (std::size_t a = 1; a < 3; ++a) {
      const int end =
          std::max(reading.box.first[a] + reading.box.count[a], pencil.first[a] + pencil.count[a]);
      reading.box.count[a] = end - reading.box.first[a];
    }
    reading.pencils.push_back(pencil);
  }
  return out;
}

}  // namespace windsplat::convert
