#include "server/data/cf/grid/level_heights.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/cf/coordinates.hpp"
#include "server/data/cf/grid/vertical.hpp"
#include "server/data/cf/level_direction.hpp"
#include "server/data/cf/units.hpp"

namespace windsplat::data::cf {

namespace {

using LevelTerms = std::array<double, 3>;
using ColumnTerms = std::array<double, 2>;
using Constants = ParametricLevels::Constants;

// Names as in appendix D: column = {depth, eta}, level = {s or sigma, C}, constants = {depth_c}.
double ocean_sigma(const LevelTerms& level, const ColumnTerms& column,
                   const Constants& /*constants*/) {
  return column[1] + level[0] * (column[0] + column[1]);
}
double ocean_s_g1(const LevelTerms& level, const ColumnTerms& column, const Constants& constants) {
  const double s = constants[0] * level[0] + (column[0] - constants[0]) * level[1];
  return s + column[1] * (1 + s / column[0]);
}
double ocean_s_g2(const LevelTerms& level, const ColumnTerms& column, const Constants& constants) {
  const double s = (constants[0] * level[0] + column[0] * level[1]) / (constants[0] + column[0]);
  return column[1] + (column[1] + column[0]) * s;
}
// level = {sigma, zlev}; NaN in sigma below the sigma levels. NaN below the sea floor.
double ocean_sigma_z(const LevelTerms& level, const ColumnTerms& column,
                     const Constants& constants) {
  if (std::isnan(column[0])) return column[0];
  if (std::isnan(level[0])) {
    constexpr double rounding = 1e-6;  // of the depth, in float32
    const bool is_below = level[1] < -column[0] - rounding * std::abs(column[0]);
    return is_below ? std::numeric_limits<double>::quiet_NaN() : level[1];
  }
  return column[1] + level[0] * (std::min(constants[0], column[0]) + column[1]);
}
// constants = {depth_c, a, b}; level[1] is C, which set_stretching() computes.
double ocean_s(const LevelTerms& level, const ColumnTerms& column, const Constants& constants) {
  return column[1] * (1 + level[0]) + constants[0] * level[0] +
         (column[0] - constants[0]) * level[1];
}
void set_stretching(LevelTerms& level, const Constants& constants) {
  const double a = constants[1];
  const double b = constants[2];
  level[1] = (1 - b) * std::sinh(a * level[0]) / std::sinh(a) +
             b * (std::tanh(a * (level[0] + 0.5)) / (2 * std::tanh(0.5 * a)) - 0.5);
}
// constants = {z1, z2, a, href}, column = {depth}. The formula gives depths below the datum: it
// holds only if sigma grows downward, from 0 at the datum to 1 at the depth f and 2 at the floor;
// k_c is the last level with a sigma of at most 1.
double ocean_double_sigma(const LevelTerms& level, const ColumnTerms& column,
                          const Constants& constants) {
  const auto& [z1, z2, a, href] = constants;
  const double f =
      0.5 * (z1 + z2) + 0.5 * (z1 - z2) * std::tanh(2 * a / (z1 - z2) * (column[0] - href));
  if (!(level[0] >= 0 && level[0] <= 2)) return std::numeric_limits<double>::quiet_NaN();
  return level[0] <= 1 ? -level[0] * f : -(f + (level[0] - 1) * (column[0] - f));
}
// column = {orog}, level = {a, b}.
double hybrid_height(const LevelTerms& level, const ColumnTerms& column,
                     const Constants& /*constants*/) {
  return level[0] + level[1] * column[0];
}
// column = {zsurf1, zsurf2}, level = {a, b1, b2}, constants = {ztop}.
double sleve(const LevelTerms& level, const ColumnTerms& column, const Constants& constants) {
  return level[0] * constants[0] + level[1] * column[0] + level[2] * column[1];
}

struct KnownFormula {
  std::string_view standard_name;
  ParametricLevels::Formula formula;
  std::array<const char*, 3> levels;  // terms; null: none
  std::array<const char*, 2> columns;
  std::array<const char*, 4> constants;
  bool second_is_optional;  // absent: 0
  void (*prepare)(LevelTerms&, const Constants&) = nullptr;
};
constexpr auto known_formulas = std::to_array<KnownFormula>({
    {"ocean_sigma_coordinate", ocean_sigma, {"sigma"}, {"depth", "eta"}, {}, true},
    {"ocean_s_coordinate",
     ocean_s,
     {"s"},
     {"depth", "eta"},
     {"depth_c", "a", "b"},
     true,
     set_stretching},
    {"ocean_s_coordinate_g1", ocean_s_g1, {"s", "c"}, {"depth", "eta"}, {"depth_c"}, true},
    {"ocean_s_coordinate_g2", ocean_s_g2, {"s", "c"}, {"depth", "eta"}, {"depth_c"}, true},
    {"ocean_sigma_z_coordinate",
     ocean_sigma_z,
     {"sigma", "zlev"},
     {"depth", "eta"},
     {"depth_c"},
     true},
    {"ocean_double_sigma_coordinate",
     ocean_double_sigma,
     {"sigma"},
     {"depth"},
     {"z1", "z2", "a", "href"},
     true},
    {"atmosphere_hybrid_height_coordinate", hybrid_height, {"a", "b"}, {"orog"}, {}, true},
    {"atmosphere_sleve_coordinate",
     sleve,
     {"a", "b1", "b2"},
     {"zsurf1", "zsurf2"},
     {"ztop"},
     false},
});

using Terms = std::map<std::string, std::string>;

// The terms of ROMS' files that lack formula_terms.
std::pair<std::string, Terms> terms_of_roms(const ArrayFile& file) {
  const FileContents& contents = file.contents();
  const int transform = variable_named(contents, "Vtransform");
  if (transform < 0 || !contents.variables[at(transform)].numeric) return {};
  const auto number = unpacked_values(file, transform);
  if (!number || number->size() != 1) return {};
  if (number->front() != 1 && number->front() != 2) return {};
  return {number->front() == 1 ? "ocean_s_coordinate_g1" : "ocean_s_coordinate_g2",
          {{"s", "s_rho"}, {"c", "Cs_r"}, {"eta", "zeta"}, {"depth", "h"}, {"depth_c", "hc"}}};
}

class HeightFinder {
 public:
  HeightFinder(const ArrayFile& file, int coordinate, const std::vector<int>& variables,
               Placement& grid, DatasetInfo& info)
      : file_(file), coordinate_(coordinate), variables_(variables), grid_(grid), info_(info) {}

