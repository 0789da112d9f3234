#include "server/data/cf/selected/lead_times.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "server/data/cf/coordinates.hpp"
#include "server/data/cf/grid/axes.hpp"
#include "server/data/cf/selected/extra_dimensions.hpp"
#include "server/data/cf/time.hpp"

namespace windsplat::data::cf {

namespace {

struct ForecastTimes {
  int dimension = -1;  // of the lead times; -1: a single one without a dimension
  int lead = -1;       // variables
  std::vector<int> references;
};

bool is_single(const FileContents& contents, const FileVariable& variable) {
  return variable.numeric && std::all_of(variable.dims.begin(), variable.dims.end(), [&](int d) {
           return contents.dimensions.at(at(d)).length == 1;
         });
}

// The variables with a single value and that standard name.
std::vector<int> singles_named(const FileContents& contents, std::string_view standard_name,
                               bool counts) {
  std::vector<int> out;
  for (std::size_t v = 0; v < contents.variables.size(); ++v) {
    const FileVariable& variable = contents.variables[v];
    if (variable.standard_name == standard_name && is_single(contents, variable) &&
        counts_from_a_time(variable.units) == counts) {
      out.push_back(static_cast<int>(v));
    }
  }
  return out;
}

// Whether the file gives its times itself.
bool has_times(const FileContents& contents, const std::vector<DimensionRole>& roles) {
  return std::any_of(roles.begin(), roles.end(),
                     [](const DimensionRole& role) { return role.role == Role::time; }) ||
         std::any_of(contents.variables.begin(), contents.variables.end(),
                     [](const FileVariable& variable) {
                       return variable.standard_name == "time" || variable.name == "time";
                     });
}

// The lead times and the only reference time of a file, as far as it has them.
std::optional<ForecastTimes> times_of(const FileContents& contents) {
  const std::vector<DimensionRole> roles = classify_dimensions(contents);
  const bool timeless = !has_times(contents, roles);
  ForecastTimes out;
  out.references = singles_named(contents, "forecast_reference_time", true);
  if (out.references.empty()) return std::nullopt;
  for (std::size_t d = 0; d < roles.size(); ++d) {
    const int own = roles[d].coordinate;
    const FileDimension& dimension = contents.dimensions[d];
    const bool is_time =
        dimension.is_time || roles[d].role == Role::time || (dimension.length == 1 && timeless);
    if (is_time && own >= 0 && !counts_from_a_time(contents.variables[at(own)].units) &&
        is_lead_time(contents, roles, static_cast<int>(d))) {
      out.dimension = static_cast<int>(d);
      out.lead = own;
    }
  }
  if (out.lead < 0 && timeless) {
    const std::vector<int> leads = singles_named(contents, "forecast_period", false);
    if (!leads.empty()) out.lead = leads.front();
  }
  return out.lead < 0 ? std::nullopt : std::optional(out);
}

// A file with other contents: a variable of known values, the last one, unless it has no values.
class TimedFile final : public ArrayFile {
 public:
  TimedFile(std::unique_ptr<ArrayFile> base, FileContents contents, std::vector<double> times)
      : base_(std::move(base)), contents_(std::move(contents)), times_(std::move(times)) {
    if (const auto bytes = base_->stored_bytes()) set_stored_bytes(*bytes);
  }

  [[nodiscard]] const FileContents& contents() const override { return contents_; }
  [[nodiscard]] const std::string& name() const override { return base_->name(); }
  [[nodiscard]] std::string origin() const override { return base_->origin(); }
  [[nodiscard]] std::string format() const override { return base_->format(); }
  [[nodiscard]] std::string identity() const override { return base_->identity(); }
  [[nodiscard]] Numbers numbers(int variable, const char* attribute) const override {
    return is_own(variable) ? Numbers() : base_->numbers(variable, attribute);
  }
  [[nodiscard]] std::string text_of(int variable, const char* attribute) const override {
    return is_own(variable) ? std::string() : base_->text_of(variable, attribute);
  }
  [[nodiscard]] std::vector<std::size_t> chunk(int variable) const override {
    if (!is_own(variable)) return base_->chunk(variable);
    return std::vector<std::size_t>(contents_.variables.back().dims.size(), times_.size());
  }
  [[nodiscard]] std::size_t chunk_cost_bytes(int variable) const override {
    return is_own(variable) ? 0 : base_->chunk_cost_bytes(variable);
  }
  [[nodiscard]] Unwritten unwritten(int variable, std::size_t most) const override {
    return is_own(variable) ? Unwritten() : base_->unwritten(variable, most);
  }
  void forget_chunks(int variable) const override {
    if (!is_own(variable)) base_->forget_chunks(variable);
  }
  Result<void> read(int variable, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count, double* out) const override {
    if (!is_own(variable)) return base_->read(variable, start, count, out);
    const std::size_t first = start.empty() ? 0 : start.front();
    const std::size_t values = count.empty() ? 1 : count.front();
    std::copy_n(times_.begin() + static_cast<std::ptrdiff_t>(first), values, out);
    return {};
  }
  Result<void> read(int variable, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count, float* out) const override {
    return base_->read(variable, start, count, out);  // the own variable is float64
  }

