// The chosen object -> fields with their steps -> variables on one grid.
#include "server/data/formats/dx/file.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/base/ascii.hpp"
#include "server/data/bytes/text.hpp"
#include "server/data/formats/dx/grid.hpp"
#include "server/data/formats/dx/library.hpp"
#include "server/data/formats/plain/placed_file.hpp"

namespace windsplat::data::dx {

namespace {

using bytes::PlacedFile;

// One field at all steps.
struct Sequence {
  std::string name;
  std::string units;
  Grid grid;
  std::vector<double> positions;  // in the series
  std::vector<std::uint64_t> shape;
  std::string type;  // as in the file
  std::vector<bytes::Placement> steps;
  bool cells = false;
};

std::string attribute(const Object& object, const char* name) {
  const auto at = object.attributes.find(name);
  return at == object.attributes.end() ? std::string() : at->second;
}

class Opener {
 public:
  Opener(std::shared_ptr<Files> files, std::shared_ptr<const InputFile> input)
      : input_(std::move(input)), library_(std::move(files)) {}

  Result<std::unique_ptr<cf::ArrayFile>> open() {
    const auto root = library_.root(input_);
    if (!root) return root.error();
    file_ = std::make_unique<PlacedFile>(input_->name(), "OpenDX");
    if (root->object->kind == Class::group) {
      add_group(*root);
    } else {
      add_sequence(*root, "");
    }
    if (sequences_.empty()) {
      return refused_ ? *refused_ : input_->fault("has a group without members");
    }
    file_->add_identity(library_.identity());
    add_dimensions();
    for (const Sequence& sequence : sequences_) add_variables(sequence);
    return std::unique_ptr<cf::ArrayFile>(std::move(file_));
  }

 private:
  void add_group(const Found& group) {
    for (const Member& member : group.object->members) {
      const auto found = library_.find(group, member.value);
      if (!found) {
        leave_out(member.name, found.error());
      } else {
        add_sequence(*found, member.name);
      }
    }
  }

  void leave_out(const std::string& name, const Error& why) {
    if (!refused_) refused_ = why;
    file_->add_note(in_quotes(name) + " is omitted: " + why.message);
  }

  void add_sequence(const Found& found, const std::string& name) {
    auto sequence = sequence_of(found);
    if (!sequence) return leave_out(name.empty() ? found.object->name : name, sequence.error());
    sequence->name = free_name(name.empty() || bytes::to_integer(name) ? own_name(found) : name);
    if (!sequences_.empty() && (!(sequences_.front().grid == sequence->grid) ||
                                sequences_.front().positions != sequence->positions)) {
      return leave_out(sequence->name, input_->fault("shows one grid and series; this field has "
                                                     "a different one"));
    }
    sequences_.push_back(std::move(*sequence));
  }

  [[nodiscard]] std::string own_name(const Found& found) const {
    std::string name = attribute(*found.object, "name");
    if (name.empty()) name = found.object->name;
    const bool tells = !name.empty() && name != "default" && !bytes::to_integer(name);
    return tells ? name : std::filesystem::path(input_->name()).stem().native();
  }

  [[nodiscard]] std::string free_name(const std::string& wanted) const {
    std::string name = wanted;
    for (int n = 2; std::any_of(sequences_.begin(), sequences_.end(),
                                [&](const Sequence& known) { return known.name == name; });
         ++n) {
      name = wanted + '_' + std::to_string(n);
    }
    return name;
  }

  Result<Sequence> sequence_of(const Found& found) {
    Sequence out;
    if (found.object->kind == Class::field) {
      out.positions = {0};
      if (auto fine = add_step(out, found); !fine) return fine.error();
      return out;
    }
    if (found.object->kind != Class::series || found.object->members.empty()) {
      return found.module->file->fault("has an object " + in_quotes(found.object->name) +
                                       " of class " + printable(found.object->class_name, 40) +
                                       ": neither a field nor a series with members");
    }
    for (const Member& member : found.object->members) {
      const auto field = library_.find(found, member.value);
      if (!field) return field.error();
      out.positions.push_back(member.position);
      if (auto fine = add_step(out, *field); !fine) return fine.error();
    }
    return out;
  }

  Result<Found> component(const Found& field, const char* name) {
    const auto& members = field.object->members;
    const auto at = std::find_if(members.begin(), members.end(),
                                 [name](const Member& known) { return known.name == name; });
    if (at == members.end()) {
      return field.module->file->fault("has a field " + in_quotes(field.object->name) +
                                       " without the component '" + name + "'");
    }
    return library_.find(field, at->value);
  }

  Result<void> add_step(Sequence& out, const Found& field) {
    const auto fault = [&](const std::string& what) {
      return field.module->file->fault("has a field " + in_quotes(field.object->name) + " " + what);
    };
    if (field.object->kind != Class::field) return fault("that is not a field");
    const auto data = component(field, "data");
    if (!data) return data.error();
    const auto positions = component(field, "positions");
    if (!positions) return positions.error();
    const auto connections = component(field, "connections");
    if (!connections) return connections.error();
    if (connections->object->kind != Class::grid_connections) {
      return fault("on an irregular mesh: only gridconnections are supported");
    }
    auto place = library_.place(*data);
    if (!place) return place.error();
    auto grid = grid_of(library_, *positions, data->object->items);
    if (!grid) return grid.error();
    const bool cells = lower(attribute(*data->object, "dep")) == "connections";
    if (cells) *grid = middles(*grid);
    std::vector<std::uint64_t> counts;
    for (const GridAxis& axis : grid->axes) counts.push_back(axis.coordinates.size());
    const auto samples = bytes::product(counts);
    if (!samples || *samples != data->object->items) {
      return fault("with " + std::to_string(data->object->items) + " values on " +
                   (samples ? std::to_string(*samples) : std::string("too many")) + " positions");
    }
    return append(out, std::move(*grid), *data->object, std::move(*place), cells,
                  fault("whose members differ in grid or type"),
                  fault("with values of an unsupported shape: only numbers and vectors of 2 or 3 "
                        "components are supported"));
  }

