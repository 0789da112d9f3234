// Legacy VTK files ("# vtk DataFile Version"), ASCII or BINARY. Words of the file -> Snapshot;
// values of arrays are skipped, and their locations recorded.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/bytes/text.hpp"
#include "server/data/cf/grid/grid.hpp"
#include "server/data/formats/vtk/legacy_words.hpp"
#include "server/data/formats/vtk/snapshot.hpp"

namespace windsplat::data::vtk {

namespace {

constexpr std::size_t arrays_max = 10'000;

class Reader {
 public:
  explicit Reader(std::shared_ptr<const InputFile> file) : file_(file), scan_(std::move(file)) {}

  Result<Snapshot> read() {
    if (auto done = read_head(); !done) return done.error();
    for (;;) {
      auto word = scan_.word();
      if (!word) return word.error();
      if (word->empty()) break;
      if (auto done = read_section(lower(*word)); !done) return done.error();
    }
    if (!has_dataset_) return file_->fault("has no DATASET");
    out_.pieces.push_back(std::move(piece_));
    if (auto done = check_snapshot(file_, out_, Part::whole); !done) return done.error();
    return std::move(out_);
  }

 private:
  [[nodiscard]] Error fault(const std::string& what) const { return scan_.fault(what); }

  Result<void> read_head() {
    for (int i = 0; i < 2; ++i) {
      auto line = scan_.line();
      if (!line) return line.error();
      if (i == 1) out_.title = *line;
    }
    auto word = scan_.word();
    if (!word) return word.error();
    const std::string form = lower(*word);
    if (form != "ascii" && form != "binary") return fault("neither ASCII nor BINARY");
    binary_ = form == "binary";
    return {};
  }

  Result<std::string> needed_word() {
    auto word = scan_.word();
    if (word && word->empty()) return fault("the file ends too early");
    return word;
  }

  Result<std::uint64_t> count() {
    const auto word = needed_word();
    if (!word) return word.error();
    const auto value = bytes::to_integer(*word);
    if (!value || *value < 0) return fault(in_quotes(*word) + " instead of a count");
    return static_cast<std::uint64_t>(*value);
  }

  template <std::size_t N>
  Result<void> numbers(std::array<double, N>& out) {
    for (double& number : out) {
      const auto word = needed_word();
      if (!word) return word.error();
      const auto value = bytes::to_sample(*word);
      if (!value) return fault(in_quotes(*word) + " instead of a number");
      number = *value;
    }
    return {};
  }

  Result<void> read_section(const std::string& key) {
    if (key == "dataset") return read_dataset();
    if (key == "field") return read_field();
    if (key == "metadata") return read_metadata();
    if (key == "point_data" || key == "cell_data") {
      auto tuples = count();
      if (!tuples) return tuples.error();
      tuples_ = *tuples;
      into_ = key == "point_data" ? &piece_.point_data : &piece_.cell_data;
      return {};
    }
    if (into_ == nullptr) return read_geometry(key);
    return read_attribute(key);
  }

  Result<void> read_dataset() {
    const auto word = needed_word();
    if (!word) return word.error();
    const std::string type = lower(*word);
    if (has_dataset_) return fault("a second DATASET");
    has_dataset_ = true;
    if (type == "structured_points") {
      out_.kind = Kind::image;
      out_.format = "VTK image data, legacy";
    } else if (type == "rectilinear_grid") {
      out_.kind = Kind::rectilinear;
      out_.format = "VTK rectilinear grid, legacy";
      piece_.coordinates.resize(3);
    } else if (type == "structured_grid") {
      out_.kind = Kind::structured;
      out_.format = "VTK structured grid, legacy";
    } else if (type == "unstructured_grid") {
      out_.kind = Kind::unstructured;
      out_.format = "VTK unstructured grid, legacy";
    } else {
      return file_->fault(
          "holds VTK data of the type " + in_quotes(*word) +
          "; supported types: STRUCTURED_POINTS, RECTILINEAR_GRID, STRUCTURED_GRID and "
          "UNSTRUCTURED_GRID");
    }
    return {};
  }

