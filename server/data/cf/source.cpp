// Combines grid, axes, times and fields into a dataset, and reads one field at one step into a
// volume, x fastest.
#include "server/data/cf/source.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/base/ascii.hpp"
#include "server/base/check.hpp"
#include "server/data/bytes/decode_limits.hpp"
#include "server/data/cf/coordinates.hpp"
#include "server/data/cf/fields/derived.hpp"
#include "server/data/cf/fields/fields.hpp"
#include "server/data/cf/fields/rotation.hpp"
#include "server/data/cf/grid/axes.hpp"
#include "server/data/cf/grid/chosen_level.hpp"
#include "server/data/cf/grid/curvilinear.hpp"
#include "server/data/cf/grid/grid.hpp"
#include "server/data/cf/grid/level_heights.hpp"
#include "server/data/cf/grid/level_pressures.hpp"
#include "server/data/cf/grid/plane_spacing.hpp"
#include "server/data/cf/grid/positions.hpp"
#include "server/data/cf/ground.hpp"
#include "server/data/cf/packing.hpp"
#include "server/data/cf/read_blocks.hpp"
#include "server/data/cf/steps.hpp"
#include "server/data/cf/units.hpp"
#include "server/data/model/digest.hpp"

namespace windsplat::data::cf {

namespace {

constexpr std::size_t axis_max = std::size_t{1} << 24;

class ArraySource final : public FileSource {
 public:
  explicit ArraySource(std::unique_ptr<ArrayFile> file) : file_(std::move(file)) {}

  Result<void> prepare(const std::string& title) {
    roles_ = classify_dimensions(file_->contents());
    auto choice = choose_grid(file_->contents(), roles_);
    if (!choice) return named(choice.error());
    choice_ = std::move(*choice);
    if (auto fine = check_entries(); !fine) return named(fine.error());
    info_.left_out = std::move(choice_.left_out);
    info_.notes = file_->contents().notes;
    const std::size_t notes_of_file = info_.notes.size();
    if (!choice_.note.empty()) info_.notes.push_back(choice_.note);
    info_.choices = file_->contents().choices;
    if (auto done = find_axes(); !done) return named(done.error());
    if (auto done = find_steps(*file_, choice_.time, coordinate_of(choice_.time), info_); !done) {
      return named(done.error());
    }
    auto pressures = find_pressures(*file_, coordinate_of(choice_.space[2]), placement_, info_);
    if (!pressures) return named(pressures.error());
    pressures_ = std::move(*pressures);
    auto heights =
        find_heights(*file_, coordinate_of(choice_.space[2]), choice_.variables, placement_, info_);
    if (!heights) return named(heights.error());
    heights_ = std::move(*heights);
    find_ground(*file_, heights_, placement_, info_);
    if (auto done = find_fields(); !done) return named(done.error());
    if (info_.fields.empty()) {
      return named(
          make_error(ErrorKind::bad_data, "every field exceeds the limit of 16 GiB a step"));
    }
    for (std::string note :
         {absent_components_note(file_->contents(), info_.left_out, choice_.variables),
          valid_values_note(*file_, choice_.variables),
          unwritten_note(*file_, choice_.variables)}) {
      if (!note.empty()) info_.notes.push_back(std::move(note));
    }
    bound_notes(notes_of_file, info_.notes);
    const std::filesystem::path name(file_->name());
    info_.id = name.stem().native();
    info_.source = file_->origin();
    info_.title = title.empty() ? file_->contents().title : title;
    if (info_.title.empty()) info_.title = info_.id;
    info_.format = file_->format();
    info_.digest = digest_of(file_->identity() + '\n' + WINDSPLAT_VERSION);
    return {};
  }

  [[nodiscard]] const DatasetInfo& info() const override { return info_; }

