// Reads what lies on faces or corners of cells, and averages it to their centers.
#include "server/data/cf/staggered/collocated_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "server/data/cf/grid/axes.hpp"
#include "server/data/cf/packing.hpp"
#include "server/data/cf/staggered/column_offsets.hpp"
#include "server/data/cf/staggered/models.hpp"
#include "server/data/cf/staggered/shared_levels.hpp"
#include "server/data/cf/staggered/staggering.hpp"
#include "server/data/cf/units.hpp"

namespace windsplat::data::cf {

namespace {

using Counts = std::vector<std::size_t>;

std::size_t product(const Counts& counts) {
  std::size_t values = 1;
  for (const std::size_t n : counts) values *= n;
  return values;
}

// One dimension of a block: centers [start, start + count) between faces [read_start, ...).
struct Span {
  std::size_t start = 0;
  std::size_t count = 0;
  std::size_t read_start = 0;
  std::size_t read_count = 0;
};

Span span_of(const Stagger& stagger, std::size_t start, std::size_t count, std::size_t faces) {
  if (stagger.centers < 0 || stagger.aligned) return {start, count, start, count};
  const auto last = static_cast<std::ptrdiff_t>(faces) - 1;
  const auto low =
      std::clamp<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(start) + stagger.first, 0, last);
  const auto high = std::clamp<std::ptrdiff_t>(
      static_cast<std::ptrdiff_t>(start + count) + stagger.first, 0, last);
  return {start, count, static_cast<std::size_t>(low), static_cast<std::size_t>(high - low + 1)};
}

// upper: weight of b; NaN: masked.
double mean(double a, double b, double upper, bool walls) {
  if (std::isnan(upper)) return upper;
  if (std::isnan(a)) return walls ? upper * b : b;  // NaN if both are masked
  if (std::isnan(b)) return walls ? (1 - upper) * a : a;
  return (1 - upper) * a + upper * b;
}

// Averages a block along one dimension: `outer` times span.read_count times `inner` values.
std::vector<double> averaged(const std::vector<double>& block, const Span& span,
                             const Stagger& stagger, std::size_t outer, std::size_t inner,
                             bool walls) {
  std::vector<double> out(outer * span.count * inner);
  const auto faces = static_cast<std::ptrdiff_t>(span.read_count);
  for (std::size_t o = 0; o < outer; ++o) {
    const double* from = block.data() + o * span.read_count * inner;
    double* to = out.data() + o * span.count * inner;
    for (std::size_t c = 0; c < span.count; ++c) {
      const std::ptrdiff_t low = static_cast<std::ptrdiff_t>(span.start + c) + stagger.first -
                                 static_cast<std::ptrdiff_t>(span.read_start);
      const double* a =
          from + std::clamp<std::ptrdiff_t>(low, 0, faces - 1) * static_cast<std::ptrdiff_t>(inner);
      const double* b = from + std::clamp<std::ptrdiff_t>(low + 1, 0, faces - 1) *
                                   static_cast<std::ptrdiff_t>(inner);
      const double upper = stagger.upper.empty() ? 0.5 : stagger.upper.at(span.start + c);
      for (std::size_t i = 0; i < inner; ++i) to[c * inner + i] = mean(a[i], b[i], upper, walls);
    }
  }
  return out;
}

// Longitudes or latitudes that are repeated for every step.
bool is_position_of_each_step(const FileContents& contents, const std::vector<DimensionRole>& roles,
                              const FileVariable& variable) {
  if (!variable.numeric || variable.dims.size() != 3 || !is_position(variable)) return false;
  const int first = variable.dims[0];
  return roles.at(at(first)).role == Role::time && contents.dimensions.at(at(first)).length > 0;
}

class CollocatedFile final : public ArrayFile {
 public:
  // staggers: by dimension.
  CollocatedFile(std::unique_ptr<ArrayFile> base, const std::vector<Stagger>& staggers,
                 const SharedLevels& levels, const ColumnOffsets& columns)
      : base_(std::move(base)), contents_(base_->contents()) {
    const std::vector<DimensionRole> roles = classify_dimensions(contents_);
    std::string names;
    std::string by_height;
    std::string masked;
    for (FileVariable& variable : contents_.variables) {
      const std::string& beside = columns.unread.at(ways_.size());
      const std::string& unread = beside.empty() ? levels.unread.at(ways_.size()) : beside;
      if (!unread.empty()) {
        variable.unread = unread;
        variable.numeric = false;
        variable.coordinates.clear();
      }
      ways_.push_back(way_of(variable, staggers, levels.staggers.at(ways_.size()),
                             columns.staggers.at(ways_.size())));
      ways_.back().first_step = is_position_of_each_step(contents_, roles, variable);
      const Way& way = ways_.back();
      if (!way.is_changed()) continue;
      if (!way.first_step) {
        if (way.is_averaged()) append(names, variable.name);
        if (way.is_weighted()) append(by_height, variable.name);
        if (way.has_masked_end()) append(masked, variable.name);
        for (std::size_t d = 0; d < variable.dims.size(); ++d) {
          if (way.staggers[d].centers < 0) continue;
          variable.dims[d] = way.staggers[d].centers;
          // The faces between two parts would be read twice.
          if (d + 2 < variable.dims.size()) variable.layers_apart = false;
        }
        variable.coordinates.clear();
      } else {
        variable.dims.erase(variable.dims.begin());
        contents_.notes.push_back(in_quotes(variable.name) +
                                  " is given for every step: that of the first is used");
      }
      variable.type = way.first_step ? "float64" : "float32";
      variable.packed = false;
      variable.is_unsigned = false;
    }
    if (!names.empty()) {
      contents_.notes.push_back("on a staggered grid, averaged to the centers of its cells: " +
                                names);
    }
    if (!by_height.empty()) {
      contents_.notes.push_back("between levels, interpolated by height: " + by_height);
    }
    if (!masked.empty()) {
      contents_.notes.push_back("levels beyond their first or last height are masked: " + masked);
    }
    name_velocities(contents_);
    computed_ = variables_of_wrf(contents_);
    for (const ComputedVariable& one : computed_) contents_.variables.push_back(one.variable);
  }