  Result<LevelHeights> find() {
    LevelHeights heights;
    if (grid_.space[2] < 0) return heights;
    auto parametric = find_parametric();
    if (!parametric) return parametric.error();
    heights.parametric = std::move(*parametric);
    if (!heights.parametric && is_bare()) heights.variable = find_variable();
    if (!heights.parametric && heights.variable < 0) {
      if (auto done = place_by_auxiliary(); !done) return done.error();
      return LevelHeights();
    }
    if (auto done = place(heights); !done) return done.error();
    return heights;
  }

 private:
  [[nodiscard]] const FileVariable& variable(int v) const {
    return file_.contents().variables.at(at(v));
  }

  [[nodiscard]] int numeric_named(const std::string& name) const {
    const int v = name.empty() ? -1 : variable_named(file_.contents(), name);
    return v >= 0 && variable(v).numeric ? v : -1;
  }

  // Whether the levels have no physical positions yet.
  [[nodiscard]] bool is_bare() const {
    const AxisKind kind = info_.grid.axes[2].kind;
    return kind == AxisKind::level || (kind == AxisKind::cartesian && coordinate_ < 0);
  }

  [[nodiscard]] bool is_on_levels(int v) const {
    return variable(v).numeric && variable(v).dims == std::vector{grid_.space[2]};
  }

  // Variables along the levels whose `coordinates` name an auxiliary coordinate.
  [[nodiscard]] std::ptrdiff_t users_of(const FileVariable& one) const {
    const auto& all = file_.contents().variables;
    return std::count_if(all.begin(), all.end(), [&](const FileVariable& user) {
      const std::string words = ' ' + user.coordinates + ' ';
      return words.find(' ' + one.name + ' ') != std::string::npos &&
             std::count(user.dims.begin(), user.dims.end(), grid_.space[2]) > 0;
    });
  }