  Result<void> fill(std::size_t field, std::size_t step, float* out) override {
    WINDSPLAT_CHECK(field < plans_.size() && step < info_.steps.size());
    const Plan& plan = plans_[field];
    const std::size_t samples = info_.grid.samples();
    const auto tell = [&](double done) { report_progress(done); };
    if (plan.derived >= 0) {
      const DerivedField& rule = derived_[static_cast<std::size_t>(plan.derived)];
      if (auto done = fill_derived(*file_, placement_, pressures_, heights_, rule, step, out, tell);
          !done) {
        return done;
      }
    }
    if (plan.derived < 0) expect_box(*file_, placement_, plan.variables, step, all_samples());
    for (std::size_t c = 0; plan.derived < 0 && c < plan.variables.size(); ++c) {
      const auto part = [&](double done) {
        tell((static_cast<double>(c) + done) / static_cast<double>(plan.variables.size()));
      };
      if (auto done = read_variable(*file_, placement_, plan.variables[c], step, all_levels(),
                                    out + c * samples, part);
          !done) {
        return done;
      }
      multiply(plan.factors[c], samples, out + c * samples);
    }
    if (plan.rotated) {
      if (auto found = find_bearing_of_columns(); !found) return found;
      rotate(*bearing_, placement_.length[2], out, out + samples);
    }
    if (plan.follows_rows) follow_axes(out, out + samples);
    mask_columns(outside_, layers(placement_.length[2] * info_.fields[field].components.size()),
                 placement_.length[0], out);
    return {};
  }

  Result<bool> fill_in_parts(std::size_t field, std::size_t step, PartTaker& taker) override {
    WINDSPLAT_CHECK(field < plans_.size() && step < info_.steps.size());
    const Plan& plan = plans_[field];
    if (plan.derived >= 0 || plan.rotated || plan.follows_rows) return false;
    std::vector<std::vector<Levels>> parts;
    for (const int v : plan.variables) {
      parts.push_back(level_parts(*file_, placement_, v, taker.layers_max()));
      if (parts.back().empty()) return false;
    }
    expect_box(*file_, placement_, plan.variables, step, all_samples());
    const auto all = static_cast<double>(parts.size() * placement_.length[2]);
    std::size_t done = 0;
    for (std::size_t c = 0; c < parts.size(); ++c) {
      for (const Levels& levels : parts[c]) {
        const auto tell = [&](double part) {
          report_progress((static_cast<double>(done) + part * static_cast<double>(levels.count)) /
                          all);
        };
        float* const out = taker.room();
        if (auto read = read_levels(*file_, placement_, plan.variables[c], step, levels, out, tell);
            !read) {
          return read.error();
        }
        multiply(plan.factors[c], levels.count * placement_.layer(), out);
        mask_columns(outside_, layers(levels.count), placement_.length[0], out);
        taker.take({c, levels.first, levels.count});
        done += levels.count;
      }
      forget_step(*file_, placement_, plan.variables[c]);
    }
    return true;
  }

  Result<bool> fill_part(std::size_t field, std::size_t step, const StoredPart& part,
                         float* out) override {
    WINDSPLAT_CHECK(field < plans_.size() && step < info_.steps.size() && part.level == 0);
    if (!info_.fields[field].is_read_by_boxes()) return false;
    const Box& box = part.box;
    const Plan& plan = plans_[field];
    expect_box(*file_, placement_, plan.variables, step, box);
    for (std::size_t c = 0; c < plan.variables.size(); ++c) {
      const int v = plan.variables[c];
      float* const values = out + c * box.samples();
      const auto tell = [&](double part) {
        report_progress((static_cast<double>(c) + part) /
                        static_cast<double>(plan.variables.size()));
      };
      auto read = read_box(*file_, placement_, v, step, box, values, tell);
      if (!read) return read.error();
      forget_step(*file_, placement_, v);
      multiply(plan.factors[c], box.samples(), values);
      mask_columns(outside_, box, placement_.length[0], values);
    }
    return true;
  }

 private:
  // How a field is read or derived.
  struct Plan {
    std::vector<int> variables;
    std::vector<double> factors;  // of variables, from their units to those of the field
    int derived = -1;             // index into derived_
    bool rotated = false;         // rotation of components from east and north to the axes
    bool follows_rows = false;  // exchange and sign of components from rows and columns of the file
                                // to the axes
  };

  // Directions of vector components given along the rows and columns of the file.
  struct ToAxes {
    bool swapped = false;
    std::array<bool, 2> negated{false, false};  // signs after the axes are exchanged
    [[nodiscard]] bool any() const { return swapped || negated[0] || negated[1]; }
  };

  [[nodiscard]] Error named(Error error) const {
    error.message = in_quotes(file_->name()) + ": " + error.message;
    return error;
  }