  Result<void> read_geometry(const std::string& key) {
    if (key == "dimensions") {
      for (std::size_t a = 0; a < 3; ++a) {
        auto n = count();
        if (!n) return n.error();
        if (*n < 1 || *n > cf::samples_max) return fault("a dimension that is 0 or too large");
        out_.whole.last[a] = static_cast<std::int64_t>(*n) - 1;
      }
      piece_.extent = out_.whole;
      return {};
    }
    if (key == "origin") return numbers(out_.place.origin);
    if (key == "spacing" || key == "aspect_ratio") return numbers(out_.place.spacing);
    if (key == "points") return read_points();
    if (key == "x_coordinates") return read_coordinates(0);
    if (key == "y_coordinates") return read_coordinates(1);
    if (key == "z_coordinates") return read_coordinates(2);
    if (key == "cells") return read_cells();
    if (key == "cell_types") return read_cell_types();
    return fault(in_quotes(key) + " instead of a section");
  }

  // Skips the values after the line and records their location.
  Result<void> take(StoredArray& array, bool known_bits = false, std::uint64_t value_bits = 0) {
    array.coding = {.big_endian = true, .has_header = false};
    array.encoding = binary_ ? Encoding::raw : Encoding::text;
    if (array.tuples > cf::samples_max * 16 || array.components > 1024) {
      return fault("an array that is too large");
    }
    const std::uint64_t values = array.values();
    if (!known_bits) value_bits = 8 * bytes::size_of(array.type);
    array.offset = scan_.at();
    auto done =
        binary_ ? scan_.skip_bytes((values * value_bits + 7) / 8) : scan_.skip_words(values);
    array.room = scan_.at() - array.offset;
    return done;
  }

  // Reads the values after a line. type: its name in the file.
  Result<bool> take_typed(StoredArray& array, const std::string& type) {
    const auto known = type_named(lower(type));
    if (known) {
      array.type = *known;
      if (auto done = take(array); !done) return done.error();
      return true;
    }
    if (lower(type) != "bit") {
      return file_->fault("has the array " + in_quotes(array.name) + " of the type " +
                          in_quotes(type) + ", which is not supported");
    }
    if (auto done = take(array, true, 1); !done) return done.error();
    out_.left_out.push_back({array.name, "its type bit is not supported"});
    return false;
  }

  // The same for a type at the end of the line, where bit is not allowed.
  Result<void> take_numbers(StoredArray& array, std::string what) {
    const auto type = scan_.line();
    if (!type) return type.error();
    const auto taken = take_typed(array, *type);
    if (!taken) return taken.error();
    if (!*taken) return fault(what += " of the type bit");
    return {};
  }

  Result<void> read_points() {
    StoredArray array;
    array.name = "points";
    array.components = 3;
    const auto n = count();
    if (!n) return n.error();
    array.tuples = *n;
    if (auto done = take_numbers(array, "points"); !done) return done;
    if (out_.kind == Kind::unstructured) piece_.points = *n;
    piece_.coordinates = {std::move(array)};
    return {};
  }

  Result<void> read_coordinates(std::size_t axis) {
    if (out_.kind != Kind::rectilinear) return fault("coordinates of a grid without coordinates");
    StoredArray array;
    array.name = std::string(1, static_cast<char>('x' + axis)) + " coordinates";
    const auto n = count();
    if (!n) return n.error();
    array.tuples = *n;
    if (auto done = take_numbers(array, "coordinates"); !done) return done;
    piece_.coordinates.at(axis) = std::move(array);
    return {};
  }

