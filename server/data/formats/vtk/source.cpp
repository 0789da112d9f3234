// Files of steps -> one grid, rectilinear or resampled -> fields common to all steps -> volumes.
#include "server/data/formats/vtk/source.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/base/ascii.hpp"
#include "server/base/check.hpp"
#include "server/data/cf/grid/grid.hpp"
#include "server/data/cf/time.hpp"
#include "server/data/formats/vtk/grid.hpp"
#include "server/data/formats/vtk/mesh.hpp"
#include "server/data/formats/vtk/piece_target.hpp"
#include "server/data/formats/vtk/resample.hpp"
#include "server/data/formats/vtk/snapshot.hpp"
#include "server/data/model/digest.hpp"

namespace windsplat::data::vtk {

namespace {

using FilePtr = std::shared_ptr<const InputFile>;

constexpr std::size_t steps_max = 100'000;
constexpr std::size_t block_tuples = std::size_t{1} << 15;
constexpr std::array<const char*, 3> axis_names{"x", "y", "z"};

struct StepFile {
  std::string name;
  std::optional<double> time;
  std::string identity;
};

Result<Snapshot> read_snapshot(const FilePtr& file) {
  const auto head = file->head(head_bytes);
  if (!head) return head.error();
  if (is_legacy(*head)) return read_legacy(file);
  if (is_xml(*head)) return read_xml(file);
  return file->fault("is not a VTK file");
}

const StoredArray* find_array(const std::vector<StoredArray>& arrays, const std::string& name) {
  const auto at = std::find_if(arrays.begin(), arrays.end(),
                               [&](const StoredArray& array) { return array.name == name; });
  return at == arrays.end() ? nullptr : &*at;
}

bool is_field(const StoredArray& array) {
  return array.name != ghost_name && array.components <= 3;
}

class VtkSource final : public FileSource {
 public:
  explicit VtkSource(std::shared_ptr<Files> files) : files_(std::move(files)) {}

  Result<void> prepare() {
    if (auto done = find_steps(); !done) return done;
    std::string identity;
    for (std::size_t s = 0; s < steps_.size(); ++s) {
      auto snapshot = open_step(s);
      if (!snapshot) return snapshot.error();
      auto done = s == 0 ? take_first(*snapshot) : compare(s, *snapshot);
      if (!done) return done;
      identity += steps_[s].identity + '\n';
    }
    if (info_.fields.empty()) {
      return file_->fault("has no array of 1, 2 or 3 components that all pieces and steps have");
    }
    set_times();
    info_.id = files_->location().stem;
    if (info_.title.empty() || info_.title == "vtk output") info_.title = info_.id;
    info_.source = files_->location().members.front().name;
    if (files_->location().kind == Location::Kind::series) {
      info_.source += " .. " + files_->location().members.back().name;
    }
    info_.digest = digest_of(identity + WINDSPLAT_VERSION);
    return {};
  }

  [[nodiscard]] const DatasetInfo& info() const override { return info_; }

  Result<void> fill(std::size_t field, std::size_t step, float* out) override {
    WINDSPLAT_CHECK(field < info_.fields.size() && step < steps_.size());
    const std::string identity = steps_[step].identity;
    const auto snapshot = open_step(step);
    if (!snapshot) return snapshot.error();
    if (steps_[step].identity != identity) {
      return file_->fault("has changed since it was opened; open it again");
    }
    auto done =
        mesh_ ? fill_resampled(*snapshot, field, step, out) : fill_regular(*snapshot, field, out);
    return done ? file_->check_unchanged() : done;
  }

 private:
  // Finds the files of the steps, and their times in a collection.
  Result<void> find_steps() {
    for (const auto& member : files_->location().members) {
      steps_.push_back({member.name, {}, {}});
    }
    if (files_->location().kind == Location::Kind::file) {
      auto file = files_->open(steps_.front().name);
      if (!file) return file.error();
      const auto head = (*file)->head(head_bytes);
      if (!head) return head.error();
      if (is_xml(*head) && head->find("\"Collection\"") != std::string::npos) {
        auto collection = read_collection(*file);
        if (!collection) return collection.error();
        if (*collection) {
          steps_.clear();
          for (auto& member : (*collection)->members) {
            steps_.push_back({std::move(member.file), member.time, {}});
          }
        }
      }
    }
    if (steps_.size() > steps_max) {
      return make_error(ErrorKind::bad_data, "more than " + std::to_string(steps_max) + " steps");
    }
    return {};
  }

  // Opens the file of a step as file_ and records its identity.
  Result<Snapshot> open_step(std::size_t step) {
    auto file = files_->open(steps_[step].name);
    if (!file) return file.error();
    file_ = std::move(*file);
    steps_[step].identity = file_->identity();
    return read_snapshot(file_);
  }