  // The coordinate of the levels, or an auxiliary one that has a formula where it has none, that of
  // most variables: files of the Unified Model number their levels.
  [[nodiscard]] int with_formula() const {
    const auto has = [&](int v) { return !file_.text_of(v, "formula_terms").empty(); };
    if ((coordinate_ >= 0 && has(coordinate_)) || !is_bare()) return coordinate_;
    int best = coordinate_;
    std::ptrdiff_t most = -1;
    for (std::size_t v = 0; v < file_.contents().variables.size(); ++v) {
      const int one = static_cast<int>(v);
      if (!is_on_levels(one) || variable(one).standard_name.empty() || !has(one)) continue;
      if (const auto users = users_of(variable(one)); users > most) {
        best = one;
        most = users;
      }
    }
    return best;
  }

  Result<std::optional<ParametricLevels>> find_parametric() {
    const int by = with_formula();
    std::string name = by < 0 ? "" : variable(by).standard_name;
    Terms terms;
    if (by >= 0) terms = formula_terms(file_.text_of(by, "formula_terms"));
    if (terms.empty()) std::tie(name, terms) = terms_of_roms(file_);
    const auto* known =
        std::find_if(known_formulas.begin(), known_formulas.end(),
                     [&](const KnownFormula& one) { return one.standard_name == lower(name); });
    using Found = std::optional<ParametricLevels>;
    if (known == known_formulas.end() || terms.empty()) return Found();
    ParametricLevels out;
    out.formula = known->formula;
    out.first_term = known->columns[0];
    std::string missing;
    for (std::size_t i = 0; i < 2; ++i) {
      if (known->columns.at(i) == nullptr) continue;
      const int v = numeric_named(terms[known->columns.at(i)]);
      if (v >= 0 && on_columns(file_.contents(), grid_, v)) {
        out.columns.at(i) = v;
      } else if (i == 0 || !known->second_is_optional) {
        missing = known->columns.at(i);
      }
    }
    for (std::size_t i = 0; i < known->constants.size(); ++i) {
      if (known->constants.at(i) == nullptr) continue;
      const auto value = single_value(terms[known->constants.at(i)]);
      if (!value) return value.error();
      if (!*value) missing = known->constants.at(i);
      out.constants.at(i) = value->value_or(0);
    }
    if (auto done = read_levels(*known, terms, out, missing); !done) return done.error();
    if (missing.empty()) return Found(std::move(out));
    info_.notes.push_back("the levels' heights are unknown: " + std::string(known->standard_name) +
                          " lacks its term " + in_quotes(missing));
    return Found();
  }

  Result<void> read_levels(const KnownFormula& known, Terms& terms, ParametricLevels& out,
                           std::string& missing) const {
    out.levels.assign(grid_.length[2], LevelTerms{});
    for (std::size_t i = 0; i < 3; ++i) {
      if (known.levels.at(i) == nullptr) continue;
      const int v = numeric_named(terms[known.levels.at(i)]);
      if (v < 0 || variable(v).dims != std::vector{grid_.space[2]}) {
        missing = known.levels.at(i);
        continue;
      }
      auto values = unpacked_values(file_, v);
      if (!values) return values.error();
      if (grid_.turned[2]) std::reverse(values->begin(), values->end());
      for (std::size_t k = 0; k < values->size(); ++k) out.levels[k].at(i) = (*values)[k];
    }
    for (LevelTerms& level : out.levels) {
      if (known.prepare != nullptr) known.prepare(level, out.constants);
    }
    return {};
  }

  [[nodiscard]] Result<std::optional<double>> single_value(const std::string& name) const {
    const int v = numeric_named(name);
    if (v < 0) return std::optional<double>();
    for (const int d : variable(v).dims) {
      if (file_.contents().dimensions[at(d)].length != 1) return std::optional<double>();
    }
    auto values = unpacked_values(file_, v);
    if (!values) return values.error();
    if (values->size() != 1 || !std::isfinite(values->front())) return std::optional<double>();
    return std::optional(values->front());
  }