  [[nodiscard]] const FileContents& contents() const override { return contents_; }
  [[nodiscard]] const std::string& name() const override { return base_->name(); }
  [[nodiscard]] std::string origin() const override { return base_->origin(); }
  [[nodiscard]] std::string format() const override { return base_->format(); }
  [[nodiscard]] std::string identity() const override { return base_->identity(); }

  [[nodiscard]] Numbers numbers(int variable, const char* attribute) const override {
    return is_as_stored(variable) ? base_->numbers(variable, attribute) : Numbers();
  }
  [[nodiscard]] std::string text_of(int variable, const char* attribute) const override {
    return is_computed(variable) ? std::string() : base_->text_of(variable, attribute);
  }
  [[nodiscard]] Counts chunk(int variable) const override {
    if (is_computed(variable)) return chunk(computed(variable).inputs.front());
    Counts chunk = base_->chunk(variable);
    if (ways_[at(variable)].first_step) chunk.erase(chunk.begin());
    return chunk;
  }
  [[nodiscard]] std::size_t chunk_cost_bytes(int variable) const override {
    if (!is_computed(variable)) return base_->chunk_cost_bytes(variable);
    double bytes = 0;
    for (const int input : computed(variable).inputs) bytes += chunk_bytes(*this, input);
    return static_cast<std::size_t>(bytes);
  }
  [[nodiscard]] Unwritten unwritten(int variable, std::size_t most) const override {
    return is_computed(variable) ? Unwritten() : base_->unwritten(variable, most);
  }
  void forget_chunks(int variable) const override {
    if (!is_computed(variable)) return base_->forget_chunks(variable);
    for (const int input : computed(variable).inputs) forget_chunks(input);
  }