  [[nodiscard]] const FileDimension& dimension(int id) const {
    return file_->contents().dimensions.at(static_cast<std::size_t>(id));
  }

  // The coordinate variable of a dimension; -1: there is none.
  [[nodiscard]] int coordinate_of(int id) const {
    return id < 0 ? -1 : roles_.at(at(id)).coordinate;
  }

  // Dimensions without coordinates are numbered, which takes memory per entry.
  [[nodiscard]] Result<void> check_entries() const {
    const auto stored = file_->stored_bytes();
    for (const int id : {choice_.space[0], choice_.space[1], choice_.space[2], choice_.time}) {
      if (!stored || id < 0 || dimension(id).length <= entries_max(*stored)) continue;
      return make_error(ErrorKind::bad_data,
                        "the dimension " + in_quotes(dimension(id).name) + " has " +
                            std::to_string(dimension(id).length) + " entries, more than the " +
                            std::to_string(entries_max(*stored)) + " that a file of " +
                            std::to_string(*stored) + " bytes may have");
    }
    return {};
  }

  Result<void> find_axes() {
    auto bearing = find_bearing(*file_, roles_, choice_);
    if (!bearing) {
      return bearing.error();
    }
    for (std::size_t which = 0; which < 3; ++which) {
      if (choice_.space.at(which) < 0) {
        info_.grid.axes.at(which) = flat_axis(which);
        if (auto done = which == 2   ? find_level()
                        : which == 1 ? find_latitude()
                                     : Result<void>();
            !done) {
          return done;
        }
        continue;
      }
      if (auto done = find_axis(which); !done) {
        return done;
      }
      if (which < 2 && bearing->is_curvilinear) {
        placement_.turned.at(which) = bearing->turned.at(which);
      }
    }
    if (bearing->is_curvilinear) {
      to_axes_.swapped = bearing->swapped;
      to_axes_.negated = bearing->turned;
    }
    info_.grid.columns = std::move(bearing->columns);
    placement_.space = choice_.space;
    placement_.time = choice_.time;
    for (std::size_t a = 0; a < 3; ++a) {
      placement_.length.at(a) = info_.grid.axes.at(a).coordinates.size();
    }
    follows_other_axes_ = bearing->is_curvilinear;
    if (!bearing->is_curvilinear) return find_projection();
    if (info_.grid.columns) forget_positions(*file_, roles_, choice_, info_.left_out);
    return {};
  }

  // The positions of axes with 1-D coordinates.
  Result<void> find_projection() {
    const std::array coordinates{coordinate_of(choice_.space[0]), coordinate_of(choice_.space[1])};
    auto positions = find_positions(*file_, choice_.variables, coordinates, placement_, info_);
    if (!positions) return positions.error();
    info_.grid.columns = std::move(positions->columns);
    outside_ = std::move(positions->outside);
    tangents_ = std::move(positions->tangents);
    follows_other_axes_ = positions->follow_other_axes;
    return place_in_plane(*file_, placement_, coordinates, info_);
  }

  [[nodiscard]] Levels all_levels() const { return {0, placement_.length[2]}; }
  [[nodiscard]] Box all_samples() const { return whole_box(info_.grid.dims()); }
  // A box of so many whole layers.
  [[nodiscard]] Box layers(std::size_t count) const {
    Box out = whole_box(info_.grid.dims());
    out.count[2] = static_cast<int>(count);
    return out;
  }

  // Creates the axis of a missing dimension, with one sample.
  [[nodiscard]] Axis flat_axis(std::size_t which) const {
    constexpr std::array<const char*, 3> known_names{"x", "y", "z"};
    Axis axis;
    axis.name = known_names.at(which);
    const bool over_globe = which == 2 && info_.grid.axes[0].kind == AxisKind::longitude;
    axis.kind = over_globe ? AxisKind::level : AxisKind::cartesian;
    axis.coordinates = {0};
    return axis;
  }

  Result<void> find_latitude() {
    if (info_.grid.axes[0].kind != AxisKind::longitude) return {};
    auto latitude = find_chosen_latitude(*file_, choice_.variables);
    if (!latitude) return latitude.error();
    if (*latitude) info_.grid.axes[1] = std::move(**latitude);
    return {};
  }