  // A height in metres at every sample, above sea level or, in second place, of the standard name
  // "height", which older files of ICON give to z_mc; -1 if there is none.
  [[nodiscard]] int find_variable() const {
    int second = -1;
    for (const int v : variables_) {
      const FileVariable& one = variable(v);
      const auto along_levels = std::count(one.dims.begin(), one.dims.end(), grid_.space[2]);
      const bool named = one.standard_name == "geopotential_height" ||
                         one.standard_name == "altitude" ||
                         one.standard_name.starts_with("geometric_height_at_full_level") ||
                         one.standard_name == "height_above_geopotential_datum";
      const bool of_schism = one.name == "zCoordinates" && one.units.empty();
      const bool in_metres = metres_in(one.units) == 1.0;
      if (along_levels != 1) continue;
      if (of_schism || (in_metres && (named || one.name == "zCoordinates"))) return v;
      if (second < 0 && in_metres && one.standard_name == "height") second = v;
    }
    return second;
  }

  // An auxiliary coordinate of the levels in units of length: a height or depth by its standard
  // name, level_height of the Unified Model, or one that variables name, that of most of them; -1
  // if there is none.
  [[nodiscard]] int find_auxiliary() {
    const FileContents& contents = file_.contents();
    int best = -1;
    std::ptrdiff_t most = -1;
    for (std::size_t v = 0; v < contents.variables.size(); ++v) {
      const FileVariable& one = contents.variables[v];
      const int self = static_cast<int>(v);
      if (self == coordinate_ || !is_on_levels(self) || !metres_in(one.units)) continue;
      const bool named = direction_of_name(one.standard_name) != 0 ||
                         one.long_name == "level_height" || one.name.starts_with("level_height");
      const auto users = users_of(one);
      if (direction_of_levels(one) == 0) {
        if (users > 0) {
          info_.notes.push_back("the levels are not placed by " + in_quotes(one.name) +
                                ": it does not say that it is a height or a depth");
        }
        continue;
      }
      if ((named || users > 0) && users > most) {
        best = self;
        most = users;
      }
    }
    return best;
  }

  Result<void> place_by_auxiliary() {
    const int found = is_bare() ? find_auxiliary() : -1;
    if (found < 0) return {};
    const FileVariable& from = variable(found);
    auto values = unpacked_values(file_, found);
    if (!values) return values.error();
    if (grid_.turned[2]) std::reverse(values->begin(), values->end());
    const bool below_zero =
        std::all_of(values->begin(), values->end(), [](double z) { return z <= 0; });
    const bool is_turned = from.positive.empty() && direction_of_levels(from) < 0 && below_zero;
    const bool down = direction_of_levels(from) < 0 && !is_turned;
    const auto goes_up = [&] {
      const auto wrong = [down](double a, double b) { return down ? !(b < a) : !(b > a); };
      return std::adjacent_find(values->begin(), values->end(), wrong) == values->end();
    };
    const bool turned = !goes_up();
    if (turned) std::reverse(values->begin(), values->end());
    const bool finite =
        std::all_of(values->begin(), values->end(), [](double z) { return std::isfinite(z); });
    if (!finite || !goes_up()) {
      info_.notes.push_back("the levels are not placed by " + in_quotes(from.name) +
                            ": its values are missing or not monotonic");
      return {};
    }
    grid_.turned[2] = grid_.turned[2] != turned;
    Axis& axis = info_.grid.axes[2];
    axis.coordinates = std::move(*values);
    axis.kind = down ? AxisKind::depth : AxisKind::height;
    axis.standard_name = from.standard_name;
    axis.units = from.units;
    info_.notes.push_back("levels are placed by " + in_quotes(from.name) +
                          (is_turned ? ", whose depths below 0 are interpreted as heights" : ""));
    forget_left_out({from.name, axis.name});
    return {};
  }

  // Removes what has become the place of the levels from the variables that are not used.
  void forget_left_out(const std::vector<std::string>& names) {
    const auto used = [&](const LeftOut& left) {
      return std::count(names.begin(), names.end(), left.name) > 0;
    };
    info_.left_out.erase(std::remove_if(info_.left_out.begin(), info_.left_out.end(), used),
                         info_.left_out.end());
  }

