// Each term of the positions is a line along one component; their origins are added.
#include "server/data/formats/dx/grid.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace windsplat::data::dx {

namespace {

constexpr std::uint64_t axis_max = std::uint64_t{1} << 24;
constexpr std::size_t space_max = 3;
constexpr std::uint64_t items_max = std::uint64_t{1} << 40;

// Points along one index, still with the constant part of their other components.
struct Line {
  std::size_t place = 0;
  std::vector<double> along;      // values of the component that varies
  std::array<double, 3> first{};  // the first point
};

class Builder {
 public:
  Builder(Library& library, const Found& positions, std::uint64_t items)
      : library_(library), positions_(positions), left_(8 * std::min(items, items_max)) {}

  Result<Grid> build() {
    if (auto fine = add(positions_); !fine) return fine.error();
    if (lines_.size() < 2 || lines_.size() > space_max) {
      return fault("a grid of " + std::to_string(lines_.size()) +
                   " dimensions; 2 or 3 are supported");
    }
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      for (std::size_t other = 0; other < i; ++other) {
        if (lines_[i].place == lines_[other].place) {
          return fault("two of its dimensions run mostly along the same axis");
        }
      }
    }
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      GridAxis axis{lines_[i].place, std::move(lines_[i].along)};
      double others = 0;
      for (std::size_t other = 0; other < lines_.size(); ++other) {
        if (other != i) others += lines_[other].first.at(axis.place);
      }
      for (double& value : axis.coordinates) value += others;
      out_.axes.push_back(std::move(axis));
    }
    // Vertical layers are normally the outermost or innermost index; an innermost index along y
    // indicates data arranged for a viewer that looks along z.
    out_.y_up = lines_.size() == 3 && lines_.back().place == 1;
    return std::move(out_);
  }

 private:
  [[nodiscard]] Error fault(const std::string& what) const {
    return positions_.module->file->fault("has unsupported positions: " + what);
  }

  Result<void> add(const Found& term) {
    switch (term.object->kind) {
      case Class::grid_positions:
      case Class::regular:
        return add_regular(*term.object);
      case Class::product:
        return add_terms(term);
      case Class::array:
        return add_listed(term);
      default:
        return fault("they are of class " + printable(term.object->class_name, 40));
    }
  }

  Result<void> add_terms(const Found& product) {
    if (product.object->members.size() > space_max) return fault("more than three terms");
    for (const Member& member : product.object->members) {
      const auto term = library_.find(product, member.value);
      if (!term) return term.error();
      if (term->object->kind == Class::product) return fault("a product of products");
      if (auto fine = add(*term); !fine) return fine;
    }
    return {};
  }

  Result<void> add_regular(const Object& object) {
    const std::size_t rank = object.counts.size();
    const std::size_t dimension = object.origin.size();
    const bool whole = rank >= 1 && rank <= space_max && dimension >= 1 && dimension <= space_max &&
                       object.deltas.size() == rank &&
                       std::all_of(object.deltas.begin(), object.deltas.end(),
                                   [&](const auto& delta) { return delta.size() == dimension; });
    if (!whole) return fault("counts, origin and deltas are inconsistent");
    for (std::size_t d = 0; d < rank; ++d) {
      const auto& delta = object.deltas[d];
      // There are fewer cells than positions: at least half as many along each of three dimensions.
      left_ /= std::max<std::uint64_t>(1, object.counts[d]);
      if (left_ == 0 && object.counts[d] <= axis_max) return fault("more than there are values");
      if (object.counts[d] < 1 || object.counts[d] > axis_max) {
        return fault("a dimension of " + std::to_string(object.counts[d]) + "; 1 to " +
                     std::to_string(axis_max) + " are supported");
      }
      const auto most = std::max_element(
          delta.begin(), delta.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
      double length = 0;
      for (const double value : delta) length = std::hypot(length, value);
      if (!(length > 0) || !std::isfinite(length)) {
        return fault("a delta whose length is zero or not finite");
      }
      Line line;
      line.place = static_cast<std::size_t>(most - delta.begin());
      const bool skew = length - std::abs(*most) > 1e-6 * length;
      out_.oblique = out_.oblique || skew;
      const double step = skew ? std::copysign(length, *most) : *most;
      if (d == 0) std::copy(object.origin.begin(), object.origin.end(), line.first.begin());
      line.along.resize(object.counts[d]);
      for (std::size_t i = 0; i < line.along.size(); ++i) {
        line.along[i] = line.first.at(line.place) + static_cast<double>(i) * step;
      }
      lines_.push_back(std::move(line));
    }
    return {};
  }

  // A list of points in which only one component varies.
  Result<void> add_listed(const Found& term) {
    const Object& object = *term.object;
    if (term.object == positions_.object) {
      return fault("they are listed one by one; regular grids and products of lines are supported");
    }
    const std::uint64_t width = object.shape.size() == 1 ? object.shape[0] : 0;
    if (width < 1 || width > space_max || object.items < 1 || object.items > axis_max) {
      return fault("a term of " + std::to_string(object.items) + " points with " +
                   std::to_string(width) + " coordinates");
    }
    const auto values = library_.numbers(term, axis_max * space_max);
    if (!values) return values.error();
    Line line;
    std::size_t changing = 0;
    for (std::size_t c = 0; c < width; ++c) {
      line.first.at(c) = (*values)[c];
      bool changes = false;
      for (std::size_t i = 1; i < object.items; ++i) {
        changes = changes || (*values)[i * width + c] != (*values)[c];
      }
      if (changes) {
        line.place = c;
        ++changing;
      }
    }
    if (changing != 1) {
      return fault("the points of a term are not on a line along an axis");
    }
    for (std::size_t i = 0; i < object.items; ++i) {
      line.along.push_back((*values)[i * width + line.place]);
    }
    lines_.push_back(std::move(line));
    return {};
  }

  Library& library_;
  const Found& positions_;
  std::uint64_t left_;
  Grid out_;
  std::vector<Line> lines_;
};

}  // namespace

std::size_t world_of(const Grid& grid, std::size_t place) {
  return grid.y_up ? (place + 1) % 3 : place;
}

Result<Grid> grid_of(Library& library, const Found& positions, std::uint64_t items) {
  return Builder(library, positions, items).build();
}

Grid middles(const Grid& grid) {
  Grid out = grid;
  for (GridAxis& axis : out.axes) {
    if (axis.coordinates.size() < 2) continue;
    for (std::size_t i = 0; i + 1 < axis.coordinates.size(); ++i) {
      axis.coordinates[i] = (axis.coordinates[i] + axis.coordinates[i + 1]) / 2;
    }
    axis.coordinates.pop_back();
  }
  return out;
}

}  // namespace windsplat::data::dx