  Result<void> find_level() {
    auto level = find_chosen_level(*file_, choice_.variables, info_.grid.axes[0].kind);
    if (!level) return level.error();
    if (!*level) return {};
    info_.grid.axes[2] = std::move((*level)->axis);
    level_ = std::move((*level)->name);
    if (!(*level)->note.empty()) info_.notes.push_back(std::move((*level)->note));
    return {};
  }

  Result<void> find_axis(std::size_t which) {
    const int id = choice_.space.at(which);
    DimensionRole& role = roles_.at(static_cast<std::size_t>(id));
    if (dimension(id).length > axis_max) {
      return make_error(ErrorKind::bad_data, "the dimension " + in_quotes(dimension(id).name) +
                                                 " is longer than " + std::to_string(axis_max));
    }
    std::vector<double> coordinates;
    if (role.coordinate >= 0) {
      const FileVariable& variable = file_->contents().variables.at(at(role.coordinate));
      const bool is_angle = role.kind == AxisKind::longitude || role.kind == AxisKind::latitude;
      auto read = is_angle ? unpacked_degrees(*file_, role.coordinate)
                           : unpacked_values(*file_, role.coordinate);
      if (!read) {
        return read.error();
      }
      coordinates = std::move(*read);
      const bool fits = can_be_axis(coordinates, role.kind);
      if (role.is_assumed) tell_assumed(variable.name, dimension(id).name, fits);
      if (role.is_assumed && !fits) {
        role.coordinate = -1;
        coordinates.clear();
      }
      if (is_angle && is_radian(variable.units)) {
        info_.notes.push_back(in_quotes(variable.name) + " is in radians: shown in degrees");
      }
    } else {
      info_.left_out.push_back(
          {dimension(id).name, "dimension without a coordinate variable: placed by index"});
    }
    auto oriented = orient_axis(file_->contents(), role, id, static_cast<int>(which),
                                std::move(coordinates), info_.grid.axes[0].kind);
    if (!oriented) {
      return oriented.error();
    }
    info_.grid.axes.at(which) = std::move(oriented->axis);
    placement_.turned.at(which) = oriented->turned;
    if (!oriented->note.empty()) info_.notes.push_back(std::move(oriented->note));
    return {};
  }

  void tell_assumed(const std::string& name, const std::string& dimension, bool fits) {
    const char* const what = fits ? " is taken as" : " is not monotonic: it is not";
    info_.notes.push_back(in_quotes(name) + what + " the coordinate of " + in_quotes(dimension));
  }

  Result<void> find_fields() {
    const int z = choice_.space[2];
    const bool in_water =
        z >= 0 && (roles_.at(at(z)).kind == AxisKind::depth || is_ocean_level(coordinate_of(z)));
    auto plans = cf::find_fields(file_->contents(), choice_.variables,
                                 in_water ? AxisKind::depth : info_.grid.axes[2].kind, info_.notes);
    for (FieldPlan& plan : plans) {
      const std::string& own = file_->contents().variables[at(plan.variables.front())].level;
      plan.info.off_level = !level_.empty() && own != level_;
    }
    auto derived = find_derived(*file_, placement_, plans, choice_.variables, pressures_, heights_,
                                info_.notes);
    if (!derived) return derived.error();
    derived_ = std::move(*derived);
    for (FieldPlan& plan : plans) {
      add_field(std::move(plan.info),
                {std::move(plan.variables), std::move(plan.factors), -1, false, false});
    }
    for (std::size_t d = 0; d < derived_.size(); ++d) {
      add_field(derived_[d].info, {derived_[d].inputs, {}, static_cast<int>(d), false, false});
    }
    return {};
  }

  [[nodiscard]] bool is_ocean_level(int coordinate) const {
    return coordinate >= 0 &&
           file_->contents().variables.at(at(coordinate)).standard_name.starts_with("ocean_");
  }