  // Before version 5: numbers of cells and entries, then count and indices of each cell. Since: the
  // number of cells plus one and of indices, then OFFSETS and CONNECTIVITY.
  Result<void> read_cells() {
    const auto first = count();
    if (!first) return first.error();
    const auto second = count();
    if (!second) return second.error();
    if (auto rest = scan_.line(); !rest) return rest.error();
    const std::uint64_t place = scan_.at();
    const auto word = scan_.word();
    if (word && lower(*word) == "offsets") return read_split_cells(*first, *second);
    scan_.back_to(place);
    StoredArray array;
    array.name = "cells";
    array.type = bytes::Scalar::int32;
    array.tuples = *second;
    if (auto done = take(array); !done) return done;
    piece_.cells = *first;
    piece_.counts_inside = true;
    piece_.connectivity = std::move(array);
    return {};
  }

  Result<void> read_split_cells(std::uint64_t offsets, std::uint64_t indices) {
    if (offsets < 1) return fault("cells without offsets");
    for (const bool is_first : {true, false}) {
      if (!is_first) {
        const auto word = needed_word();
        if (!word) return word.error();
        if (lower(*word) != "connectivity") return fault("no CONNECTIVITY after OFFSETS");
      }
      StoredArray array;
      array.name = is_first ? "offsets" : "connectivity";
      array.tuples = is_first ? offsets : indices;
      if (auto done = take_numbers(array, "cells"); !done) return done;
      (is_first ? piece_.offsets : piece_.connectivity) = std::move(array);
    }
    piece_.cells = offsets - 1;
    piece_.offsets_from_zero = true;
    return {};
  }

  Result<void> read_cell_types() {
    const auto n = count();
    if (!n) return n.error();
    if (auto rest = scan_.line(); !rest) return rest.error();
    StoredArray array;
    array.name = "cell types";
    array.type = bytes::Scalar::int32;
    array.tuples = *n;
    if (auto done = take(array); !done) return done;
    piece_.types = std::move(array);
    return {};
  }

  // Reads an attribute of POINT_DATA or CELL_DATA.
  Result<void> read_attribute(const std::string& key) {
    const auto line = scan_.line();
    if (!line) return line.error();
    std::vector<std::string> words;
    std::string_view rest = *line;
    while (!(rest = trim(rest)).empty() && words.size() < 4) {
      const std::size_t end = std::min(rest.find_first_of(" \t"), rest.size());
      words.emplace_back(rest.substr(0, end));
      rest.remove_prefix(end);
    }
    if (words.empty()) return fault("a section " + in_quotes(key) + " without a name");
    StoredArray array;
    array.name = decoded(words[0]);
    array.tuples = tuples_;
    if (key == "lookup_table") return skip_table(words);
    if (key == "color_scalars") return read_colors(std::move(array), words);
    if (words.size() < 2) return fault("a section " + in_quotes(key) + " without a type");
    std::string type = words[1];
    if (key == "scalars") {
      if (words.size() > 2) array.components = small(words[2]);
      if (auto done = skip_table_name(); !done) return done;
    } else if (key == "texture_coordinates") {
      if (words.size() < 3) return fault("texture coordinates without a type");
      array.components = small(words[1]);
      type = words[2];
    } else if (key == "vectors" || key == "normals") {
      array.components = 3;
    } else if (key == "tensors" || key == "tensors6") {
      array.components = key == "tensors" ? 9 : 6;
    } else if (key != "global_ids" && key != "pedigree_ids") {
      return fault(in_quotes(key) + " instead of a section");
    }
    if (array.components < 1) return fault("a number of components outside 1 to 9");
    const auto taken = take_typed(array, type);
    if (!taken) return taken.error();
    if (*taken) return add(*into_, std::move(array));
    return {};
  }

  static int small(const std::string& word) {
    const auto value = bytes::to_integer(word);
    return value && *value >= 1 && *value <= 9 ? static_cast<int>(*value) : 0;
  }

  Result<void> add(std::vector<StoredArray>& to, StoredArray array) {
    if (to.size() >= arrays_max) return fault("more than 10000 arrays");
    to.push_back(std::move(array));
    return {};
  }

  Result<void> skip_table_name() {
    const std::uint64_t place = scan_.at();
    const auto word = scan_.word();
    if (!word) return word.error();
    if (lower(*word) != "lookup_table") {
      scan_.back_to(place);
      return {};
    }
    const auto rest = scan_.line();
    return rest ? Result<void>() : rest.error();
  }