  Result<void> read(int variable, const Counts& start, const Counts& count,
                    double* out) const override {
    if (is_as_stored(variable)) return base_->read(variable, start, count, out);
    auto values = is_computed(variable) ? computed_values(variable, start, count)
                                        : values_at_centers(variable, start, count);
    if (!values) return values.error();
    std::copy(values->begin(), values->end(), out);
    return {};
  }
  Result<void> read(int variable, const Counts& start, const Counts& count,
                    float* out) const override {
    if (is_as_stored(variable)) return base_->read(variable, start, count, out);
    std::vector<double> values(product(count));
    if (auto done = read(variable, start, count, values.data()); !done) return done;
    std::transform(values.begin(), values.end(), out,
                   [](double value) { return static_cast<float>(value); });
    return {};
  }

 private:
  // How a variable of the file is read.
  struct Way {
    bool first_step = false;        // its first dimension, time, is left out
    bool walls = false;             // a masked neighbor counts as 0
    std::vector<Stagger> staggers;  // one per dimension; empty if none is staggered
    [[nodiscard]] bool is_changed() const { return first_step || !staggers.empty(); }
    // Not only its dimensions have other names.
    [[nodiscard]] bool is_averaged() const {
      return std::any_of(staggers.begin(), staggers.end(),
                         [](const Stagger& one) { return one.centers >= 0 && !one.aligned; });
    }
    [[nodiscard]] bool is_weighted() const {
      return std::any_of(staggers.begin(), staggers.end(),
                         [](const Stagger& one) { return !one.upper.empty(); });
    }
    [[nodiscard]] bool has_masked_end() const {
      return std::any_of(staggers.begin(), staggers.end(), [](const Stagger& one) {
        return std::any_of(one.upper.begin(), one.upper.end(),
                           [](double weight) { return std::isnan(weight); });
      });
    }
  };

  static void append(std::string& names, const std::string& name) {
    names += (names.empty() ? "" : ", ") + in_quotes(name);
  }

  static Way way_of(const FileVariable& variable, const std::vector<Stagger>& staggers,
                    const Stagger& levels, const std::vector<Stagger>& columns) {
    Way way;
    const std::vector<int>& dims = variable.dims;
    if (!variable.numeric || dims.size() < 2 || is_position(variable)) return way;
    const bool staggered = std::any_of(dims.begin(), dims.end(), [&](int dimension) {
      return staggers.at(at(dimension)).centers >= 0;
    });
    if (!staggered && levels.centers < 0 && columns.empty()) return way;
    for (std::size_t d = 0; d < dims.size(); ++d) {
      const bool is_beside = !columns.empty() && columns[d].centers >= 0;
      way.staggers.push_back(is_beside                   ? columns[d]
                             : dims[d] == levels.centers ? levels
                                                         : staggers.at(at(dims[d])));
    }
    way.walls = is_speed(variable.units);
    return way;
  }

  [[nodiscard]] bool is_computed(int variable) const { return at(variable) >= ways_.size(); }
  [[nodiscard]] bool is_as_stored(int variable) const {
    return !is_computed(variable) && !ways_[at(variable)].is_changed();
  }
  [[nodiscard]] const ComputedVariable& computed(int variable) const {
    return computed_.at(at(variable) - ways_.size());
  }

  // Unpacked values of a block of a variable of the file, in its own dimensions.
  [[nodiscard]] Result<std::vector<double>> stored_values(int variable, const Counts& start,
                                                          const Counts& count) const {
    std::vector<double> values(product(count));
    if (auto done = base_->read(variable, start, count, values.data()); !done) {
      return done.error();
    }
    const Packing packing = packing_of(*base_, variable);
    for (double& value : values) value = unpack_double(packing, value);
    return values;
  }