  void add_field(FieldInfo info, Plan plan) {
    if (info.kind == FieldKind::vector && follows_other_axes_) find_rotation(info, plan);
    if (plan.derived < 0 && !plan.rotated && !plan.follows_rows) {
      const BoxChunk stored = box_chunk(*file_, placement_, plan.variables);
      info.box_chunk = stored.length;
      info.box_chunk_first = stored.first;
    }
    const std::size_t values = info_.grid.samples() * info.components.size();
    if (!info.is_read_by_boxes() && values * sizeof(float) > volume_bytes_max) {
      info_.left_out.push_back({info.name, "more than 16 GiB a step, and not read by boxes"});
      return;
    }
    double decoded = 0;
    double chunk = 0;
    for (const int v : plan.variables) {
      decoded += decoded_step_bytes(*file_, placement_, v, all_levels());
      chunk = std::max(chunk, chunk_bytes(*file_, v));
    }
    info.decoded_bytes = static_cast<std::uint64_t>(std::min(decoded, 0x1p62));
    info.chunk_bytes = static_cast<std::uint64_t>(std::min(chunk, 0x1p62));
    info_.fields.push_back(std::move(info));
    plans_.push_back(std::move(plan));
  }

  // Determines how a vector is converted to the axes of the grid, which may differ from east and
  // north.
  void find_rotation(const FieldInfo& info, Plan& plan) {
    const auto& first =
        file_->contents().variables.at(static_cast<std::size_t>(plan.variables.front()));
    const bool by_earth = first.standard_name.starts_with("eastward_");
    const bool by_grid = first.standard_name.starts_with("x_") ||
                         first.standard_name.starts_with("grid_") ||
                         first.standard_name.find("_x_") != std::string::npos;
    std::string note = in_quotes(info.name);
    if (by_earth && info_.grid.columns) {
      note += " has components along east and north: rotated to the rows and columns of the grid";
    } else if (by_earth) {
      note +=
          " has components along east and north, but longitudes and latitudes of the grid are "
          "missing or incomplete: it is drawn as if rows ran east";
    } else if (!by_grid) {
      note += " does not specify the direction of its components: assumed to be along the axes";
    }
    if (by_earth || !by_grid) info_.notes.push_back(std::move(note));
    plan.rotated = by_earth && info_.grid.columns;
    // u and v without attributes more often mean east and north than rows and columns.
    plan.follows_rows = by_grid && to_axes_.any();
    if (!plan.follows_rows) return;
    note = in_quotes(info.name) + " has components along rows and columns of the file: they are ";
    const bool turned = to_axes_.negated[0] || to_axes_.negated[1];
    note += to_axes_.swapped ? (turned ? "exchanged and reversed" : "exchanged") : "reversed";
    note += " with the axes";
    info_.notes.push_back(std::move(note));
  }

  void follow_axes(float* x, float* y) const {
    for (std::size_t n = 0; n < info_.grid.samples(); ++n) {
      if (to_axes_.swapped) std::swap(x[n], y[n]);
      if (to_axes_.negated[0]) x[n] = -x[n];
      if (to_axes_.negated[1]) y[n] = -y[n];
    }
  }

  Result<void> find_bearing_of_columns() {
    if (bearing_) return {};
    if (!tangents_) {
      bearing_ = bearing_of(*info_.grid.columns, placement_.length[0]);
      return {};
    }
    const auto tangents = tangents_();
    if (!tangents) return named(tangents.error());
    bearing_ = bearing_of(*tangents);
    return {};
  }

  std::unique_ptr<ArrayFile> file_;
  std::vector<DimensionRole> roles_;
  GridChoice choice_;
  std::string level_;  // as in ChosenLevel; empty if none was chosen
  Placement placement_;
  DatasetInfo info_;
  PressureLevels pressures_;
  LevelHeights heights_;
  bool follows_other_axes_ = false;  // rows may not run east
  std::vector<bool> outside_;        // columns that do not lie on the Earth; empty: all do
  ToAxes to_axes_;
  std::function<Result<AxisTangents>()> tangents_;  // as in Positions
  std::optional<GridBearing> bearing_;
  std::vector<DerivedField> derived_;
  std::vector<Plan> plans_;  // parallel to info_.fields
};

}  // namespace

Result<std::unique_ptr<FileSource>> make_source(std::unique_ptr<ArrayFile> file,
                                                const std::string& title) {
  auto source = std::make_unique<ArraySource>(std::move(file));
  if (auto done = source->prepare(title); !done) {
    return done.error();
  }
  return std::unique_ptr<FileSource>(std::move(source));
}

}  // namespace windsplat::data::cf
