// Finds the common dimensions of the parts, then lists the variables of all.
#include "server/data/cf/joined.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/cf/coordinates.hpp"
#include "server/data/cf/grid/axes.hpp"
#include "server/data/cf/grid/cell_lists.hpp"
#include "server/data/cf/grid/curvilinear.hpp"
#include "server/data/cf/selected/selected_file.hpp"
#include "server/data/cf/series.hpp"
#include "server/data/cf/staggered/column_offsets.hpp"
#include "server/data/cf/time.hpp"
#include "server/data/model/digest.hpp"

namespace windsplat::data::cf {

namespace {

// The columns of a part.
struct GridOfPart {
  std::array<int, 2> dimensions{-1, -1};  // of rows and of columns, in the part
  ColumnPlaces places;
};

// The 2-D positions of a file; empty unless it has exactly one pair of them.
Result<std::optional<GridOfPart>> positions_in(const ArrayFile& file) {
  const FileContents& contents = file.contents();
  std::optional<GridOfPart> found;
  for (const FileVariable& variable : contents.variables) {
    if (!variable.numeric || variable.dims.size() != 2 || !is_position(variable)) continue;
    const std::array<int, 2> dims{variable.dims[0], variable.dims[1]};
    if (found && found->dimensions == dims) continue;
    const int longitude = position_on(contents, dims[0], dims[1], true);
    const int latitude = position_on(contents, dims[0], dims[1], false);
    if (longitude < 0 || latitude < 0) continue;
    if (found) return std::optional<GridOfPart>();
    if (contents.variables[at(longitude)].dims != contents.variables[at(latitude)].dims) {
      return std::optional<GridOfPart>();
    }
    auto places = column_places(file, longitude, latitude);
    if (!places) return places.error();
    found = GridOfPart{dims, std::move(*places)};
  }
  return found;
}

Error cannot_join(const ArrayFile& part, const ArrayFile& first, const std::string& what) {
  return make_error(ErrorKind::bad_data, in_quotes(part.origin()) + " cannot be joined with " +
                                             in_quotes(first.origin()) + ": " + what);
}

int add_dimension(FileContents& contents, FileDimension dimension) {
  const std::string wanted = dimension.name;
  for (int n = 2; std::any_of(contents.dimensions.begin(), contents.dimensions.end(),
                              [&](const FileDimension& d) { return d.name == dimension.name; });
       ++n) {
    dimension.name = wanted + '_' + std::to_string(n);
  }
  contents.dimensions.push_back(std::move(dimension));
  return static_cast<int>(contents.dimensions.size()) - 1;
}

// Whether two coordinates are the same, and how far equal times lie apart beyond the rounding of
// doubles.
struct Comparison {
  bool same = false;
  double apart = 0;
};

// Compares `own` of the first file and `other` of the part.
Result<Comparison> compared(const ArrayFile& first, int own, const ArrayFile& part, int other,
                            bool is_time) {
  auto a = unpacked_values(first, own);
  if (!a) return a.error();
  auto b = unpacked_values(part, other);
  if (!b) return b.error();
  const FileVariable& to = first.contents().variables.at(at(own));
  const FileVariable& from = part.contents().variables.at(at(other));
  if (!is_time) {
    return Comparison{from.units == to.units &&
                          std::equal(a->begin(), a->end(), b->begin(), b->end(), same_place),
                      0};
  }
  const auto kept = times_in(*a, to, to);
  const auto times = times_in(*b, from, to);
  if (!kept || !times || kept->values.size() != times->values.size()) return Comparison{};
  const double tolerance = time_tolerance(*kept, *times);
  double apart = 0;
  for (std::size_t n = 0; n < times->values.size(); ++n) {
    const double x = kept->values[n];
    const double y = times->values[n];
    if (same_number(x, y)) continue;
    if (!(std::abs(x - y) <= tolerance)) return Comparison{};
    apart = std::max(apart, std::abs(x - y));
  }
  return Comparison{true, apart > kept->exact + times->exact ? apart : 0};
}

// A UUID that is known, in the words of an error.
std::string grid_text(const FileDimension& list) {
  return std::to_string(list.length) + " cells of the UUID " + list.grid_uuid;
}

}  // namespace

Result<std::unique_ptr<JoinedFile>> JoinedFile::open(
    std::string name, std::string origin, std::vector<std::unique_ptr<ArrayFile>> parts) {
  std::unique_ptr<JoinedFile> joined(new JoinedFile(std::move(name), std::move(origin)));
  joined->parts_ = std::move(parts);
  if (const auto bytes = joined->parts_.front()->stored_bytes()) joined->set_stored_bytes(*bytes);
  joined->contents_.title = joined->parts_.front()->contents().title;
  for (const auto& part : joined->parts_) {
    if (auto added = joined->add(*part); !added) return added.error();
  }
  joined->contents_.notes.push_back(std::to_string(joined->parts_.size()) +
                                    " parts with different variables joined");
  return joined;
}

std::string JoinedFile::identity() const {
  std::string all;
  for (const auto& part : parts_) all += part->identity() + '\n';
  return digest_of(all);
}

Result<void> JoinedFile::add(const ArrayFile& part) {
  const FileContents& added = part.contents();
  const std::string differs = differing_entry(contents_, added);
  if (!differs.empty()) return cannot_join(part, *parts_.front(), differs);
  const std::vector<DimensionRole> known = classify_dimensions(contents_);
  const std::vector<DimensionRole> roles = classify_dimensions(added);
  std::vector<int> dimensions;  // of the joined file, by dimension of the part
  for (std::size_t d = 0; d < added.dimensions.size(); ++d) {
    auto own = dimension_of(part, static_cast<int>(d), roles[d], known);
    if (!own) return own.error();
    dimensions.push_back(*own);
  }
  if (&part != parts_.front().get()) {
    if (auto placed = place_faces(part, dimensions); !placed) return placed;
  }
  for (std::size_t v = 0; v < added.variables.size(); ++v) {
    auto done = add_variable(part, static_cast<int>(v), dimensions);
    if (!done) return done;
  }
  contents_.left_out.insert(contents_.left_out.end(), added.left_out.begin(), added.left_out.end());
  for (const DimensionChoice& choice : added.choices) {
    const bool known =
        std::any_of(contents_.choices.begin(), contents_.choices.end(),
                    [&](const DimensionChoice& one) { return one.name == choice.name; });
    if (!known && contents_.choices.size() < choices_max) contents_.choices.push_back(choice);
  }
  for (const std::string& note : added.notes) {
    if (std::count(contents_.notes.begin(), contents_.notes.end(), note) == 0) {
      contents_.notes.push_back(note);
    }
  }
  return {};
}

// The common dimension of a part's dimension, added if there is none. known: roles of the
// dimensions of the parts before.
Result<int> JoinedFile::dimension_of(const ArrayFile& part, int dimension,
                                     const DimensionRole& role,
                                     const std::vector<DimensionRole>& known) {
  const FileDimension& wanted = part.contents().dimensions.at(at(dimension));
  for (std::size_t d = 0; d < known.size(); ++d) {
    const int own = static_cast<int>(d);
    const FileDimension& found = contents_.dimensions[d];
    const bool named = found.name == wanted.name;
    const bool both = known[d].coordinate >= 0 && role.coordinate >= 0;
    const bool is_time = role.role == Role::time && known[d].role == Role::time;
    const bool alike = role.role != Role::unknown && role.role == known[d].role;
    if (!named && !(both && alike)) continue;
    if (are_of_different_grids(found, wanted)) continue;
    if (found.length == wanted.length) {
      if (!both) {
        if (!named) continue;
        merge_lists(contents_.dimensions[d], wanted);
        return own;
      }
      const auto same = compared(*this, known[d].coordinate, part, role.coordinate, is_time);
      if (!same) return same.error();
      if (same->apart > 0) {
        contents_.notes.push_back(
            "the times of " + in_quotes(part.origin()) + " differ by up to " +
            number_text(same->apart) + " (" +
            contents_.variables.at(at(known[d].coordinate)).units + ") from those of " +
            in_quotes(parts_.front()->origin()) +
            ", which are shown: they are taken for the same within the rounding of 32-bit floats");
      }
      if (same->same) return own;
    }
    if (is_time) {
      return cannot_join(part, *parts_.front(),
                         "its times are others (" + std::to_string(wanted.length) + " and " +
                             std::to_string(found.length) + " steps)" + damage_of(part) +
                             damage_of(*parts_.front()));
    }
  }
  FileDimension added = wanted;
  added.centers = -1;  // an index of the part's dimensions
  return add_dimension(contents_, std::move(added));
}

// Takes for one the lists of cells of equal names and lengths.
void JoinedFile::merge_lists(FileDimension& own, const FileDimension& added) {
  const bool is_one_unknown = own.grid_uuid.empty() != added.grid_uuid.empty();
  own.is_list = own.is_list || added.is_list;
  if (own.grid_uuid.empty()) own.grid_uuid = added.grid_uuid;
  if (!own.is_list || !is_one_unknown) return;
  const std::string note =
      "the horizontal grid is taken for that of the fields since it has as many cells: one of the "
      "files has no uuidOfHGrid";
  if (std::count(contents_.notes.begin(), contents_.notes.end(), note) == 0) {
    contents_.notes.push_back(note);
  }
}

// Gives dimensions of their own to a part whose columns lie half a cell beside those of the others.
Result<void> JoinedFile::place_faces(const ArrayFile& part, std::vector<int>& dimensions) {
  const auto own = positions_in(*this);
  if (!own) return own.error();
  const auto others = positions_in(part);
  if (!others) return others.error();
  if (!*own || !*others) return {};
  const std::array<int, 2> common{dimensions.at(at((*others)->dimensions[0])),
                                  dimensions.at(at((*others)->dimensions[1]))};
  if (common != (*own)->dimensions) return {};
  const auto offset = offset_in_cells((*own)->places, (*others)->places);
  if (!offset) return {};
  for (std::size_t a = 0; a < 2; ++a) {
    const double cells = offset->at(a);
    if (std::abs(cells) <= offset_tolerance) continue;
    const auto first = first_face_at(cells);
    if (!first) {
      return cannot_join(part, *parts_.front(), "its longitudes and latitudes are others");
    }
    FileDimension faces = contents_.dimensions.at(at(common.at(a)));
    faces.name += "_faces";
    faces.centers = common.at(a);
    faces.first_face = static_cast<int>(*first);
    dimensions.at(at((*others)->dimensions.at(a))) = add_dimension(contents_, std::move(faces));
  }
  return {};
}

Result<void> JoinedFile::add_variable(const ArrayFile& part, int variable,
                                      const std::vector<int>& dimensions) {
  FileVariable added = part.contents().variables.at(at(variable));
  const int present = variable_named(contents_, added.name);
  if (present >= 0) {
    bool is_listed = false;
    for (const int d : added.dims) {
      const FileDimension& list = part.contents().dimensions.at(at(d));
      is_listed = is_listed || list.is_list;
      for (const int own : contents_.variables[at(present)].dims) {
        const FileDimension& other = contents_.dimensions.at(at(own));
        if (!are_of_different_grids(list, other)) continue;
        return cannot_join(part, *parts_.front(),
                           in_quotes(added.name) + " is on a horizontal grid of " +
                               grid_text(list) + ", in another file on one of " + grid_text(other));
      }
    }
    // Coordinates are repeated in every file.
    const std::size_t repeated = is_listed && side_of(added) == 0 ? 1 : 2;
    if (added.dims.size() > repeated && !is_position(added)) {
      contents_.left_out.push_back({added.name, "in several files: that of " +
                                                    in_quotes(parts_.front()->origin()) +
                                                    " or of the next one that has it is used"});
    }
    return {};
  }
  for (int& d : added.dims) d = dimensions.at(at(d));
  contents_.variables.push_back(std::move(added));
  places_.push_back({&part, variable});
  return {};
}

Numbers JoinedFile::numbers(int variable, const char* attribute) const {
  return place_of(variable).part->numbers(place_of(variable).variable, attribute);
}

std::string JoinedFile::text_of(int variable, const char* attribute) const {
  return place_of(variable).part->text_of(place_of(variable).variable, attribute);
}

std::vector<std::size_t> JoinedFile::chunk(int variable) const {
  return place_of(variable).part->chunk(place_of(variable).variable);
}

std::size_t JoinedFile::chunk_cost_bytes(int variable) const {
  return place_of(variable).part->chunk_cost_bytes(place_of(variable).variable);
}

Unwritten JoinedFile::unwritten(int variable, std::size_t most) const {
  return place_of(variable).part->unwritten(place_of(variable).variable, most);
}

void JoinedFile::forget_chunks(int variable) const {
  place_of(variable).part->forget_chunks(place_of(variable).variable);
}

Result<void> JoinedFile::read(int variable, const std::vector<std::size_t>& start,
                              const std::vector<std::size_t>& count, double* out) const {
  return place_of(variable).part->read(place_of(variable).variable, start, count, out);
}

Result<void> JoinedFile::read(int variable, const std::vector<std::size_t>& start,
                              const std::vector<std::size_t>& count, float* out) const {
  return place_of(variable).part->read(place_of(variable).variable, start, count, out);
}

}  // namespace windsplat::data::cf