  [[nodiscard]] Error step_fault(std::size_t step, const std::string& what) const {
    return file_->fault("(step " + std::to_string(step) + ") " + what);
  }

  Result<void> take_first(Snapshot& snapshot) {
    info_.title = snapshot.title;
    info_.format = snapshot.format;
    info_.left_out = std::move(snapshot.left_out);
    kind_ = snapshot.kind;
    whole_ = snapshot.whole;
    time_ = snapshot.time;
    note_time(0, snapshot);
    choose_data(snapshot);
    note_gaps(snapshot);
    if (auto done = find_grid(snapshot); !done) return done;
    return find_fields(snapshot);
  }

  void note_time(std::size_t step, const Snapshot& snapshot) {
    if (!steps_[step].time) steps_[step].time = snapshot.time;
  }

  void note_gaps(const Snapshot& snapshot) {
    if (kind_ == Kind::unstructured) return;
    const std::uint64_t count = uncovered(snapshot, of_cells_);
    if (count == 0) return;
    info_.notes.push_back(std::to_string(count) + (of_cells_ ? " cells" : " points") +
                          " of the whole extent are in no piece: masked");
  }

  [[nodiscard]] const std::vector<StoredArray>& data_of(const Piece& piece) const {
    return of_cells_ ? piece.cell_data : piece.point_data;
  }

  // Chooses point or cell data, whichever has more fields, points if equal; omits the other.
  void choose_data(const Snapshot& snapshot) {
    const Piece& piece = snapshot.pieces.front();
    const auto fields = [](const std::vector<StoredArray>& arrays) {
      return std::count_if(arrays.begin(), arrays.end(), is_field);
    };
    of_cells_ = fields(piece.cell_data) > fields(piece.point_data);
    for (const StoredArray& array : of_cells_ ? piece.point_data : piece.cell_data) {
      if (array.name == ghost_name) continue;
      info_.left_out.push_back(
          {array.name, of_cells_ ? "is at points, while more fields are at cells"
                                 : "is at cells, while no fewer fields are at points"});
    }
  }

  Result<void> find_grid(const Snapshot& snapshot) {
    if (kind_ == Kind::image || kind_ == Kind::rectilinear) {
      auto grid = vtk::regular_grid(file_, snapshot);
      if (!grid) return grid.error();
      points_grid_ = *grid;
      return set_grid(std::move(*grid));
    }
    auto mesh = read_mesh(file_, snapshot);
    if (!mesh) return mesh.error();
    mesh_digest_ = digest_of_mesh(*mesh);
    if (kind_ == Kind::structured) {
      if (auto grid = separable_grid(mesh->points, mesh->counts)) {
        info_.notes.push_back("the structured grid is rectilinear: shown without resampling");
        return set_grid(std::move(*grid));
      }
    }
    return set_resampled(std::move(*mesh));
  }

  Result<void> set_grid(RegularGrid grid) {
    const bool turned = grid.world != std::array<std::size_t, 3>{0, 1, 2};
    if (turned) info_.notes.push_back("the file's axes are those of the world in another order");
    if (of_cells_) {
      info_.notes.push_back("values of cells are shown at cell centres");
      grid = cell_centres(grid);
    }
    grid_ = std::move(grid);
    return set_axes(grid_.coordinates);
  }

  Result<void> set_axes(const std::array<std::vector<double>, 3>& coordinates) {
    int wide = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      info_.grid.axes.at(a).name = axis_names.at(a);
      info_.grid.axes.at(a).coordinates = coordinates.at(a);
      wide += coordinates.at(a).size() > 1 ? 1 : 0;
    }
    if (wide < 2) return file_->fault("has data along fewer than two axes");
    return {};
  }

  Result<void> set_resampled(Mesh mesh) {
    auto resampling = resample(mesh);
    if (!resampling) return file_->fault(resampling.error().message);
    mesh.forget_points();
    mesh_ = std::move(mesh);
    resampling_ = std::move(*resampling);
    if (auto done = set_axes(resampling_.coordinates); !done) return done;
    const auto dims = info_.grid.dims();
    const auto samples = static_cast<double>(info_.grid.samples());
    const double outside = 100 * (1 - static_cast<double>(resampling_.inside) / samples);
    std::string note = "resampled from " + std::to_string(mesh_->point_count());
    note += " points and " + std::to_string(resampling_.shown) + " cells onto ";
    note += std::to_string(dims[0]) + " x " + std::to_string(dims[1]) + " x ";
    note += std::to_string(dims[2]) + " samples; ";
    note += std::to_string(std::lround(outside)) + " % lie outside all cells and are masked";
    if (of_cells_) note += "; values are those of the cells, not interpolated";
    info_.notes.push_back(std::move(note));
    for (std::size_t d = 0; d < 3; ++d) {
      const double layers = std::round(resampling_.layers.at(d));
      if (dims.at(d) < 2 || dims.at(d) >= layers) continue;
      info_.notes.push_back("along " + std::string(axis_names.at(d)) +
                            " fewer samples than cells: " + std::to_string(dims.at(d)) +
                            " for about " + cf::number_text(layers) + "; thin cells may be missed");
    }
    for (const auto& [type, count] : mesh_->unread) {
      info_.notes.push_back(std::to_string(count) + " cells of type " + std::to_string(type) +
                            " omitted");
    }
    if (resampling_.other_rank > 0) {
      info_.notes.push_back(std::to_string(resampling_.other_rank) +
                            " flat cells omitted, because there are solid ones");
    }
    if (resampling_.broken > 0) {
      info_.notes.push_back(std::to_string(resampling_.broken) +
                            " cells without volume, or with hidden or non-finite points, omitted");
    }
    return {};
  }

