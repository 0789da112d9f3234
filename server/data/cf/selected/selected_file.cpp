// Finds the entries to show, and reads their blocks.
#include "server/data/cf/selected/selected_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "server/data/cf/coordinates.hpp"
#include "server/data/cf/selected/extra_dimensions.hpp"
#include "server/data/cf/selected/lead_times.hpp"
#include "server/data/cf/time.hpp"

namespace windsplat::data::cf {

namespace {

using Counts = std::vector<std::size_t>;

// The entries of a dimension as users name them: values of its coordinate, or indices.
class Entries {
 public:
  static Result<Entries> of(const ArrayFile& file, int dimension, int coordinate) {
    Entries out;
    out.length_ = file.contents().dimensions.at(at(dimension)).length;
    if (coordinate < 0) return out;
    out.variable_ = &file.contents().variables.at(at(coordinate));
    auto values = unpacked_values(file, coordinate);
    if (!values) return values.error();
    out.values_ = std::move(*values);
    return out;
  }

  [[nodiscard]] std::size_t length() const { return length_; }
  [[nodiscard]] std::string text(std::size_t index) const {
    if (variable_ == nullptr) return std::to_string(index);
    const double value = values_.at(index);
    if (counts_from_a_time(variable_->units) && std::isfinite(value)) {
      return decode_time({value}, variable_->units, variable_->calendar).steps.front().text;
    }
    const auto narrow = static_cast<float>(value);
    if (variable_->type != "float32" || static_cast<double>(narrow) != value) {
      return number_text(value);
    }
    std::array<char, 32> digits{};  // 0.1, not 0.10000000149011612
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), narrow);
    return {digits.data(), end.ptr};
  }
  [[nodiscard]] std::optional<std::size_t> find(const std::string& wanted) const {
    double number = 0;
    const char* end = wanted.data() + wanted.size();
    const auto [stop, fault] = std::from_chars(wanted.data(), end, number);
    const bool numeric = fault == std::errc() && stop == end;
    const bool by_text =
        !numeric || (variable_ != nullptr && !counts_from_a_time(variable_->units));
    constexpr auto narrow_max = static_cast<double>(std::numeric_limits<float>::max());
    const bool is_narrow =
        variable_ != nullptr && variable_->type == "float32" && std::abs(number) <= narrow_max;
    const auto equals = [&](double value) {
      return value == number ||
             (is_narrow && static_cast<float>(value) == static_cast<float>(number));
    };
    for (std::size_t i = 0; i < values_.size(); ++i) {
      if ((numeric && equals(values_[i])) || (by_text && text(i) == wanted)) return i;
    }
    const bool by_index =
        variable_ == nullptr && numeric && number >= 0 && number < static_cast<double>(length_);
    const auto index = by_index ? static_cast<std::size_t>(number) : 0;
    if (by_index && static_cast<double>(index) == number) return index;
    return std::nullopt;
  }
  // "10 entries (0 .. 9)".
  [[nodiscard]] std::string range() const {
    return std::to_string(length_) + (length_ == 1 ? " entry (" : " entries (") + text(0) +
           (length_ == 1 ? "" : " .. " + text(length_ - 1)) + ')';
  }
  [[nodiscard]] DimensionChoice choice(const std::string& name, std::size_t index) const {
    DimensionChoice out{name, length_, {}, text(index)};
    out.values.reserve(std::min(length_, choice_values_max));
    for (std::size_t i = 0; i < std::min(length_, choice_values_max); ++i) {
      out.values.push_back(text(i));
    }
    return out;
  }

 private:
  std::size_t length_ = 0;
  const FileVariable* variable_ = nullptr;  // the coordinate; null: entries are numbered from 0
  std::vector<double> values_;
};

// Prefers the grid of a variable; false if the file does not have it.
bool prefer(FileContents& contents, const std::string& name) {
  const int v = variable_named(contents, name);
  if (v < 0) return false;
  contents.variables[at(v)].preferred = true;
  contents.choices.push_back({field_choice, 1, {name}, name});
  return true;
}

class SelectedFile final : public ArrayFile {
 public:
  explicit SelectedFile(std::unique_ptr<ArrayFile> base)
      : base_(std::move(base)),
        contents_(base_->contents()),
        roles_(classify_dimensions(contents_)),
        entry_(contents_.dimensions.size()) {
    if (const auto bytes = base_->stored_bytes()) set_stored_bytes(*bytes);
  }

