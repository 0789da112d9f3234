// Kinds -> roles of axes; directions, spacings and ends -> coordinates.
#include "server/data/formats/nrrd/axes.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

namespace windsplat::data::nrrd {

namespace {

constexpr std::uint64_t axis_max = std::uint64_t{1} << 24;
constexpr std::array<const char*, 3> world_names{"x", "y", "z"};

struct KindUse {
  std::string_view kind;
  Use use;
};
constexpr auto kind_uses = std::to_array<KindUse>({{"domain", Use::space},
                                                   {"space", Use::space},
                                                   {"time", Use::steps},
                                                   {"list", Use::steps},
                                                   {"point", Use::steps},
                                                   {"vector", Use::components},
                                                   {"covariant-vector", Use::components},
                                                   {"normal", Use::components},
                                                   {"2-vector", Use::components},
                                                   {"3-vector", Use::components},
                                                   {"3-gradient", Use::components},
                                                   {"3-normal", Use::components},
                                                   {"stub", Use::single},
                                                   {"scalar", Use::single}});

Error bad(std::string what) { return make_error(ErrorKind::bad_data, std::move(what)); }

double length_of(const std::vector<double>& direction) {
  double sum = 0;
  for (const double d : direction) sum += d * d;
  return std::sqrt(sum);
}

class Placer {
 public:
  explicit Placer(const Header& header) : header_(header) { out_.axes.resize(header.axes.size()); }

  Result<Placing> place() {
    if (auto fine = find_uses(); !fine) return fine.error();
    if (auto fine = check_uses(); !fine) return fine.error();
    if (auto fine = find_places(); !fine) return fine.error();
    name_axes();
    return std::move(out_);
  }

 private:
  [[nodiscard]] std::size_t rank() const { return header_.axes.size(); }

  [[nodiscard]] std::size_t count(Use use) const {
    return static_cast<std::size_t>(
        std::count_if(out_.axes.begin(), out_.axes.end(),
                      [use](const PlacedAxis& axis) { return axis.use == use; }));
  }

  [[nodiscard]] bool has_directions() const {
    return std::any_of(header_.axes.begin(), header_.axes.end(),
                       [](const HeaderAxis& axis) { return !axis.direction.empty(); });
  }

  Result<void> find_uses() {
    std::vector<bool> known(rank(), false);
    for (std::size_t a = 0; a < rank(); ++a) {
      const HeaderAxis& axis = header_.axes[a];
      if (axis.kind.empty()) continue;
      const auto* at = std::find_if(kind_uses.begin(), kind_uses.end(),
                                    [&](const KindUse& use) { return use.kind == axis.kind; });
      if (at == kind_uses.end()) {
        return bad("has an axis of kind " + in_quotes(axis.kind) +
                   ": neither space, time nor the components of a vector");
      }
      out_.axes[a].use = at->use;
      known[a] = true;
    }
    guess_uses(known);
    return {};
  }

  // Infers roles without kinds: a fastest axis of length 2 or 3 before the space axes has the
  // components of a vector, and a surplus slowest axis is time.
  void guess_uses(const std::vector<bool>& known) {
    const bool directed = has_directions();
    const auto is_free = [&](std::size_t a) {
      return !known[a] && header_.axes[a].direction.empty();
    };
    const std::uint64_t first = header_.axes.front().size;
    const bool too_many = count(Use::space) > 3;
    if (is_free(0) && (directed || too_many) && (first == 2 || first == 3)) {
      out_.axes.front().use = Use::components;
      out_.notes.push_back("the fastest axis, of " + std::to_string(first) +
                           ", is interpreted as vector components");
    }
    if (is_free(rank() - 1) && rank() > 1 &&
        ((directed && out_.axes.back().use == Use::space) || count(Use::space) > 3)) {
      out_.axes.back().use = Use::steps;
      out_.notes.push_back("the slowest axis, of " + std::to_string(header_.axes.back().size) +
                           ", is interpreted as time");
    }
  }

