// Checks the arrays of levels against the description of level 0, and reads boxes of them.
#include "server/data/formats/zarr/levels/source.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

#include "server/base/check.hpp"
#include "server/data/formats/zarr/nodes.hpp"
#include "server/data/model/stored.hpp"

namespace windsplat::data::zarr {

namespace {

using Shape = std::vector<std::size_t>;

std::string text_of(const Shape& shape) {
  std::string out;
  for (const std::size_t length : shape) out += (out.empty() ? "" : ", ") + std::to_string(length);
  return "(" + out + ")";
}

class LevelSource final : public FileSource {
 public:
  LevelSource(std::unique_ptr<FileSource> finest, std::unique_ptr<LevelStore> store)
      : finest_(std::move(finest)), store_(std::move(store)), info_(finest_->info()) {
    finest_->on_progress([this](double done) { report_progress(done); });
  }

  Result<void> prepare() {
    StoredLevels stored;
    for (const LevelNames::Level& level : store_->names.levels) {
      stored.levels.push_back(level.halvings);
      if (level.bytes) stored.bytes.push_back(*level.bytes);
    }
    if (auto done = check_directions(); !done) return done;
    if (stored.bytes.size() < stored.levels.size()) stored.bytes.clear();
    if (auto done = read_widths(stored); !done) return done;
    if (const std::string fault = fault_of(stored, info_); !fault.empty()) return wrong("", fault);
    for (const LevelNames::Field& names : store_->names.fields) {
      if (auto done = add_field(names, stored); !done) return done;
    }
    if (const std::string fault = fault_of(stored, info_); !fault.empty()) return wrong("", fault);
    if (stored.levels.size() > 1 && info_.notes.size() < notes_of_data_max) {
      info_.notes.push_back(note_of(stored));
    }
    info_.stored = std::make_shared<const StoredLevels>(std::move(stored));
    return {};
  }

  [[nodiscard]] const DatasetInfo& info() const override { return info_; }
  void cancel() override { finest_->cancel(); }
  void release() override { finest_->release(); }
  [[nodiscard]] std::vector<Companion> companions() const override { return finest_->companions(); }

  Result<void> fill(std::size_t field, std::size_t step, float* out) override {
    return finest_->fill(field, step, out);
  }
  Result<bool> fill_in_parts(std::size_t field, std::size_t step, PartTaker& taker) override {
    return finest_->fill_in_parts(field, step, taker);
  }

  Result<bool> fill_part(std::size_t field, std::size_t step, const StoredPart& part,
                         float* out) override {
    if (part.level == 0) return finest_->fill_part(field, step, part, out);
    const auto found = arrays_.find({field, part.level, part.as == StoredAs::strided});
    WINDSPLAT_CHECK(found != arrays_.end() && step < info_.steps.size());
    const Box& box = part.box;
    const Shape start{step, at(box.first[2]), at(box.first[1]), at(box.first[0])};
    const Shape count{1, at(box.count[2]), at(box.count[1]), at(box.count[0])};
    const std::vector<int>& arrays = found->second;
    std::vector<cf::Block> blocks;
    blocks.reserve(arrays.size());
    for (const int array : arrays) blocks.push_back({array, start, count});
    store_->arrays->expect(blocks);
    for (std::size_t c = 0; c < arrays.size(); ++c) {
      float* const values = out + c * box.samples();
      auto done = store_->arrays->read(arrays[c], start, count, values);
      if (!done) return done.error();
      store_->arrays->forget_chunks(arrays[c]);
      const bool is_share = part.as == StoredAs::two_values && c >= TwoValues::low_share;
      if (is_share && !are_shares(values, box.samples())) {
        const auto paths = level_paths(store_->names, *names_.at(field), part.level, false);
        return wrong(paths.at(c), "has a share that is not between 0 and 1");
      }
      report_progress(static_cast<double>(c + 1) / static_cast<double>(arrays.size()));
    }
    return true;
  }

 private:
  struct Key {
    std::size_t field = 0;
    std::size_t level = 0;
    bool strided = false;
    bool operator<(const Key& other) const {
      return std::tie(field, level, strided) < std::tie(other.field, other.level, other.strided);
    }
  };

