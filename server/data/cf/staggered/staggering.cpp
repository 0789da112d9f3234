// Evidence for staggered dimensions.
#include "server/data/cf/staggered/staggering.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <utility>

#include "server/data/cf/coordinates.hpp"
#include "server/data/cf/fields/fields.hpp"
#include "server/data/cf/grid/axes.hpp"
#include "server/data/cf/grid/cell_lists.hpp"
#include "server/data/cf/grid/longitudes.hpp"
#include "server/data/cf/staggered/column_offsets.hpp"
#include "server/data/cf/staggered/interleaved.hpp"
#include "server/data/cf/units.hpp"

namespace windsplat::data::cf {

namespace {

// What values in the unit `from` are multiplied by to be in `to`: 1 if either is missing or neither
// is a known length or pressure; nullopt: they measure different quantities.
std::optional<double> ratio_of_units(const std::string& from, const std::string& to) {
  if (from.empty() || to.empty() || from == to) return 1.0;
  for (const auto measure : {metres_in, pascals_in}) {
    const auto own = measure(from);
    const auto other = measure(to);
    if (own && other) return *own / *other;
    if (own || other) return std::nullopt;
  }
  return 1.0;
}

// Whether values are the numbers 0, 1, ... or 1, 2, ... of samples, which say nothing of places.
bool is_counted(const std::vector<double>& values) {
  if (values.empty() || (values.front() != 0 && values.front() != 1)) return false;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i] != values.front() + static_cast<double>(i)) return false;
  }
  return true;
}

// Of as many faces as centers, where a center lies among the faces by the 2-D positions of both.
Result<std::optional<Stagger>> by_columns(const ArrayFile& file, int faces, int centers) {
  const FileContents& contents = file.contents();
  std::optional<Stagger> out;
  if (faces < 0 || centers < 0 ||
      contents.dimensions[at(faces)].length != contents.dimensions[at(centers)].length) {
    return out;
  }
  std::array<std::array<int, 2>, 2> found{};  // longitude and latitude on each
  std::size_t side = 0;                       // of `faces` among the dimensions of its positions
  for (std::size_t n = 0; n < 2; ++n) {
    found.at(n) = {-1, -1};
    for (std::size_t v = 0; v < contents.variables.size(); ++v) {
      const FileVariable& one = contents.variables[v];
      const auto on = std::find(one.dims.begin(), one.dims.end(), n == 0 ? faces : centers);
      const int is = side_of(one);
      if (!one.numeric || one.dims.size() != 2 || on == one.dims.end() || is == 0) continue;
      const auto own = static_cast<std::size_t>(on - one.dims.begin());
      int& place = found.at(n).at(is < 0 ? 0 : 1);
      if (place >= 0 || (n == 1 && own != side)) continue;
      place = static_cast<int>(v);
      side = own;
    }
    const auto [longitude, latitude] = found.at(n);
    if (longitude < 0 || latitude < 0 ||
        contents.variables[at(longitude)].dims != contents.variables[at(latitude)].dims) {
      return out;
    }
  }
  const auto to = column_places(file, found[0][0], found[0][1]);
  if (!to) return to.error();
  const auto from = column_places(file, found[1][0], found[1][1]);
  if (!from) return from.error();
  const auto offset = offset_in_cells(*from, *to);
  if (!offset) return out;
  if (std::abs(offset->at(side)) <= offset_tolerance) {
    out = Stagger{centers, true, 0};
  } else if (const auto first = first_face_at(offset->at(side))) {
    out = Stagger{centers, false, *first};
  }
  return out;
}

class StaggerFinder {
 public:
  explicit StaggerFinder(const ArrayFile& file)
      : file_(file), contents_(file.contents()), found_(contents_.dimensions.size()) {}