  Result<void> check_uses() {
    const std::size_t space = count(Use::space);
    if (space < 2 || space > 3) {
      return bad("has " + std::to_string(space) + " axes in space; 2 or 3 are needed");
    }
    if (count(Use::steps) > 1 || count(Use::components) > 1) {
      return bad("has more than one axis of steps or of a vector's components");
    }
    for (std::size_t a = 0; a < rank(); ++a) {
      const std::uint64_t size = header_.axes[a].size;
      const Use use = out_.axes[a].use;
      if (use == Use::components && size > 3) {
        return bad("has vectors of " + std::to_string(size) + " components; 1 to 3 are supported");
      }
      if (use == Use::single && size != 1) {
        return bad("has an axis of kind " + in_quotes(header_.axes[a].kind) + " and size " +
                   std::to_string(size) + "; such axes have size 1");
      }
      if (size > axis_max) {
        return bad("has an axis of size " + std::to_string(size) + "; at most " +
                   std::to_string(axis_max) + " are supported");
      }
    }
    return {};
  }

  // World axes that the space counts in reverse: left, posterior, inferior.
  void find_turned() {
    constexpr std::array<std::string_view, 3> other_way{"left", "posterior", "inferior"};
    std::string_view space = header_.space;
    const auto is_short = space == "ras" || space == "las" || space == "lps" || space == "rast" ||
                          space == "last" || space == "lpst";
    if (is_short) {
      out_.turned = {space[0] == 'l', space[1] == 'p', false};
    } else {
      for (std::size_t w = 0; w < 3 && !space.empty(); ++w) {
        const std::size_t end = std::min(space.find('-'), space.size());
        out_.turned.at(w) = space.substr(0, end) == other_way.at(w);
        space.remove_prefix(std::min(end + 1, space.size()));
      }
    }
    if (out_.turned[0] || out_.turned[1] || out_.turned[2]) {
      out_.notes.push_back("converted from " + header_.space +
                           ": x runs left to right, y to anterior, z to superior, and vectors' "
                           "components with them");
    } else if (header_.space.find("left-handed") != std::string::npos) {
      out_.notes.emplace_back("the space is left-handed and drawn as if it were right-handed");
    }
  }

  Result<void> find_places() {
    if (has_directions()) {
      find_turned();
      return find_directed();
    }
    for (std::size_t a = 0; a < rank(); ++a) {
      const Use use = out_.axes[a].use;
      if (use == Use::space || use == Use::steps) fill_undirected(a);
    }
    return {};
  }

  // spacings, axis mins and axis maxs. Samples are cell-centred unless stated otherwise, as in
  // teem.
  void fill_undirected(std::size_t a) {
    const HeaderAxis& axis = header_.axes[a];
    const auto n = static_cast<double>(axis.size);
    const bool has_min = std::isfinite(axis.min);
    const bool has_max = std::isfinite(axis.max);
    double step = axis.spacing;
    if (has_min && has_max) {
      const double intervals = axis.node_centered ? n - 1 : n;
      step = intervals > 0 ? (axis.max - axis.min) / intervals : 1;
    }
    if (!std::isfinite(step) || step == 0) return;
    double first = 0;
    if (has_min) first = axis.min + (axis.node_centered ? 0 : step / 2);
    fill(a, first, step, 1);
  }

  void fill(std::size_t a, double first, double step, double sign) {
    auto& coordinates = out_.axes[a].coordinates;
    coordinates.resize(header_.axes[a].size);
    for (std::size_t i = 0; i < coordinates.size(); ++i) {
      coordinates[i] = sign * (first + static_cast<double>(i) * step);
    }
  }

  // The dominant world axis of each direction, if they are all different.
  [[nodiscard]] std::optional<std::vector<int>> main_axes(const std::vector<std::size_t>& axes) {
    std::vector<int> out;
    for (const std::size_t a : axes) {
      const auto& d = header_.axes[a].direction;
      const auto most = std::max_element(
          d.begin(), d.end(), [](double l, double r) { return std::abs(l) < std::abs(r); });
      const int world = static_cast<int>(most - d.begin());
      if (std::find(out.begin(), out.end(), world) != out.end()) return std::nullopt;
      out.push_back(world);
    }
    return out;
  }