  // Sums and counts of the heights of each level at the first step.
  Result<std::vector<double>> means(const LevelHeights& heights) const {
    std::vector<double> out(grid_.length[2], std::numeric_limits<double>::quiet_NaN());
    const std::size_t layer = grid_.layer();
    std::vector<float> values(layer);
    std::optional<ParametricHeights> formula;
    if (heights.parametric) {
      formula.emplace(*heights.parametric);
      if (auto loaded = formula->load(file_, grid_, 0); !loaded) return loaded.error();
    }
    for (std::size_t k = 0; k < out.size(); ++k) {
      if (!formula) {
        auto read =
            read_variable(file_, grid_, heights.variable, 0, {k, 1}, values.data(), [](double) {});
        if (!read) return read.error();
      }
      double sum = 0;
      std::size_t count = 0;
      for (std::size_t n = 0; n < layer; ++n) {
        const double z = formula ? formula->at(k, n) : static_cast<double>(values[n]);
        if (!std::isfinite(z)) continue;
        sum += z;
        ++count;
      }
      if (count > 0) out[k] = sum / static_cast<double>(count);
    }
    return out;
  }

  [[nodiscard]] Result<void> charge(const LevelHeights& heights) const {
    const Levels all{0, grid_.length[2]};
    std::vector<int> read{heights.variable};
    if (heights.parametric) {
      read.assign(heights.parametric->columns.begin(), heights.parametric->columns.end());
    }
    for (const int v : read) {
      if (v < 0) continue;
      if (auto fine = file_.charge(v, decoded_step_bytes(file_, grid_, v, all)); !fine) return fine;
    }
    return {};
  }

  Result<void> place(const LevelHeights& heights) {
    Axis& axis = info_.grid.axes[2];
    if (auto fine = charge(heights); !fine) {
      info_.notes.push_back("levels of unknown mean height (" + fine.error().message +
                            "): they are placed as in the file");
      return {};
    }
    auto mean = means(heights);
    if (!mean) return mean.error();
    const auto rises = [&] {
      return std::all_of(mean->begin(), mean->end(), [](double z) { return std::isfinite(z); }) &&
             std::adjacent_find(mean->begin(), mean->end(), std::greater_equal<>()) == mean->end();
    };
    if (!rises() && !heights.parametric) {
      // COSMO does not say that its levels run down.
      std::reverse(mean->begin(), mean->end());
      if (rises()) grid_.turned[2] = !grid_.turned[2];
    }
    if (!rises()) {
      info_.notes.emplace_back("levels whose mean heights do not rise: placed as in the file");
      return {};
    }
    axis.coordinates = *mean;
    axis.kind = AxisKind::height;
    const bool as_height =
        !heights.parametric && variable(heights.variable).standard_name == "height";
    axis.standard_name = as_height ? "height" : "altitude";
    axis.units = "m";
    const std::string field = heights.parametric ? "height" : variable(heights.variable).name;
    info_.notes.push_back("levels are placed at their mean heights at the first step; the field " +
                          in_quotes(field) +
                          " has the height of every sample (geometry.heightField)");
    forget_left_out({axis.name});
    for (LeftOut& left : info_.left_out) {
      if (!heights.parametric) break;
      for (const int v : heights.parametric->columns) {
        if (v >= 0 && left.name == variable(v).name) left.reason = "gives the height of the levels";
      }
    }
    return {};
  }

  const ArrayFile& file_;
  int coordinate_;
  const std::vector<int>& variables_;
  Placement& grid_;
  DatasetInfo& info_;
};

}  // namespace

Result<void> ParametricHeights::load(const ArrayFile& file, const Placement& grid,
                                     std::size_t step) {
  for (std::size_t i = 0; i < 2; ++i) {
    columns_.at(i).assign(grid.layer(), 0.0F);
    if (levels_.columns.at(i) < 0) continue;
    auto read = read_variable(file, grid, levels_.columns.at(i), step, {0, grid.length[2]},
                              columns_.at(i).data(), [](double) {});
    if (!read) return read;
  }
  return {};
}

double ParametricHeights::at(std::size_t level, std::size_t column) const {
  const ColumnTerms values{static_cast<double>(columns_[0][column]),
                           static_cast<double>(columns_[1][column])};
  return levels_.formula(levels_.levels[level], values, levels_.constants);
}

Result<LevelHeights> find_heights(const ArrayFile& file, int coordinate,
                                  const std::vector<int>& variables, Placement& grid,
                                  DatasetInfo& info) {
  return HeightFinder(file, coordinate, variables, grid, info).find();
}

}  // namespace windsplat::data::cf