  // Colours of a look-up table: 4 bytes each, or 4 words.
  Result<void> skip_table(const std::vector<std::string>& words) {
    StoredArray array;
    const auto n = words.size() > 1 ? bytes::to_integer(words[1]) : std::nullopt;
    if (!n || *n < 0) return fault("a look-up table without its size");
    array.tuples = static_cast<std::uint64_t>(*n);
    array.components = 4;
    array.type = bytes::Scalar::uint8;
    return take(array);
  }

  Result<void> read_colors(StoredArray array, const std::vector<std::string>& words) {
    array.components = words.size() > 1 ? small(words[1]) : 0;
    if (array.components < 1) return fault("colours without their number of components");
    array.type = binary_ ? bytes::Scalar::uint8 : bytes::Scalar::float32;
    if (auto done = take(array); !done) return done;
    return add(*into_, std::move(array));
  }

  // FIELD name n, then n times: name components tuples type.
  Result<void> read_field() {
    if (auto name = needed_word(); !name) return name.error();
    const auto n = count();
    if (!n) return n.error();
    for (std::uint64_t i = 0; i < *n; ++i) {
      StoredArray array;
      auto name = needed_word();
      if (name && lower(*name) == "metadata") {
        if (auto done = read_metadata(); !done) return done;
        name = needed_word();
      }
      if (!name) return name.error();
      if (*name == "NULL_ARRAY") continue;
      array.name = decoded(*name);
      const auto components = count();
      if (!components) return components.error();
      const auto tuples = count();
      if (!tuples) return tuples.error();
      const auto type = scan_.line();
      if (!type) return type.error();
      if (*components < 1 || *components > 1024) return fault("a number of components over 1024");
      array.components = static_cast<int>(*components);
      array.tuples = *tuples;
      const auto taken = take_typed(array, *type);
      if (!taken) return taken.error();
      if (!*taken) continue;
      if (auto done = into_ == nullptr ? take_time(array) : add(*into_, std::move(array)); !done) {
        return done;
      }
    }
    return {};
  }

  // The field data of the file are used for the time only.
  Result<void> take_time(const StoredArray& array) {
    const std::string name = lower(array.name);
    if ((name != "time" && name != "timevalue") || array.values() != 1) return {};
    const auto values = read_all(file_, array);
    if (!values) return values.error();
    if (std::isfinite(values->front())) out_.time = values->front();
    return {};
  }

  // Reads lines up to an empty one; COMPONENT_NAMES refers to the previous array.
  Result<void> read_metadata() {
    if (auto rest = scan_.line(); !rest) return rest.error();
    StoredArray* last = into_ == nullptr || into_->empty() ? nullptr : &into_->back();
    bool naming = false;
    while (!scan_.ended()) {
      const auto line = scan_.line();
      if (!line) return line.error();
      if (line->empty()) break;
      const std::string key = lower(*line);
      if (key == "component_names") {
        naming = last != nullptr;
        continue;
      }
      naming = naming && !key.starts_with("information") &&
               last->component_names.size() < static_cast<std::size_t>(last->components);
      if (naming) last->component_names.push_back(decoded(*line));
    }
    if (last != nullptr &&
        last->component_names.size() != static_cast<std::size_t>(last->components)) {
      last->component_names.clear();
    }
    return {};
  }

  std::shared_ptr<const InputFile> file_;
  Scanner scan_;
  Snapshot out_;
  Piece piece_;
  bool binary_ = false;
  bool has_dataset_ = false;
  std::vector<StoredArray>* into_ = nullptr;  // null before POINT_DATA and CELL_DATA
  std::uint64_t tuples_ = 0;
};

}  // namespace

bool is_legacy(std::string_view head) { return head.starts_with("# vtk DataFile Version"); }

Result<Snapshot> read_legacy(const std::shared_ptr<const InputFile>& file) {
  return Reader(file).read();
}

}  // namespace windsplat::data::vtk