  Result<void> find_fields(const Snapshot& snapshot) {
    for (const StoredArray& array : data_of(snapshot.pieces.front())) {
      if (array.name == ghost_name) continue;
      if (!is_field(array)) {
        info_.left_out.push_back({array.name, "has " + std::to_string(array.components) +
                                                  " components; 1, 2 or 3 are supported"});
        continue;
      }
      const auto components = static_cast<std::size_t>(array.components);
      if (info_.grid.samples() * components * sizeof(float) > cf::volume_bytes_max) {
        info_.left_out.push_back({array.name, "more than 16 GiB a step"});
        continue;
      }
      FieldInfo field;
      field.name = array.name;
      field.kind = components > 1 ? FieldKind::vector : FieldKind::scalar;
      field.components = array.component_names;
      for (std::size_t c = field.components.size(); c < components; ++c) {
        field.components.push_back(components == 1 ? array.name
                                                   : array.name + '_' + axis_names.at(c));
      }
      field.component_units.assign(components, "");
      field.dtype = bytes::name_of(array.type);
      info_.fields.push_back(std::move(field));
    }
    keep_common_fields(snapshot);
    return {};
  }

  // Omits fields that are missing in a piece.
  void keep_common_fields(const Snapshot& snapshot) {
    std::erase_if(info_.fields, [&](const FieldInfo& field) {
      const bool common =
          std::all_of(snapshot.pieces.begin(), snapshot.pieces.end(), [&](const Piece& piece) {
            const StoredArray* array = find_array(data_of(piece), field.name);
            return array != nullptr &&
                   static_cast<std::size_t>(array->components) == field.components.size();
          });
      if (!common) {
        info_.left_out.push_back(
            {field.name,
             "is missing, or has a different type, in a piece of " + in_quotes(file_->name())});
      }
      return !common;
    });
  }

  // A later step must have the same grid. Meshes are compared when their step is read.
  Result<void> compare(std::size_t step, const Snapshot& snapshot) {
    bool same = snapshot.kind == kind_ && snapshot.whole == whole_;
    if (same && (kind_ == Kind::image || kind_ == Kind::rectilinear)) {
      const auto grid = vtk::regular_grid(file_, snapshot);
      if (!grid) return grid.error();
      same = *grid == points_grid_;
    }
    if (!same) return step_fault(step, "has a grid that differs from that of the first step");
    note_time(step, snapshot);
    keep_common_fields(snapshot);
    return {};
  }

  // Uses the times of the files if all have one and they ascend; otherwise numbers the steps.
  void set_times() {
    bool timed = true;
    for (std::size_t s = 0; s < steps_.size(); ++s) {
      timed =
          timed && steps_[s].time.has_value() && (s == 0 || *steps_[s].time > *steps_[s - 1].time);
    }
    if (!timed && steps_.front().time) {
      info_.notes.push_back("times are missing or do not ascend: steps are numbered");
    }
    for (std::size_t s = 0; s < steps_.size(); ++s) {
      const double value = timed ? *steps_[s].time : static_cast<double>(s);
      info_.steps.push_back({value, cf::number_text(value)});
    }
  }

  // Calls take(tuples, count) for blocks of an array of a piece, in order.
  template <class Take>
  Result<void> read_tuples(const StoredArray& array, const Take& take) {
    auto reader = ArrayReader::open(file_, array);
    if (!reader) return reader.error();
    const auto components = static_cast<std::size_t>(array.components);
    std::vector<double> block(std::min<std::uint64_t>(array.tuples, block_tuples) * components);
    for (std::uint64_t done = 0; done < array.tuples;) {
      const auto count =
          static_cast<std::size_t>(std::min<std::uint64_t>(array.tuples - done, block_tuples));
      if (auto read = reader->read(block.data(), count * components); !read) return read;
      take(block.data(), count);
      done += count;
      report_progress(static_cast<double>(done) / static_cast<double>(array.tuples));
    }
    return {};
  }