  Result<std::vector<Stagger>> find() {
    by_reader();
    by_sgrid();
    by_suffix("_stag");
    by_suffix("P1");
    if (auto done = by_roms_names(); !done) return done.error();
    by_generalized_heights();
    by_counted_levels();
    if (auto done = by_palm_levels(); !done) return done.error();
    if (auto done = by_coordinates(); !done) return done.error();
    forget_chains();
    return std::move(found_);
  }

 private:
  [[nodiscard]] std::size_t length(int dimension) const {
    return contents_.dimensions.at(at(dimension)).length;
  }

  // Ignores dimensions that are absent, known already or of a length that does not fit.
  void add(int faces, int centers, bool aligned, std::ptrdiff_t first) {
    if (faces < 0 || centers < 0 || faces == centers || found_.at(at(faces)).centers >= 0) return;
    if (length(faces) == 0 || length(centers) == 0) return;
    const auto difference =
        static_cast<std::ptrdiff_t>(length(faces)) - static_cast<std::ptrdiff_t>(length(centers));
    if (aligned ? difference != 0 : std::abs(difference) > 1) return;
    found_[at(faces)] = {centers, aligned, first};
  }

  // Where a center lies among faces, if only the lengths of both dimensions are known: of as many
  // either may be the first, in a part cut out of a file.
  void add_between(int faces, int centers) {
    if (faces < 0 || centers < 0) return;
    if (length(faces) == length(centers) + 1) add(faces, centers, false, 0);
    if (length(faces) + 1 == length(centers)) add(faces, centers, false, -1);
  }

  void by_reader() {
    for (std::size_t d = 0; d < found_.size(); ++d) {
      const FileDimension& dimension = contents_.dimensions[d];
      add(static_cast<int>(d), dimension.centers, false, dimension.first_face);
    }
  }

  // "face: node (padding: both)": padding tells which ends have a face beyond the last node.
  struct Pair {
    int dimension = -1;
    int nodes = -1;
    std::string padding;
  };
  [[nodiscard]] std::vector<Pair> pairs_in(std::string text) const {
    constexpr std::string_view punctuation = ":()";
    for (char& c : text) {
      if (punctuation.find(c) != std::string_view::npos) c = ' ';
    }
    std::istringstream words(text);
    std::vector<Pair> out;
    for (std::string word; words >> word;) {
      std::string second;
      if (!(words >> second)) break;
      if (word == "padding") {
        if (!out.empty()) out.back().padding = second;
      } else {
        out.push_back({dimension_named(contents_, word), dimension_named(contents_, second), {}});
      }
    }
    return out;
  }

  void by_sgrid() {
    for (std::size_t v = 0; v < contents_.variables.size(); ++v) {
      const int topology = static_cast<int>(v);
      if (file_.text_of(topology, "cf_role") != "grid_topology") continue;
      std::map<int, int> center_of;  // by dimension of the nodes
      const auto is_low = [](const std::string& padding) {
        return padding == "both" || padding == "low";
      };
      for (const char* name : {"face_dimensions", "volume_dimensions", "vertical_dimensions"}) {
        for (const Pair& pair : pairs_in(file_.text_of(topology, name))) {
          if (pair.dimension < 0 || pair.nodes < 0) continue;
          center_of[pair.nodes] = pair.dimension;
          add(pair.nodes, pair.dimension, false, is_low(pair.padding) ? -1 : 0);
        }
      }
      for (const char* name : {"edge1_dimensions", "edge2_dimensions", "edge3_dimensions",
                               "face1_dimensions", "face2_dimensions", "face3_dimensions"}) {
        for (const Pair& pair : pairs_in(file_.text_of(topology, name))) {
          const auto center = center_of.find(pair.nodes);
          if (pair.dimension < 0 || center == center_of.end()) continue;
          const Stagger nodes = found_.at(at(pair.nodes));
          const bool padded = !pair.padding.empty() && pair.padding != "none";
          // Without padding the dimension numbers the nodes; with it, the centers.
          add(pair.dimension, center->second, padded, padded ? 0 : nodes.first);
        }
      }
    }
  }