  Result<void> append(Sequence& out, Grid grid, const Object& data, bytes::Placement place,
                      bool cells, const Error& differs, const Error& shape) const {
    std::vector<std::uint64_t> components = data.shape;
    if (components == std::vector<std::uint64_t>{1}) components.clear();
    if (components.size() > 1 ||
        (components.size() == 1 && components[0] != 2 && components[0] != 3)) {
      return shape;
    }
    if (out.steps.empty()) {
      out.grid = std::move(grid);
      out.shape = components;
      out.type = bytes::name_of(data.type);
      out.units = attribute(data, "units");
      out.cells = cells;
    } else if (!(out.grid == grid) || out.shape != components || out.cells != cells ||
               out.steps.front().type != place.type ||
               out.steps.front().big_endian != place.big_endian) {
      return differs;
    }
    out.steps.push_back(std::move(place));
    return {};
  }

  void add_dimensions() {
    constexpr std::array<const char*, 3> names{"x", "y", "z"};
    constexpr std::array<const char*, 3> axes{"X", "Y", "Z"};
    const Sequence& first = sequences_.front();
    if (first.steps.size() > 1) {
      dims_.push_back(file_->add_dimension("series", first.steps.size()));
      file_->add_axis(dims_.back(), {"", "T", "", ""}, first.positions);
    }
    for (const GridAxis& axis : first.grid.axes) {
      dims_.push_back(file_->add_dimension(names.at(axis.place), axis.coordinates.size()));
      file_->add_axis(dims_.back(), {"", axes.at(world_of(first.grid, axis.place)), "", ""},
                      axis.coordinates);
    }
    if (first.grid.y_up) {
      file_->add_note(
          "the innermost index runs along y: y is interpreted as vertical, and x, y, z of the file "
          "are drawn as y, z, x");
    }
    if (first.grid.oblique) {
      file_->add_note(
          "the axes run obliquely through space: they are drawn along the nearest straight ones "
          "with their true spacing");
    }
    if (first.cells) file_->add_note("values belong to cells: they are placed at cell centres");
  }

  // Concatenates the steps of a series.
  static std::shared_ptr<bytes::ByteStore> joined(const Sequence& sequence, std::uint64_t bytes) {
    if (sequence.steps.size() == 1) return sequence.steps.front().store;
    std::vector<bytes::Piece> pieces;
    for (const bytes::Placement& step : sequence.steps) {
      pieces.push_back({bytes, [store = step.store]() {
                          return Result<std::shared_ptr<bytes::ByteStore>>(store);
                        }});
    }
    return bytes::joined_store(std::move(pieces));
  }

  void add_variables(const Sequence& sequence) {
    const std::uint64_t components = sequence.shape.empty() ? 1 : sequence.shape[0];
    bytes::Placement place = sequence.steps.front();
    const std::uint64_t size = bytes::size_of(place.type);
    std::uint64_t stride = size * components;
    for (auto axis = sequence.grid.axes.rbegin(); axis != sequence.grid.axes.rend(); ++axis) {
      place.strides.insert(place.strides.begin(), stride);
      place.present.insert(place.present.begin(), bytes::Stored{0, axis->coordinates.size()});
      stride *= axis->coordinates.size();
    }
    if (sequence.steps.size() > 1) {
      place.strides.insert(place.strides.begin(), stride);
      place.present.insert(place.present.begin(), bytes::Stored{0, sequence.steps.size()});
    }
    place.store = joined(sequence, stride);
    constexpr std::array<const char*, 3> suffixes{"_x", "_y", "_z"};
    for (std::size_t c = 0; c < components; ++c) {
      FileVariable variable;
      variable.dims = dims_;
      variable.type = sequence.type;
      variable.units = sequence.units;
      variable.name = sequence.name;
      if (components > 1) {
        variable.name += suffixes.at(c);
        variable.vector_mark = sequence.name + ' ' + std::to_string(world_of(sequence.grid, c));
      }
      place.offset = c * size;
      file_->add_array(std::move(variable), place, {});
    }
  }

  std::shared_ptr<const InputFile> input_;
  Library library_;
  std::unique_ptr<PlacedFile> file_;
  std::vector<Sequence> sequences_;
  std::vector<int> dims_;
  std::optional<Error> refused_;
};

}  // namespace

bool looks_like(std::string_view head) {
  constexpr auto classes =
      std::to_array<std::string_view>({"array", "gridpositions", "gridconnections", "regulararray",
                                       "productarray", "field", "series", "group"});
  while (!head.empty()) {
    const std::size_t end = std::min(head.find('\n'), head.size());
    const auto words = bytes::words_of(head.substr(0, end));
    head.remove_prefix(std::min(end + 1, head.size()));
    if (words.empty() || words.front().front() == '#') continue;
    if (lower(words.front()) != "object") return false;
    return std::any_of(words.begin() + 1, words.end(), [&](std::string_view word) {
      return std::find(classes.begin(), classes.end(), lower(word)) != classes.end();
    });
  }
  return false;
}

Result<std::unique_ptr<cf::ArrayFile>> open(const std::shared_ptr<Files>& files,
                                            std::shared_ptr<const InputFile> input) {
  return Opener(files, std::move(input)).open();
}

}  // namespace windsplat::data::dx