  Result<void> choose(const Selection& selection) {
    contents_.has_selection = !selection.empty();
    Selection found;
    for (const SelectedEntry& one : selection) {
      const int d = dimension_named(contents_, one.dimension);
      if (d < 0 && one.dimension == field_choice && prefer(contents_, one.value))
        found.push_back(one);
      if (d < 0) continue;
      if (auto fixed = fix(d, &one.value); !fixed) return fixed;
      found.push_back(one);
    }
    std::vector<bool> fixed;
    fixed.reserve(entry_.size());
    for (const auto& entry : entry_) fixed.push_back(entry.has_value());
    const ExtraDimensions extra = find_extra_dimensions(contents_, fixed);
    for (const int d : extra.chosen) {
      if (contents_.choices.size() >= choices_max) break;
      if (auto done = fix(d, nullptr); !done) return done;
    }
    for (FileVariable& variable : contents_.variables) {
      for (const int d : variable.dims) {
        const DimensionRole& role = roles_[at(d)];
        if (!entry_[at(d)] || role.role != Role::z || role.coordinate < 0) continue;
        variable.level = contents_.variables[at(role.coordinate)].name;
      }
      std::erase_if(variable.dims, [&](int d) { return entry_[at(d)].has_value(); });
    }
    for (const int d : extra.times) make_time(d);
    if (!found.empty()) {
      const std::string stem = std::filesystem::path(base_->name()).stem().native();
      contents_.title =
          (contents_.title.empty() ? stem : contents_.title) + " (" + selection_text(found) + ')';
    }
    return {};
  }

  [[nodiscard]] bool is_changed() const {
    return !contents_.choices.empty() ||
           std::any_of(contents_.dimensions.begin(), contents_.dimensions.end(),
                       [](const FileDimension& d) { return d.is_time; });
  }
  std::unique_ptr<ArrayFile> give_base() { return std::move(base_); }

  [[nodiscard]] const FileContents& contents() const override { return contents_; }
  [[nodiscard]] const std::string& name() const override { return base_->name(); }
  [[nodiscard]] std::string origin() const override { return base_->origin(); }
  [[nodiscard]] std::string format() const override { return base_->format(); }
  [[nodiscard]] std::string identity() const override {
    std::string out = base_->identity();
    for (const DimensionChoice& one : contents_.choices) out += '\n' + one.name + '=' + one.chosen;
    return out;
  }
  [[nodiscard]] Numbers numbers(int variable, const char* attribute) const override {
    return base_->numbers(variable, attribute);
  }
  [[nodiscard]] std::string text_of(int variable, const char* attribute) const override {
    return base_->text_of(variable, attribute);
  }
  [[nodiscard]] Counts chunk(int variable) const override {
    const Counts stored = base_->chunk(variable);
    const std::vector<int>& dims = stored_dims(variable);
    Counts out;
    for (std::size_t i = 0; i < dims.size(); ++i) {
      if (!entry_[at(dims[i])]) out.push_back(stored[i]);
    }
    return out;
  }
  // A chunk may contain other entries, too.
  [[nodiscard]] std::size_t chunk_cost_bytes(int variable) const override {
    const std::size_t cost = base_->chunk_cost_bytes(variable);
    if (stored_dims(variable).size() == contents_.variables.at(at(variable)).dims.size()) {
      return cost;
    }
    constexpr double most = 0x1p62;
    return std::max(cost, static_cast<std::size_t>(std::min(chunk_bytes(*base_, variable), most)));
  }
  [[nodiscard]] Unwritten unwritten(int variable, std::size_t most) const override {
    return base_->unwritten(variable, most);
  }
  void forget_chunks(int variable) const override { base_->forget_chunks(variable); }

  Result<void> read(int variable, const Counts& start, const Counts& count,
                    double* out) const override {
    return base_->read(variable, with_entries(variable, start), with_ones(variable, count), out);
  }
  Result<void> read(int variable, const Counts& start, const Counts& count,
                    float* out) const override {
    return base_->read(variable, with_entries(variable, start), with_ones(variable, count), out);
  }

 private:
  [[nodiscard]] const std::vector<int>& stored_dims(int variable) const {
    return base_->contents().variables.at(at(variable)).dims;
  }

  [[nodiscard]] Counts with_entries(int variable, const Counts& start) const {
    Counts out;
    auto next = start.begin();
    for (const int d : stored_dims(variable))
      out.push_back(entry_[at(d)] ? *entry_[at(d)] : *next++);
    return out;
  }
  [[nodiscard]] Counts with_ones(int variable, const Counts& count) const {
    Counts out;
    auto next = count.begin();
    for (const int d : stored_dims(variable)) out.push_back(entry_[at(d)] ? 1 : *next++);
    return out;
  }