  // WRF: west_east_stag beside west_east. MPAS: nVertLevelsP1 beside nVertLevels.
  void by_suffix(std::string_view suffix) {
    for (std::size_t d = 0; d < found_.size(); ++d) {
      const std::string& name = contents_.dimensions[d].name;
      if (!name.ends_with(suffix)) continue;
      add_between(static_cast<int>(d),
                  dimension_named(contents_, name.substr(0, name.size() - suffix.size())));
    }
  }

  // Rows of u (eta_u) and columns of v (xi_v) are those of the centers.
  Result<void> by_roms_names() {
    for (const std::string axis : {"xi", "eta"}) {
      const int centers = dimension_named(contents_, axis + "_rho");
      const std::string own = axis == "xi" ? "_v" : "_u";
      add(dimension_named(contents_, axis + own), centers, true, 0);
      for (const char* points : {"_u", "_v", "_psi"}) {
        const int faces = dimension_named(contents_, axis + points);
        add_between(faces, centers);
        const auto placed = by_columns(file_, faces, centers);
        if (!placed) return placed.error();
        if (*placed) add(faces, centers, (*placed)->aligned, (*placed)->first);
      }
    }
    add_between(dimension_named(contents_, "s_w"), dimension_named(contents_, "s_rho"));
    return {};
  }

  // ICON: full levels 1 to n, and half levels 1 to n + 1, which surround them.
  void by_generalized_heights() {
    std::vector<int> levels;
    for (std::size_t d = 0; d < found_.size(); ++d) {
      const int v = variable_named(contents_, contents_.dimensions[d].name);
      if (v >= 0 && contents_.variables[at(v)].long_name == "generalized_height") {
        levels.push_back(static_cast<int>(d));
      }
    }
    for (const int faces : levels) {
      for (const int centers : levels) {
        if (length(faces) == length(centers) + 1) add(faces, centers, false, 0);
      }
    }
  }

  // COSMO: level, and level1 with one more, both without coordinates.
  void by_counted_levels() {
    const int faces = dimension_named(contents_, "level1");
    const int centers = dimension_named(contents_, "level");
    const bool counted =
        variable_named(contents_, "level1") < 0 && variable_named(contents_, "level") < 0;
    if (faces < 0 || centers < 0 || !counted || !has_velocity(faces)) return;
    if (length(faces) == length(centers) + 1) add(faces, centers, false, 0);
  }

  // PALM: zu_3d, and zw_3d with as many levels, each above that of zu_3d (zw = 0, dz, ...; zu = 0
  // or -dz/2, dz/2, ...). The lowest of both may coincide at the ground.
  Result<void> by_palm_levels() {
    const int faces = dimension_named(contents_, "zw_3d");
    const int centers = dimension_named(contents_, "zu_3d");
    const int above = variable_named(contents_, "zw_3d");
    const int at_centers = variable_named(contents_, "zu_3d");
    if (faces < 0 || centers < 0 || above < 0 || at_centers < 0) return {};
    if (length(faces) != length(centers) || length(faces) > compared_length_max) return {};
    const auto high = unpacked_values(file_, above);
    if (!high) return high.error();
    const auto mid = unpacked_values(file_, at_centers);
    if (!mid) return mid.error();
    if (high->size() != length(faces) || mid->size() != length(faces)) return {};
    if (mid->empty()) return {};
    const std::vector<double> upper_mid(mid->begin() + 1, mid->end());
    if (interleaved(*high, upper_mid, Interleaving::near_middle) != 0) return {};
    add(faces, centers, false, -1);
    return {};
  }

  // How many variables of two or more dimensions run along a dimension.
  [[nodiscard]] std::ptrdiff_t uses(int dimension) const {
    return std::count_if(contents_.variables.begin(), contents_.variables.end(),
                         [dimension](const FileVariable& variable) {
                           return variable.numeric && variable.dims.size() > 1 &&
                                  std::count(variable.dims.begin(), variable.dims.end(),
                                             dimension) > 0;
                         });
  }