  [[nodiscard]] std::string note_of(const StoredLevels& stored) const {
    std::string dims;
    for (std::size_t a = 0; a < 3; ++a) {
      dims += (a > 0 ? " x " : "") +
              std::to_string(halved(info_.grid.dims().at(a), stored.levels.back().at(a)));
    }
    return "coarser levels are stored (" + std::to_string(stored.levels.size() - 1) +
           "), the last of " + dims + " samples";
  }

  static std::size_t at(int index) { return static_cast<std::size_t>(index); }

  // Kernels multiply by them.
  static bool are_shares(const float* values, std::size_t count) {
    constexpr float whole = 1.0001F;  // sums of rounded weights
    return std::all_of(values, values + count,
                       [](float v) { return std::isnan(v) || (v >= 0 && v <= whole); });
  }

  [[nodiscard]] Error wrong(const std::string& path, const std::string& what) const {
    const std::string place = path.empty() ? "the attribute 'windsplat'" : in_quotes(path);
    return broken_store(store_->arrays->name(), place + ": " + what);
  }

  // The array of a path, which has to have this shape and one of the types.
  Result<int> checked(const std::string& path, const Shape& shape,
                      const std::vector<Dtype>& types) const {
    const int index = store_->indices.at(path);
    const ArrayMetadata& array = store_->metadata.at(static_cast<std::size_t>(index));
    if (!array.problem.empty()) return wrong(path, array.problem);
    if (array.shape != shape) {
      return wrong(path, "has the shape " + text_of(array.shape) + ", its level " + text_of(shape));
    }
    if (std::find(types.begin(), types.end(), array.dtype) == types.end()) {
      return wrong(path, "does not have the type of what it stores");
    }
    return index;
  }

  [[nodiscard]] std::string in_finest(const std::string& name) const {
    return store_->names.levels.front().path + '/' + name;
  }

  // Level 0 is turned when it is read, the other levels are not.
  Result<void> check_directions() const {
    for (const Axis& axis : info_.grid.axes) {
      const std::size_t samples = axis.coordinates.size();
      const std::string path = in_finest(axis.name);
      const auto found = store_->indices.find(path);
      if (found == store_->indices.end() || samples < 2) continue;
      std::vector<double> values(samples);
      auto done = store_->arrays->read(found->second, {0}, {samples}, values.data());
      if (!done) return done;
      const auto ascends = [](const std::vector<double>& of) { return of.front() < of.back(); };
      if (ascends(values) != ascends(axis.coordinates)) {
        return wrong(path, "its order is not that of a dataset, in which levels are stored");
      }
    }
    return {};
  }

  // Samples of levels are read as they are stored.
  Result<void> check_finest(const std::string& component) const {
    const Array& array = store_->finest.at(component);
    const std::string path = in_finest(component);
    for (std::size_t a = 0; a < 3; ++a) {
      const Axis& axis = info_.grid.axes.at(a);
      const bool is_there = array.dimensions.size() == 4 && array.dimensions[3 - a] == axis.name;
      if (!is_there && axis.coordinates.size() > 1) {
        return wrong(path, "its dimensions are not those of levels: time, z, y, x");
      }
    }
    for (const char* const name : {"scale_factor", "add_offset", "_FillValue", "missing_value",
                                   "valid_min", "valid_max", "valid_range"}) {
      if (array.attributes.find(name) != nullptr) {
        return wrong(path, std::string("has the attribute ") + name + ", its levels have not");
      }
    }
    return {};
  }

  Result<void> read_widths(StoredLevels& stored) const {
    for (std::size_t a = 0; a < 3; ++a) {
      const std::string& path = store_->names.widths.at(a);
      if (path.empty()) continue;
      const std::size_t samples = info_.grid.axes.at(a).coordinates.size();
      const auto index = checked(path, {samples}, {{'f', 8}});
      if (!index) return index.error();
      stored.widths.at(a).resize(samples);
      auto done = store_->arrays->read(*index, {0}, {samples}, stored.widths.at(a).data());
      if (!done) return done;
    }
    return {};
  }