  // Fixes a dimension at an entry; value null: the first, with a note.
  Result<void> fix(int d, const std::string* value) {
    const std::string& name = contents_.dimensions[at(d)].name;
    if (contents_.dimensions[at(d)].length == 0) {
      return make_error(ErrorKind::not_found, "the dimension " + in_quotes(name) + " has no entry");
    }
    auto entries = Entries::of(*base_, d, roles_[at(d)].coordinate);
    if (!entries) return entries.error();
    const auto index = value == nullptr ? std::optional<std::size_t>(0) : entries->find(*value);
    if (!index) {
      return make_error(ErrorKind::not_found, "the dimension " + in_quotes(name) +
                                                  " has no entry " + in_quotes(*value) +
                                                  ": it has " + entries->range());
    }
    entry_[at(d)] = *index;
    if (const int named = roles_[at(d)].coordinate; named >= 0) {
      contents_.variables[at(named)].in_use = true;
    }
    contents_.choices.push_back(entries->choice(name, *index));
    if (value == nullptr) {
      contents_.notes.push_back(in_quotes(name) + " has " + entries->range() +
                                ": the first is shown; choose another by appending " +
                                (contents_.has_selection ? '&' : '?') + printable(name) +
                                "=VALUE to the file's name");
    }
    return {};
  }

  // Lead or reference times become the time axis; called when the chosen dimensions are removed.
  void make_time(int d) {
    FileDimension& dimension = contents_.dimensions[at(d)];
    dimension.is_time = true;
    if (!is_lead_time(contents_, roles_, d)) return;
    const int own = roles_[at(d)].coordinate;
    if (own >= 0 && counts_from_a_time(contents_.variables[at(own)].units)) return;
    const auto valid = std::find_if(
        contents_.variables.begin(), contents_.variables.end(), [&](const FileVariable& variable) {
          return variable.numeric && variable.dims == std::vector<int>{d} &&
                 (variable.standard_name.empty() || variable.standard_name == "time") &&
                 counts_from_a_time(variable.units) &&
                 dimension_named(contents_, variable.name) < 0;
        });
    if (valid == contents_.variables.end()) {
      contents_.notes.push_back(lead_time_note(dimension.name));
      return;
    }
    contents_.notes.push_back("time steps are the valid times " + in_quotes(valid->name) +
                              " of the lead times " + in_quotes(dimension.name));
    if (own >= 0) contents_.variables[at(own)].in_use = true;
    dimension.name = valid->name;  // which makes them its coordinate
  }

  std::unique_ptr<ArrayFile> base_;
  FileContents contents_;
  std::vector<DimensionRole> roles_;
  std::vector<std::optional<std::size_t>> entry_;  // per dimension: the only entry that is read
};

}  // namespace

Result<std::unique_ptr<ArrayFile>> selected(std::unique_ptr<ArrayFile> file,
                                            const Selection& selection) {
  auto out = std::make_unique<SelectedFile>(std::move(file));
  if (auto done = out->choose(selection); !done) return done.error();
  if (!out->is_changed()) return with_valid_times(out->give_base());
  return with_valid_times(std::move(out));
}

Result<void> check_selection(const FileContents& contents, const Selection& selection) {
  for (const SelectedEntry& one : selection) {
    const bool found =
        std::any_of(contents.choices.begin(), contents.choices.end(),
                    [&](const DimensionChoice& choice) { return choice.name == one.dimension; });
    if (found) continue;
    constexpr std::size_t listed_max = 20;
    if (one.dimension == field_choice && dimension_named(contents, field_choice) < 0) {
      return make_error(ErrorKind::not_found, "there is no field " + in_quotes(one.value));
    }
    std::string text = "there is no dimension " + in_quotes(one.dimension) + ": there are";
    for (std::size_t d = 0; d < std::min(contents.dimensions.size(), listed_max); ++d) {
      text += (d == 0 ? " " : ", ") + in_quotes(contents.dimensions[d].name) + " (" +
              std::to_string(contents.dimensions[d].length) + ')';
    }
    if (contents.dimensions.size() > listed_max) text += ", ...";
    return make_error(ErrorKind::not_found, text);
  }
  return {};
}

std::string differing_entry(const FileContents& first, const FileContents& other) {
  for (const DimensionChoice& own : first.choices) {
    const int coordinate = variable_named(other, own.name);
    if (coordinate >= 0 && counts_from_a_time(other.variables[at(coordinate)].units)) continue;
    for (const DimensionChoice& one : other.choices) {
      if (one.name != own.name || one.chosen == own.chosen) continue;
      return "its first " + in_quotes(own.name) + " is " + printable(one.chosen) + ", not " +
             printable(own.chosen) + "; choose one by appending ?" + printable(own.name) + "=VALUE";
    }
  }
  return {};
}

}  // namespace windsplat::data::cf