  [[nodiscard]] bool has_velocity(int dimension) const {
    return std::any_of(contents_.variables.begin(), contents_.variables.end(),
                       [dimension](const FileVariable& variable) {
                         const bool flows = is_velocity_component(variable) ||
                                            (variable.units.empty() && has_velocity_name(variable));
                         return flows && std::count(variable.dims.begin(), variable.dims.end(),
                                                    dimension) > 0;
                       });
  }

  struct Line {
    int dimension = -1;
    Role role = Role::unknown;
    AxisKind kind = AxisKind::cartesian;
    std::ptrdiff_t uses = 0;
    bool falls = false;
    bool by_height = false;      // values are those of heights_on()
    bool by_place = false;       // the role is that of roles_by_place()
    std::string units;           // of the values, longitudes in degrees
    std::vector<double> values;  // ascending: with the opposite sign if the coordinate falls
  };

  // Heights of the Unified Model's levels (level_height, as iris writes it): the numbers of its
  // levels do not tell that winds lie between those of temperature. -1: there are none.
  [[nodiscard]] int heights_on(int dimension) const {
    const auto found = std::find_if(
        contents_.variables.begin(), contents_.variables.end(), [&](const FileVariable& one) {
          const bool named =
              one.long_name == "level_height" || one.name.starts_with("level_height");
          return named && one.numeric && one.dims == std::vector<int>{dimension};
        });
    return found == contents_.variables.end()
               ? -1
               : static_cast<int>(found - contents_.variables.begin());
  }

  // The roles of dimensions, also of those with a coordinate that neither name nor attribute
  // explains, by their place among the dimensions of every variable: ym of v(zt, ym, xt).
  [[nodiscard]] std::vector<DimensionRole> roles_by_place(std::vector<bool>& by_place) const {
    const std::vector<DimensionRole> known = classify_dimensions(contents_);
    std::vector<DimensionRole> out = known;
    by_place.assign(known.size(), false);
    for (const FileVariable& variable : contents_.variables) {
      if (!variable.numeric || variable.dims.size() < 2) continue;
      const Layout layout = lay_out(contents_, known, variable);
      if (!layout.problem.empty()) continue;
      for (std::size_t a = 0; a < 3; ++a) {
        const int d = layout.space.at(a);
        if (d < 0 || known[at(d)].role != Role::unknown || known[at(d)].coordinate < 0) continue;
        const Role role = a == 0 ? Role::x : a == 1 ? Role::y : Role::z;
        const bool is_same = !by_place[at(d)] || out[at(d)].role == role;
        out[at(d)].role = is_same ? role : Role::other;
        by_place[at(d)] = true;
      }
    }
    return out;
  }

  // Dimensions with coordinates that no name has explained, those of most variables first.
  Result<std::vector<Line>> lines() const {
    std::vector<Line> out;
    std::vector<bool> by_place;
    const std::vector<DimensionRole> roles = roles_by_place(by_place);
    for (std::size_t d = 0; d < roles.size(); ++d) {
      const DimensionRole& role = roles[d];
      const bool in_space = role.role == Role::x || role.role == Role::y || role.role == Role::z;
      Line line{static_cast<int>(d), role.role, role.kind, uses(static_cast<int>(d)), false, false,
                by_place[d],         {},        {}};
      if (!in_space || role.coordinate < 0 || line.uses == 0 || found_[d].centers >= 0 ||
          contents_.dimensions[d].length > compared_length_max) {
        continue;
      }
      const int heights = role.role == Role::z ? heights_on(line.dimension) : -1;
      line.by_height = heights >= 0;
      const bool is_longitude = role.kind == AxisKind::longitude;
      const int source = line.by_height ? heights : role.coordinate;
      auto values = is_longitude ? unpacked_degrees(file_, source) : unpacked_values(file_, source);
      if (!values) return values.error();
      line.units = is_longitude ? "degrees" : contents_.variables[at(source)].units;
      line.values = std::move(*values);
      if (is_longitude) continue_over_seam(line.values);
      line.falls = line.values.size() > 1 && line.values[1] < line.values[0];
      for (double& value : line.values) value = line.falls ? -value : value;
      out.push_back(std::move(line));
    }
    std::stable_sort(out.begin(), out.end(),
                     [](const Line& a, const Line& b) { return a.uses > b.uses; });
    return out;
  }