  Result<void> add_field(const LevelNames::Field& names, StoredLevels& stored) {
    const auto same =
        std::find_if(info_.fields.begin(), info_.fields.end(),
                     [&](const FieldInfo& field) { return field.components == names.components; });
    if (same == info_.fields.end()) {
      return wrong("", "level 0 has no field of " + in_quotes(names.components.front()));
    }
    if (!same->is_read_by_boxes()) return {};
    const auto f = static_cast<std::size_t>(same - info_.fields.begin());
    if (!names_.emplace(f, &names).second) {
      return wrong("", "/fields has " + in_quotes(same->name) + " twice");
    }
    if (stored.fields.size() <= f) stored.fields.resize(f + 1);
    StoredField& field = stored.fields[f];
    if (auto done = read_ranges(names, field); !done) return done;
    field.has_levels = names.as != LevelNames::Field::As::nothing && stored.levels.size() > 1;
    field.strided = field.has_levels ? names.strided : 0;
    for (const std::string& component : names.components) {
      if (!field.has_levels) break;
      if (auto done = check_finest(component); !done) return done;
    }
    for (std::size_t n = 1; n < stored.levels.size() && field.has_levels; ++n) {
      const auto strided = static_cast<int>(n);
      if (auto done = find_arrays({f, n, false}, stored.levels[n]); !done) return done;
      if (strided > field.strided) continue;
      if (auto done = find_arrays({f, n, true}, {strided, strided, strided}); !done) return done;
    }
    return {};
  }

  Result<void> find_arrays(const Key& key, const std::array<int, 3>& halvings) {
    Shape shape{info_.steps.size()};
    for (const std::size_t a : {2U, 1U, 0U}) {
      shape.push_back(at(halved(info_.grid.dims().at(a), halvings.at(a))));
    }
    std::vector<int>& out = arrays_[key];
    for (const std::string& path :
         level_paths(store_->names, *names_.at(key.field), key.level, key.strided)) {
      const auto index = checked(path, shape, {{'f', 4}});
      if (!index) return index.error();
      out.push_back(*index);
    }
    return {};
  }

  Result<void> read_ranges(const LevelNames::Field& names, StoredField& field) const {
    if (names.ranges.empty()) return {};
    const std::size_t steps = info_.steps.size();
    const auto range = checked(range_path(names), {steps, 2}, {{'f', 4}});
    if (!range) return range.error();
    const auto masked = checked(masked_path(names), {steps}, {{'u', 4}, {'u', 8}, {'f', 8}});
    if (!masked) return masked.error();
    std::vector<float> ends(2 * steps);
    std::vector<double> counts(steps);
    if (auto done = store_->arrays->read(*range, {0, 0}, {steps, 2}, ends.data()); !done) {
      return done;
    }
    if (auto done = store_->arrays->read(*masked, {0}, {steps}, counts.data()); !done) return done;
    const auto samples = static_cast<double>(info_.grid.samples());
    for (std::size_t step = 0; step < steps; ++step) {
      if (!(counts[step] >= 0 && counts[step] <= samples)) {
        return wrong(masked_path(names), "counts more samples than there are");
      }
      StoredRange one;
      one.masked = static_cast<std::int64_t>(counts[step]);
      if (counts[step] < samples) one.range = {ends[2 * step], ends[2 * step + 1]};
      field.ranges.push_back(one);
    }
    return {};
  }

  std::unique_ptr<FileSource> finest_;
  std::unique_ptr<LevelStore> store_;
  DatasetInfo info_;
  std::map<std::size_t, const LevelNames::Field*> names_;  // by field
  std::map<Key, std::vector<int>> arrays_;                 // of the components of a volume
};

}  // namespace

Result<std::unique_ptr<FileSource>> with_levels(std::unique_ptr<FileSource> finest,
                                                std::unique_ptr<LevelStore> levels) {
  auto source = std::make_unique<LevelSource>(std::move(finest), std::move(levels));
  if (auto done = source->prepare(); !done) return done.error();
  return std::unique_ptr<FileSource>(std::move(source));
}

}  // namespace windsplat::data::zarr