 private:
  [[nodiscard]] bool is_own(int variable) const {
    return !times_.empty() && at(variable) + 1 == contents_.variables.size();
  }

  std::unique_ptr<ArrayFile> base_;
  FileContents contents_;
  std::vector<double> times_;
};

// The dates of reference times, in their order; without those from the first that is none.
Result<std::vector<std::string>> dates_of(const ArrayFile& file,
                                          const std::vector<int>& variables) {
  std::vector<std::string> out;
  for (const int v : variables) {
    const FileVariable& one = file.contents().variables[at(v)];
    const auto values = unpacked_values(file, v);
    if (!values) return values.error();
    const auto decoded = decode_time(*values, one.units, one.calendar);
    if (!decoded.reason.empty()) break;
    out.push_back(decoded.steps.front().text);
  }
  return out;
}

}  // namespace

std::string lead_time_note(const std::string& dimension) {
  return "time steps are the lead times " + in_quotes(dimension);
}

Result<std::unique_ptr<ArrayFile>> with_valid_times(std::unique_ptr<ArrayFile> file) {
  const auto found = times_of(file->contents());
  if (!found) return file;
  FileContents contents = file->contents();
  FileVariable& lead = contents.variables[at(found->lead)];
  FileVariable& reference = contents.variables[at(found->references.front())];
  const auto leads = unpacked_values(*file, found->lead);
  if (!leads) return leads.error();
  const auto dates = dates_of(*file, found->references);
  if (!dates) return dates.error();
  const auto without_dates = [&](const std::string& why) {
    contents.notes.push_back("lead times are not shown as dates: " + why);
    return std::unique_ptr<ArrayFile>(
        std::make_unique<TimedFile>(std::move(file), std::move(contents), std::vector<double>()));
  };
  if (dates->size() < found->references.size()) {
    const int missing = found->references[dates->size()];
    return without_dates("the reference time " + in_quotes(contents.variables[at(missing)].name) +
                         " is missing or no date");
  }
  const std::string& date = dates->front();
  for (std::size_t n = 1; n < dates->size(); ++n) {
    if ((*dates)[n] == date) continue;
    return without_dates(
        "there are two reference times, " + in_quotes(reference.name) + " (" + date + ") and " +
        in_quotes(contents.variables[at(found->references[n])].name) + " (" + (*dates)[n] + ')');
  }
  auto times = convert_times(*leads, {lead.units + " since " + date, reference.calendar},
                             {reference.units, reference.calendar});
  if (!times) return file;
  const std::string note = lead_time_note(
      found->dimension < 0 ? lead.name : contents.dimensions[at(found->dimension)].name);
  std::erase(contents.notes, note);
  contents.notes.push_back(note + " after the reference time " + date);
  FileVariable valid;
  valid.name = "valid_time";
  while (variable_named(contents, valid.name) >= 0 || dimension_named(contents, valid.name) >= 0) {
    valid.name += '_';
  }
  valid.type = "float64";
  valid.numeric = true;
  valid.in_use = true;
  valid.standard_name = "time";
  valid.units = reference.units;
  valid.calendar = reference.calendar;
  lead.in_use = true;
  reference.in_use = true;
  if (found->dimension >= 0) {
    FileDimension& dimension = contents.dimensions[at(found->dimension)];
    valid.dims = {found->dimension};
    dimension.is_time = true;
    dimension.name = valid.name;  // which makes them its coordinate
  }
  contents.variables.push_back(std::move(valid));
  return std::unique_ptr<ArrayFile>(
      std::make_unique<TimedFile>(std::move(file), std::move(contents), std::move(*times)));
}

}  // namespace windsplat::data::cf