  Result<const StoredArray*> array_of(const Piece& piece, std::size_t field) const {
    const FieldInfo& wanted = info_.fields[field];
    const StoredArray* array = find_array(data_of(piece), wanted.name);
    if (array == nullptr ||
        static_cast<std::size_t>(array->components) != wanted.components.size()) {
      return file_->fault("has changed since it was opened; open it again");
    }
    return array;
  }

  Result<void> fill_regular(const Snapshot& snapshot, std::size_t field, float* out) {
    const std::size_t samples = info_.grid.samples();
    const std::size_t components = info_.fields[field].components.size();
    if (!(snapshot.whole == whole_))
      return file_->fault("has a grid that changed since it was opened");
    std::fill_n(out, samples * components, std::numeric_limits<float>::quiet_NaN());
    for (const Piece& piece : snapshot.pieces) {
      const auto array = array_of(piece, field);
      if (!array) return array.error();
      const auto ghosts = read_ghosts(file_, data_of(piece));
      if (!ghosts) return ghosts.error();
      const unsigned mask = of_cells_ ? hidden_cell | refined_cell : hidden_point;
      const Target target = target_of(whole_, piece.extent, of_cells_, grid_.world, grid_.turned);
      std::uint64_t tuple = 0;
      auto done = read_tuples(**array, [&](const double* block, std::size_t count) {
        for (std::size_t i = 0; i < count; ++i, ++tuple, block += components) {
          if (!ghosts->empty() && has_bit((*ghosts)[tuple], mask)) continue;
          const std::size_t at = target.at(tuple);
          for (std::size_t c = 0; c < components; ++c) {
            out[at + c * samples] = static_cast<float>(block[c]);
          }
        }
      });
      if (!done) return done;
    }
    return {};
  }

  Result<void> fill_resampled(const Snapshot& snapshot, std::size_t field, std::size_t step,
                              float* out) {
    if (step > 0) {
      const auto mesh = read_mesh(file_, snapshot);
      if (!mesh) return mesh.error();
      if (digest_of_mesh(*mesh) != mesh_digest_) {
        return step_fault(step, "has a mesh that differs from that of the first step");
      }
    }
    const std::size_t samples = info_.grid.samples();
    const std::size_t components = info_.fields[field].components.size();
    const std::uint64_t count = of_cells_ ? mesh_->cell_count() : mesh_->point_count();
    std::vector<float> values(count * components, std::numeric_limits<float>::quiet_NaN());
    std::uint64_t base = 0;
    for (const Piece& piece : snapshot.pieces) {
      const auto array = array_of(piece, field);
      if (!array) return array.error();
      if (kind_ == Kind::unstructured && (*array)->tuples > count - base) {
        return file_->fault("has a mesh that changed since it was opened");
      }
      const Target target = kind_ == Kind::structured
                                ? target_of(whole_, piece.extent, of_cells_, {0, 1, 2}, {})
                                : Target{};
      std::uint64_t tuple = 0;
      auto done = read_tuples(**array, [&](const double* block, std::size_t n) {
        for (std::size_t i = 0; i < n; ++i, ++tuple, block += components) {
          const std::size_t at =
              kind_ == Kind::structured ? target.at(tuple) : static_cast<std::size_t>(base + tuple);
          for (std::size_t c = 0; c < components; ++c) {
            values[at + c * count] = static_cast<float>(block[c]);
          }
        }
      });
      if (!done) return done;
      base += (*array)->tuples;
    }
    for (std::size_t c = 0; c < components; ++c) {
      const float* from = values.data() + c * count;
      if (of_cells_) {
        gather_cells(resampling_, from, out + c * samples);
      } else {
        gather_points(*mesh_, resampling_, from, out + c * samples);
      }
    }
    return {};
  }

  std::shared_ptr<Files> files_;
  FilePtr file_;  // file of the last step read
  std::vector<StepFile> steps_;
  DatasetInfo info_;
  Kind kind_ = Kind::image;
  Extent whole_;
  std::optional<double> time_;
  bool of_cells_ = false;
  RegularGrid points_grid_;
  RegularGrid grid_;          // grid of the shown data, unless resampled
  std::optional<Mesh> mesh_;  // if resampled, without its points
  Resampling resampling_;
  std::string mesh_digest_;
};

}  // namespace

bool is_vtk(std::string_view head) { return is_legacy(head) || is_xml(head); }

Result<std::unique_ptr<FileSource>> open(const std::shared_ptr<Files>& files) {
  auto source = std::make_unique<VtkSource>(files);
  if (auto done = source->prepare(); !done) return done.error();
  return std::unique_ptr<FileSource>(std::move(source));
}

}  // namespace windsplat::data::vtk
