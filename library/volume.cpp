// Samples, arrays and files -> data::Dataset.
#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <set>
#include <utility>

#include "library/state.hpp"
#include "server/data/derived/source.hpp"
#include "server/data/files/files.hpp"
#include "server/data/loader/loader.hpp"
#include "server/data/model/axis_check.hpp"
#include "server/data/model/source.hpp"
#include "server/data/resident/budget.hpp"
#include "server/data/samples/samples.hpp"

namespace windsplat {
namespace {

// The limit of the file readers on samples of a volume.
constexpr std::size_t samples_max = std::size_t{1} << 31U;

// Arrays of the caller, which it has handed over.
class HeldSource : public data::Source {
 public:
  HeldSource(data::DatasetInfo info, std::vector<Field> fields)
      : info_(std::move(info)), fields_(std::move(fields)) {}
  [[nodiscard]] const data::DatasetInfo& info() const override { return info_; }
  Result<data::Volume> read(std::size_t field, std::size_t step) override {
    const auto& components = fields_[field].components;
    data::Volume volume;
    volume.dims = info_.grid.dims();
    volume.components = static_cast<int>(components.size());
    const std::size_t samples = volume.samples();
    volume.values = data::Samples(samples * components.size());
    float* out = volume.values.data();
    for (const std::vector<float>& values : components) {
      const float* const from = values.data() + step * samples;
      out = std::copy(from, from + samples, out);
    }
    data::finish_volume(volume);
    return volume;
  }

