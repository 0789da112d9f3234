// Auxiliary heights of a dimension, and which variables name them -> staggering by variable.
#include "server/data/cf/staggered/shared_levels.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>

#include "server/data/cf/coordinates.hpp"
#include "server/data/cf/grid/axes.hpp"
#include "server/data/cf/level_direction.hpp"
#include "server/data/cf/staggered/interleaved.hpp"
#include "server/data/cf/units.hpp"

namespace windsplat::data::cf {

namespace {

// Heights or depths of the levels, and the variables along the dimension that they place.
struct Heights {
  int variable = -1;
  std::vector<int> users;
};

bool names(const FileVariable& user, std::string_view name) {
  std::istringstream words(user.coordinates);
  for (std::string word; words >> word;) {
    if (word == name) return true;
  }
  return false;
}

class SharedLevelFinder {
 public:
  explicit SharedLevelFinder(const ArrayFile& file) : file_(file), contents_(file.contents()) {
    found_.staggers.resize(contents_.variables.size());
    found_.unread.resize(contents_.variables.size());
  }

  Result<SharedLevels> find() {
    const std::vector<DimensionRole> roles = classify_dimensions(contents_);
    for (std::size_t d = 0; d < roles.size(); ++d) {
      const bool is_bare = roles[d].kind == AxisKind::level || roles[d].coordinate < 0;
      if (!is_bare || contents_.dimensions[d].length > compared_length_max) continue;
      if (auto done = compare(static_cast<int>(d)); !done) return done.error();
    }
    return std::move(found_);
  }

 private:
  [[nodiscard]] const FileVariable& variable(int v) const { return contents_.variables[at(v)]; }

  [[nodiscard]] static bool is_along(const FileVariable& variable, int dimension) {
    return variable.numeric && variable.dims.size() > 1 &&
           std::count(variable.dims.begin(), variable.dims.end(), dimension) > 0;
  }

  // Those of most variables first. A variable that names several belongs to the first of them.
  [[nodiscard]] std::vector<Heights> heights_on(int dimension) const {
    std::vector<Heights> out;
    for (std::size_t v = 0; v < contents_.variables.size(); ++v) {
      const FileVariable& one = contents_.variables[v];
      if (!one.numeric || one.dims != std::vector<int>{dimension} || !metres_in(one.units) ||
          direction_of_levels(one) == 0) {
        continue;
      }
      out.push_back({static_cast<int>(v), {}});
    }
    if (out.size() < 2) return {};
    for (std::size_t u = 0; u < contents_.variables.size(); ++u) {
      const FileVariable& user = contents_.variables[u];
      if (!is_along(user, dimension)) continue;
      const auto named = std::find_if(out.begin(), out.end(), [&](const Heights& one) {
        return names(user, variable(one.variable).name);
      });
      if (named != out.end()) named->users.push_back(static_cast<int>(u));
    }
    std::stable_sort(out.begin(), out.end(), [](const Heights& a, const Heights& b) {
      return a.users.size() > b.users.size();
    });
    return out;
  }

  // Metres, ascending if they are monotonic: with the opposite sign if the levels run the other
  // way.
  [[nodiscard]] Result<std::vector<double>> values_of(int v, bool falls) const {
    auto values = unpacked_values(file_, v);
    if (!values) return values;
    const double metres = metres_in(variable(v).units).value_or(1);
    for (double& value : *values) value *= falls ? -metres : metres;
    return values;
  }

  Result<void> compare(int dimension) {
    const std::vector<Heights> all = heights_on(dimension);
    if (all.size() < 2 || all[0].users.empty()) return {};
    auto centers = values_of(all[0].variable, false);
    if (!centers) return centers.error();
    const bool falls = centers->size() > 1 && centers->back() < centers->front();
    for (double& value : *centers) value *= falls ? -1 : 1;
    std::vector<std::vector<double>> values{*centers};
    for (std::size_t n = 1; n < all.size(); ++n) {
      auto faces = values_of(all[n].variable, falls);
      if (!faces) return faces.error();
      values.push_back(std::move(*faces));
      if (values.back() == *centers || all[n].users.empty()) continue;
      place(all[n], dimension, values.back(), *centers, all[0].variable);
    }
    if (std::count(values.begin(), values.end(), *centers) == std::ssize(values)) return {};
    leave_out(all, values, dimension);
    return {};
  }

  // Variables along the dimension that name none of its heights, or several that differ.
  // values: of all.
  void leave_out(const std::vector<Heights>& all, const std::vector<std::vector<double>>& values,
                 int dimension) {
    for (std::size_t v = 0; v < contents_.variables.size(); ++v) {
      const FileVariable& one = contents_.variables[v];
      if (!is_along(one, dimension)) continue;
      const std::vector<double>* first = nullptr;
      bool differs = false;
      for (std::size_t n = 0; n < all.size(); ++n) {
        if (!names(one, variable(all[n].variable).name)) continue;
        differs = differs || (first != nullptr && *first != values[n]);
        first = &values[n];
      }
      if (differs) {
        found_.unread[v] = "its 'coordinates' names several heights that differ on its levels";
        found_.staggers[v] = {};
      } else if (first == nullptr && one.dims.size() > 2) {
        found_.unread[v] = "on levels that have several heights, of which it names none";
      }
    }
  }

  void place(const Heights& at_faces, int dimension, const std::vector<double>& faces,
             const std::vector<double>& centers, int of_centers) {
    const bool same_way = direction_of_levels(variable(at_faces.variable)) ==
                          direction_of_levels(variable(of_centers));
    std::optional<std::ptrdiff_t> first;
    if (same_way) first = interleaved(faces, centers, Interleaving::between);
    for (const int user : at_faces.users) {
      if (first) {
        found_.staggers[at(user)] = {dimension, false, *first,
                                     upper_weights(faces, centers, *first)};
      } else {
        found_.unread[at(user)] = "at the heights " + in_quotes(variable(at_faces.variable).name) +
                                  ", which do not lie between those of other variables on its "
                                  "levels (" +
                                  in_quotes(variable(of_centers).name) + ')';
      }
    }
  }

  const ArrayFile& file_;
  const FileContents& contents_;
  SharedLevels found_;
};

}  // namespace

Result<SharedLevels> find_shared_levels(const ArrayFile& file) {
  return SharedLevelFinder(file).find();
}

}  // namespace windsplat::data::cf