  Result<void> find_directed() {
    std::vector<std::size_t> axes;
    std::size_t dimension = 0;
    for (std::size_t a = 0; a < rank(); ++a) {
      const auto& direction = header_.axes[a].direction;
      if (direction.empty()) {
        if (out_.axes[a].use == Use::space) {
          return bad("has an axis in space without a direction");
        }
        if (out_.axes[a].use == Use::steps) fill_undirected(a);
        continue;
      }
      if (!(length_of(direction) > 0) || !std::isfinite(length_of(direction))) {
        return bad("has a space direction whose length is zero or not finite");
      }
      if (dimension != 0 && direction.size() != dimension) {
        return bad("has space directions of different dimensions");
      }
      dimension = direction.size();
      axes.push_back(a);
    }
    if (dimension > 4 || (!header_.origin.empty() && header_.origin.size() != dimension)) {
      return bad("has space directions of " + std::to_string(dimension) +
                 " dimensions, which exceeds 4 or differs from its origin");
    }
    return fill_directed(axes, dimension);
  }

  Result<void> fill_directed(const std::vector<std::size_t>& axes, std::size_t dimension) {
    auto worlds = main_axes(axes);
    bool oblique = !worlds;
    if (!worlds) {
      worlds.emplace();
      for (std::size_t i = 0; i < axes.size(); ++i) worlds->push_back(static_cast<int>(i));
    }
    for (std::size_t i = 0; i < axes.size(); ++i) {
      const auto& direction = header_.axes[axes[i]].direction;
      const auto world = static_cast<std::size_t>((*worlds)[i]);
      if (world >= dimension) return bad("has more axes than its space has dimensions");
      const double length = length_of(direction);
      const double along = direction[world];
      const bool skew = std::abs(std::abs(along) - length) > 1e-6 * length;
      oblique = oblique || skew;
      const double step = skew ? std::copysign(length, along) : along;
      const double first = header_.origin.empty() ? 0 : header_.origin[world];
      PlacedAxis& axis = out_.axes[axes[i]];
      if (world == 3) {
        axis.use = Use::steps;
      } else if (axis.use == Use::space) {
        axis.world = static_cast<int>(world);
        if (world < header_.space_units.size()) axis.units = header_.space_units[world];
      }
      fill(axes[i], first, step, world < 3 && out_.turned.at(world) ? -1 : 1);
    }
    if (oblique) {
      out_.notes.emplace_back(
          "the axes run obliquely through space: they are drawn along the nearest straight ones "
          "with their true spacing, and vectors keep their components");
    }
    return {};
  }

  [[nodiscard]] bool is_taken(const std::string& name) const {
    return std::any_of(out_.axes.begin(), out_.axes.end(),
                       [&](const PlacedAxis& axis) { return axis.name == name; });
  }

  // Labels if they are distinct, otherwise x, y, z in the order of the file or of space.
  void name_axes() {
    std::size_t next = 0;
    for (std::size_t a = 0; a < rank(); ++a) {
      PlacedAxis& axis = out_.axes[a];
      const HeaderAxis& header = header_.axes[a];
      if (axis.units.empty()) axis.units = header.units;
      if (axis.use == Use::steps) {
        axis.name = is_taken("time") ? "step" : "time";
        continue;
      }
      if (axis.use != Use::space) continue;
      const std::size_t place = axis.world >= 0 ? static_cast<std::size_t>(axis.world) : next;
      ++next;
      axis.name =
          header.label.empty() || is_taken(header.label) ? world_names.at(place) : header.label;
      while (is_taken_by_other(axis)) axis.name += '_';
      // A label may be more specific than the order: "lon", "z", ...
      if (header.label.empty()) axis.world = static_cast<int>(place);
    }
  }

  [[nodiscard]] bool is_taken_by_other(const PlacedAxis& axis) const {
    return std::any_of(out_.axes.begin(), out_.axes.end(), [&](const PlacedAxis& other) {
      return &other != &axis && other.name == axis.name;
    });
  }

  const Header& header_;
  Placing out_;
};

}  // namespace

Result<Placing> place_axes(const Header& header) { return Placer(header).place(); }

}  // namespace windsplat::data::nrrd