  [[nodiscard]] Result<std::vector<double>> values_at_centers(int variable, Counts start,
                                                              Counts count) const {
    const Way& way = ways_[at(variable)];
    if (way.first_step) {
      start.insert(start.begin(), 0);
      count.insert(count.begin(), 1);
    }
    if (way.staggers.empty()) return stored_values(variable, start, count);
    const std::vector<int>& dims = base_->contents().variables.at(at(variable)).dims;
    std::vector<Span> spans;
    Counts read_start;
    Counts read_count;
    for (std::size_t d = 0; d < dims.size(); ++d) {
      const std::size_t faces = base_->contents().dimensions.at(at(dims[d])).length;
      spans.push_back(span_of(way.staggers[d], start[d], count[d], faces));
      read_start.push_back(spans.back().read_start);
      read_count.push_back(spans.back().read_count);
    }
    auto values = stored_values(variable, read_start, read_count);
    if (!values) return values.error();
    for (std::size_t d = 0; d < dims.size(); ++d) {
      const Stagger& stagger = way.staggers[d];
      if (stagger.centers < 0 || stagger.aligned) continue;
      const auto cut = read_count.begin() + static_cast<std::ptrdiff_t>(d);
      const std::size_t outer = product(Counts(read_count.begin(), cut));
      const std::size_t inner = product(Counts(cut + 1, read_count.end()));
      *values = averaged(*values, spans[d], stagger, outer, inner, way.walls);
      read_count[d] = count[d];
    }
    return values;
  }

  [[nodiscard]] Result<std::vector<double>> computed_values(int variable, const Counts& start,
                                                            const Counts& count) const {
    const ComputedVariable& rule = computed(variable);
    std::vector<std::vector<double>> inputs;
    for (const int input : rule.inputs) {
      auto values = is_as_stored(input) ? stored_values(input, start, count)
                                        : values_at_centers(input, start, count);
      if (!values) return values.error();
      inputs.push_back(std::move(*values));
    }
    std::vector<double> out(product(count));
    std::vector<double> arguments(inputs.size());
    for (std::size_t n = 0; n < out.size(); ++n) {
      for (std::size_t i = 0; i < inputs.size(); ++i) arguments[i] = inputs[i][n];
      out[n] = rule.value(arguments.data());
    }
    return out;
  }

  std::unique_ptr<ArrayFile> base_;
  FileContents contents_;
  std::vector<Way> ways_;  // parallel to the variables of the file
  std::vector<ComputedVariable> computed_;
};

bool has_positions_of_each_step(const FileContents& contents) {
  const std::vector<DimensionRole> roles = classify_dimensions(contents);
  return std::any_of(contents.variables.begin(), contents.variables.end(),
                     [&](const FileVariable& variable) {
                       return is_position_of_each_step(contents, roles, variable);
                     });
}

}  // namespace

Result<std::unique_ptr<ArrayFile>> collocated(std::unique_ptr<ArrayFile> file) {
  auto staggers = find_staggering(*file);
  if (!staggers) return staggers.error();
  const auto levels = find_shared_levels(*file);
  if (!levels) return levels.error();
  const auto columns = find_column_offsets(*file);
  if (!columns) return columns.error();
  const auto is_staggered = [](const Stagger& one) { return one.centers >= 0; };
  const auto is_told = [](const std::string& reason) { return !reason.empty(); };
  const bool staggered =
      std::any_of(staggers->begin(), staggers->end(), is_staggered) ||
      std::any_of(levels->staggers.begin(), levels->staggers.end(), is_staggered) ||
      std::any_of(levels->unread.begin(), levels->unread.end(), is_told) ||
      std::any_of(columns->unread.begin(), columns->unread.end(), is_told) ||
      std::any_of(columns->staggers.begin(), columns->staggers.end(),
                  [](const std::vector<Stagger>& one) { return !one.empty(); });
  if (!staggered && !has_positions_of_each_step(file->contents())) return file;
  return std::unique_ptr<ArrayFile>(
      std::make_unique<CollocatedFile>(std::move(file), *staggers, *levels, *columns));
}

}  // namespace windsplat::data::cf