  // Whether two lines may be compared. By its place alone a dimension may be of another quantity,
  // such as bins of sizes or tiles of the ground, unless a velocity lies on it.
  [[nodiscard]] bool run_alike(const Line& faces, const Line& centers) const {
    const bool are_of_one_kind = faces.by_place || centers.by_place ? has_velocity(faces.dimension)
                                                                    : faces.kind == centers.kind;
    return faces.role == centers.role && are_of_one_kind && faces.falls == centers.falls &&
           faces.by_height == centers.by_height;
  }

  // Meso-NH: nj_u has the values of nj. Equal numbers of levels or of other variables may mean
  // different places.
  [[nodiscard]] bool are_twins(const Line& faces, const Line& centers) const {
    return faces.role != Role::z && has_velocity(faces.dimension) &&
           !(faces.units.empty() && is_counted(faces.values)) &&
           std::equal(faces.values.begin(), faces.values.end(), centers.values.begin(),
                      centers.values.end(), same_place);
  }

  // MITgcm (X, Xp1, Zl), MOM (xh, xq, zl, zi; xt_ocean, xu_ocean), DALES (xt, xm), ...
  Result<void> by_coordinates() {
    auto found = lines();
    if (!found) return found.error();
    for (std::size_t c = 0; c < found->size(); ++c) {
      const Line& centers = (*found)[c];
      if (found_[at(centers.dimension)].centers >= 0) continue;
      for (std::size_t f = c + 1; f < found->size(); ++f) {
        const Line& faces = (*found)[f];
        if (!run_alike(faces, centers)) continue;
        const auto ratio = ratio_of_units(faces.units, centers.units);
        if (!ratio) continue;
        if (*ratio == 1.0) {
          compare(faces, centers);
          continue;
        }
        Line converted = faces;
        for (double& value : converted.values) value *= *ratio;
        compare(converted, centers);
      }
    }
    return {};
  }

  void compare(const Line& faces, const Line& centers) {
    if (are_twins(faces, centers)) return add(faces.dimension, centers.dimension, true, 0);
    // As many levels between others are faces only if a velocity lies on them.
    const bool is_sure = faces.role != Role::z || faces.values.size() != centers.values.size() ||
                         has_velocity(faces.dimension);
    if (!is_sure) return;
    const bool are_longitudes = faces.kind == AxisKind::longitude;
    const auto first = interleaved(
        are_longitudes ? turned_near(faces.values, centers.values) : faces.values, centers.values,
        centers.by_height ? Interleaving::between : Interleaving::near_middle);
    if (!first) return;
    add(faces.dimension, centers.dimension, false, *first);
    if (centers.by_height && found_[at(faces.dimension)].centers == centers.dimension) {
      found_[at(faces.dimension)].upper = upper_weights(faces.values, centers.values, *first);
    }
  }

  // A dimension between samples that lie between others themselves is not understood.
  void forget_chains() {
    const std::vector<Stagger> all = found_;
    for (Stagger& one : found_) {
      if (one.centers >= 0 && all.at(at(one.centers)).centers >= 0) one = {};
    }
  }

  const ArrayFile& file_;
  const FileContents& contents_;
  std::vector<Stagger> found_;
};

}  // namespace

Result<std::vector<Stagger>> find_staggering(const ArrayFile& file) {
  return StaggerFinder(file).find();
}

}  // namespace windsplat::data::cf