 private:
  data::DatasetInfo info_;
  std::vector<Field> fields_;
};

[[noreturn]] void refuse(const std::string& message) {
  throw Problem(Problem::Kind::invalid, message);
}

data::AxisKind kind_of(AxisKind kind) {
  switch (kind) {
    case AxisKind::longitude:
      return data::AxisKind::longitude;
    case AxisKind::latitude:
      return data::AxisKind::latitude;
    case AxisKind::height:
      return data::AxisKind::height;
    case AxisKind::depth:
      return data::AxisKind::depth;
    case AxisKind::pressure:
      return data::AxisKind::pressure;
    case AxisKind::cartesian:
      break;
  }
  return data::AxisKind::cartesian;
}

data::Axis axis_of(Axis given, char letter) {
  const std::string name = std::string("axis ") + letter + ' ' + in_quotes(given.name);
  const std::string fault = data::axis_fault(given.coordinates);
  if (!fault.empty()) refuse(name + ' ' + fault);
  const bool falls = given.kind == AxisKind::depth || given.kind == AxisKind::pressure;
  const std::vector<double>& at = given.coordinates;
  if (at.size() > 1 && (at.back() < at.front()) != falls) {
    refuse(name + " has coordinates that " + (falls ? "increase" : "decrease") +
           ": axes run from west, south and bottom");
  }
  data::Axis axis;
  axis.name = std::move(given.name);
  axis.units = std::move(given.units);
  axis.kind = kind_of(given.kind);
  axis.coordinates = std::move(given.coordinates);
  return axis;
}

data::FieldInfo info_of(const Field& field, std::size_t values) {
  const std::string name = "field " + in_quotes(field.name);
  const std::size_t components = field.components.size();
  if (field.name.empty()) refuse("a field has no name");
  if (components < 1 || components > 3) {
    refuse(name + " has " + std::to_string(components) + " components, not 1, 2 or 3");
  }
  data::FieldInfo info;
  info.name = field.name;
  info.kind = components == 1 ? data::FieldKind::scalar : data::FieldKind::vector;
  for (std::size_t c = 0; c < components; ++c) {
    if (const std::size_t count = field.components[c].size(); count != values) {
      refuse(name + " has " + std::to_string(count) + " values in component " + std::to_string(c) +
             ", not " + std::to_string(values) + " (steps x axes)");
    }
    info.components.push_back(components == 1 ? field.name
                                              : field.name + '_' + static_cast<char>('x' + c));
  }
  info.units = field.units;
  info.component_units.assign(components, field.units);
  info.standard_name = field.standard_name;
  info.dtype = "float32";
  return info;
}

std::shared_ptr<data::Dataset> dataset_of(std::unique_ptr<data::Source> source,
                                          const std::string& id,
                                          std::shared_ptr<data::Budget> budget) {
  return std::make_shared<data::Dataset>(std::move(source), id, std::move(budget));
}

}  // namespace

Volume::Volume(std::shared_ptr<State> state) : state_(std::move(state)) {}
Volume::Volume(const Volume&) = default;
Volume::Volume(Volume&&) noexcept = default;
Volume& Volume::operator=(const Volume&) = default;
Volume& Volume::operator=(Volume&&) noexcept = default;
Volume::~Volume() = default;

Volume Volume::sample(const std::string& name, std::uint64_t memory) {
  const auto sized = data::sized_sample(name);
  if (!sized) {
    throw Problem(Problem::Kind::not_found,
                  in_quotes(name) + " is no built-in sample: tornado, climate, efield");
  }
  auto source = library::taken(data::open_sample(sized->name, sized->dims));
  return Volume(std::make_shared<State>(
      State{dataset_of(data::derived::with_derived_fields(std::move(source)), sized->name,
                       std::make_shared<data::Budget>(memory))}));
}

Volume Volume::arrays(std::array<Axis, 3> axes, std::vector<Field> fields,
                      const std::vector<double>& times, std::uint64_t memory) {
  if (fields.empty()) refuse("a volume needs at least one field");
  if (times.empty()) refuse("a volume needs at least one time");
  if (const std::string fault = data::axis_fault(times); !fault.empty()) refuse("times: " + fault);
  data::DatasetInfo info;
  info.id = "arrays";
  info.title = "arrays";
  info.source = "arrays";
  info.format = "arrays";
  info.digest = "arrays";
  info.time_units = "s";
  std::size_t samples = 1;
  for (std::size_t a = 0; a < axes.size(); ++a) {
    info.grid.axes[a] = axis_of(std::move(axes[a]), static_cast<char>('x' + a));
    const std::size_t count = info.grid.axes[a].coordinates.size();
    if (count > samples_max / samples) {
      throw Problem(Problem::Kind::too_large,
                    "a volume has at most " + std::to_string(samples_max) + " samples");
    }
    samples *= count;
  }
  for (const double time : times) info.steps.push_back({time, std::to_string(time)});
  std::set<std::string> names;
  for (const Field& field : fields) {
    info.fields.push_back(info_of(field, samples * times.size()));
    if (!names.insert(field.name).second) refuse("two fields are named " + in_quotes(field.name));
  }
  auto source = std::make_unique<HeldSource>(std::move(info), std::move(fields));
  return Volume(std::make_shared<State>(
      State{dataset_of(data::derived::with_derived_fields(std::move(source)), "arrays",
                       std::make_shared<data::Budget>(memory))}));
}

Volume Volume::file(const std::string& path, std::uint64_t memory) {
  const std::string program = library::taken(library::program());
  data::loader::set_program(program);
  data::loader::set_case_program(
      (std::filesystem::path(program).parent_path() / "windsplat-vtk").native());
  const auto location = library::taken(data::locate(path));
  if (location.fetched) refuse(in_quotes(path) + " is a URL: only files of this machine are read");
  data::loader::Limits limits;
  limits.budget = std::make_shared<data::Budget>(memory);
  auto source = library::taken(data::loader::open(location, limits));
  return Volume(std::make_shared<State>(State{
      dataset_of(std::move(source), std::filesystem::path(path).stem().native(), limits.budget)}));
}

std::array<int, 3> Volume::size() const { return state_->dataset->info().grid.dims(); }

std::size_t Volume::steps() const { return state_->dataset->info().steps.size(); }

std::vector<std::string> Volume::fields() const {
  std::vector<std::string> names;
  for (const data::FieldInfo& field : state_->dataset->info().fields) names.push_back(field.name);
  return names;
}

}  // namespace windsplat
