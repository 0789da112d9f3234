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
#include "server/data/cf/series.hpp"
#include "server/data/cf/time.hpp"
#include "server/data/formats/vtk/grid.hpp"
#include "server/data/formats/vtk/mesh.hpp"
#include "server/data/formats/vtk/piece_target.hpp"
#include "server/data/formats/vtk/resample.hpp"
#include "server/data/formats/vtk/snapshot.hpp"
#include "server/data/formats/vtk/step_reader.hpp"
#include "server/data/model/digest.hpp"

namespace windsplat::data::vtk {

namespace {

using FilePtr = std::shared_ptr<const InputFile>;

constexpr std::size_t steps_max = 100'000;
constexpr std::size_t files_max = 200'000;  // of all steps
constexpr std::array<const char*, 3> axis_names{"x", "y", "z"};

bool is_field(const StoredArray& array) { return !is_ghost(array) && array.components <= 3; }

class VtkSource final : public FileSource {
 public:
  explicit VtkSource(std::shared_ptr<Files> files)
      : files_(std::move(files)), reader_(*files_, files_->location().inside) {}

  Result<void> prepare() {
    auto steps = steps_of(*files_);
    if (!steps) return steps.error();
    if (steps->size() > steps_max) {
      return make_error(ErrorKind::bad_data, "more than " + std::to_string(steps_max) + " steps");
    }
    std::string identity;
    std::vector<Error> damaged;  // which a series does without
    const bool in_series = files_->location().kind == Location::Kind::series;
    for (Step& step : *steps) {
      const std::size_t s = steps_.size();
      steps_.push_back(std::move(step));
      auto snapshot = open_step(s);
      if (!snapshot && in_series && snapshot.error().kind == ErrorKind::bad_data) {
        damaged.push_back(snapshot.error());
        steps_.pop_back();
        continue;
      }
      if (!snapshot) return snapshot.error();
      if (files_read_ > files_max) {
        return step_fault(s, "refers, with the steps before, to more than " +
                                 std::to_string(files_max) + " files");
      }
      auto done = s == 0 ? take_first(*snapshot) : compare(s, *snapshot);
      if (!done) return done;
      identity += steps_[s].identity + '\n';
    }
    if (steps_.empty()) return damaged.front();
    if (!damaged.empty()) info_.notes.push_back(cf::damaged_files_note(damaged, steps->size()));
    if (info_.fields.empty()) {
      return file_->fault("has no array of 1, 2 or 3 components that all pieces and steps have");
    }
    set_times();
    info_.id = files_->location().stem;
    if (info_.title.empty() || info_.title == "vtk output") info_.title = info_.id;
    info_.source = files_->location().members.front().name;
    if (in_series) {
      info_.source += " .. " + files_->location().members.back().name;
    }
    info_.digest = digest_of(identity + WINDSPLAT_VERSION);
    return {};
  }

  [[nodiscard]] const DatasetInfo& info() const override { return info_; }

  Result<void> fill(std::size_t field, std::size_t step, float* out) override {
    WINDSPLAT_CHECK(field < info_.fields.size() && step < steps_.size());
    const auto snapshot = open_again(step);
    if (!snapshot) return snapshot.error();
    auto done =
        mesh_ ? fill_resampled(*snapshot, field, step, out) : fill_regular(*snapshot, field, out);
    return done ? file_->check_unchanged() : done;
  }

  Result<bool> fill_in_parts(std::size_t field, std::size_t step, PartTaker& taker) override {
    WINDSPLAT_CHECK(field < info_.fields.size() && step < steps_.size());
    if (mesh_) return false;
    const auto snapshot = open_again(step);
    if (!snapshot) return snapshot.error();
    if (!is_one_piece(*snapshot, data()) || !(snapshot->whole == whole_)) return false;
    const Piece& piece = snapshot->pieces.front();
    const auto array = array_of(*snapshot, piece, field);
    if (!array || *array == nullptr) return array ? Result<bool>(false) : array.error();
    const auto file = piece.file.open(*files_);
    if (!file) return file.error();
    const Target target = target_of(whole_, piece.extent, of_cells_, grid_.world, grid_.turned);
    auto done = read_in_parts(*file, **array, target, taker, [&](std::size_t n) { report(n); });
    const auto same = done ? file_->check_unchanged() : Result<void>();
    return same ? done : Result<bool>(same.error());
  }

 private:
  // A step whose files are those that were opened first.
  Result<Snapshot> open_again(std::size_t step) {
    const std::string identity = steps_[step].identity;
    auto snapshot = open_step(step);
    if (!snapshot) return snapshot;
    if (steps_[step].identity != identity) {
      return file_->fault("has changed since it was opened; open it again");
    }
    count_tuples(*snapshot);
    return snapshot;
  }

  // Reads the headers of a step, sets file_ to its main file and records its identity.
  Result<Snapshot> open_step(std::size_t step) {
    auto out = reader_.read(steps_[step]);
    if (!out) return out;
    file_ = out->file;
    files_read_ += reader_.file_count();
    steps_[step].identity = out->identity;
    return out;
  }

  [[nodiscard]] Error step_fault(std::size_t step, const std::string& what) const {
    return file_->fault("(step " + std::to_string(step) + ") " + what);
  }

  Result<void> take_first(Snapshot& snapshot) {
    info_.title = snapshot.title;
    info_.format = snapshot.format;
    info_.left_out = std::move(snapshot.left_out);
    info_.notes = std::move(snapshot.notes);
    kind_ = snapshot.kind;
    whole_ = snapshot.whole;
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

  [[nodiscard]] PieceData data() const {
    return of_cells_ ? &Piece::cell_data : &Piece::point_data;
  }

  // Chooses point or cell data, whichever has more fields, points if equal; omits the other.
  void choose_data(const Snapshot& snapshot) {
    const auto fields = [&](PieceData data) {
      const auto names = array_names(snapshot, data);
      return std::count_if(names.begin(), names.end(), [&](const std::string& name) {
        return is_field(*first_of(snapshot, data, name));
      });
    };
    of_cells_ = fields(&Piece::cell_data) > fields(&Piece::point_data);
    const PieceData omitted = of_cells_ ? &Piece::point_data : &Piece::cell_data;
    for (const std::string& name : array_names(snapshot, omitted)) {
      info_.left_out.push_back({name, of_cells_
                                          ? "is at points, while more fields are at cells"
                                          : "is at cells, while no fewer fields are at points"});
    }
  }

  Result<void> find_grid(const Snapshot& snapshot) {
    if (kind_ == Kind::image || kind_ == Kind::rectilinear) {
      auto grid = vtk::regular_grid(*files_, snapshot);
      if (!grid) return grid.error();
      points_grid_ = *grid;
      return set_grid(std::move(*grid));
    }
    auto mesh = read_mesh(*files_, snapshot);
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
    for (std::string& note : notes_on(*mesh_, resampling_, of_cells_)) {
      info_.notes.push_back(std::move(note));
    }
    return {};
  }

  Result<void> find_fields(const Snapshot& snapshot) {
    for (const std::string& name : array_names(snapshot, data())) {
      const StoredArray& array = *first_of(snapshot, data(), name);
      if (!is_field(array)) {
        info_.left_out.push_back({array.name, "has " + std::to_string(array.components) +
                                                  " components; 1, 2 or 3 are supported"});
        continue;
      }
      const auto components = static_cast<std::size_t>(array.components);
      if (info_.grid.samples() * components * sizeof(float) > volume_bytes_max) {
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
    note_missing(snapshot);
    return {};
  }

  // Omits fields that a step lacks, or that its pieces have with other numbers of components.
  void keep_common_fields(const Snapshot& snapshot) {
    std::erase_if(info_.fields, [&](const FieldInfo& field) {
      bool found = false;
      bool fits = true;
      for (const Piece& piece : snapshot.pieces) {
        const StoredArray* array = find_array(piece.*data(), field.name);
        found = found || array != nullptr;
        fits = fits && (array == nullptr ||
                        static_cast<std::size_t>(array->components) == field.components.size());
      }
      if (found && fits) return false;
      info_.left_out.push_back(
          {field.name, "is missing, or has a different type, in " + in_quotes(file_->name())});
      return true;
    });
  }

  // Of blocks: fields that only some have.
  void note_missing(const Snapshot& snapshot) {
    if (snapshot.blocks.size() < 2) return;
    for (const FieldInfo& field : info_.fields) {
      std::vector<bool> has(snapshot.blocks.size());
      for (const Piece& piece : snapshot.pieces) {
        if (find_array(piece.*data(), field.name) != nullptr) has[piece.block] = true;
      }
      const auto lacking = std::count(has.begin(), has.end(), false);
      if (lacking == 0) continue;
      const auto first =
          static_cast<std::size_t>(std::find(has.begin(), has.end(), false) - has.begin());
      info_.notes.push_back(in_quotes(field.name) + " is missing in " + std::to_string(lacking) +
                            " of " + std::to_string(has.size()) + " blocks, where it is masked: " +
                            in_quotes(snapshot.blocks[first]) + (lacking > 1 ? " and others" : ""));
    }
  }

  // A later step must have the same grid. Meshes are compared when their step is read.
  Result<void> compare(std::size_t step, const Snapshot& snapshot) {
    bool same = snapshot.kind == kind_ && snapshot.whole == whole_;
    if (same && (kind_ == Kind::image || kind_ == Kind::rectilinear)) {
      const auto grid = vtk::regular_grid(*files_, snapshot);
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

  void report(std::size_t tuples) {
    tuples_done_ += tuples;
    report_progress(static_cast<double>(tuples_done_) / static_cast<double>(tuples_all_));
  }

  // The array of a field in a piece; null where a block lacks it.
  Result<const StoredArray*> array_of(const Snapshot& snapshot, const Piece& piece,
                                      std::size_t field) const {
    const FieldInfo& wanted = info_.fields[field];
    const StoredArray* array = find_array(piece.*data(), wanted.name);
    if (array == nullptr && snapshot.blocks.size() > 1) return array;
    if (array == nullptr ||
        static_cast<std::size_t>(array->components) != wanted.components.size()) {
      return file_->fault("has changed since it was opened; open it again");
    }
    return array;
  }

  // Reads a piece of a grid with indices into `out`, whose components have `samples` values. Tuples
  // that `mask` hides are left out; copies of those of other pieces yield to them.
  Result<void> fill_piece(const Snapshot& snapshot, const Piece& piece, std::size_t field,
                          const Target& target, unsigned mask, std::size_t samples,
                          SharedSamples& shared, float* out) {
    const auto array = array_of(snapshot, piece, field);
    if (!array || *array == nullptr) return array ? Result<void>() : array.error();
    const auto file = piece.file.open(*files_);
    if (!file) return file.error();
    const auto ghosts = read_ghosts(*file, piece.*data());
    if (!ghosts) return ghosts.error();
    const auto components = static_cast<std::size_t>((*array)->components);
    if (ghosts->empty() && !piece.overlaps) {
      return read_plain(*file, **array, target, samples, out, [&](std::size_t n) { report(n); });
    }
    TargetWalk walk(target);
    shared.begin_piece(piece.block, (*array)->type < bytes::Scalar::float32);
    const auto take = [&](std::uint64_t tuple, const double* values) {
      const std::size_t at = walk.next();
      const double ghost = ghosts->empty() ? 0 : (*ghosts)[tuple];
      const bool is_copy = has_bit(ghost, duplicate);
      if (has_bit(ghost, mask) || (is_copy && !std::isnan(out[at]))) return;
      if (piece.overlaps && !is_copy) shared.add(at, values, components, out + at, samples);
      for (std::size_t c = 0; c < components; ++c) {
        out[at + c * samples] = static_cast<float>(values[c]);
      }
    };
    return read_tuples(*file, **array, take, [&](std::size_t n) { report(n); });
  }

  void count_tuples(const Snapshot& snapshot) {
    tuples_done_ = 0;
    tuples_all_ = 1;
    for (const Piece& piece : snapshot.pieces)
      tuples_all_ += of_cells_ ? piece.cells : piece.points;
  }

  Result<void> fill_regular(const Snapshot& snapshot, std::size_t field, float* out) {
    const std::size_t samples = info_.grid.samples();
    if (!(snapshot.whole == whole_))
      return file_->fault("has a grid that changed since it was opened");
    mask_uncovered(snapshot, data(), samples * info_.fields[field].components.size(), out);
    const unsigned mask = of_cells_ ? hidden_cell | refined_cell : hidden_point;
    SharedSamples shared(has_overlaps(snapshot) ? samples : 0);
    // The last first: where blocks overlap, the first one counts.
    for (auto piece = snapshot.pieces.rbegin(); piece != snapshot.pieces.rend(); ++piece) {
      const Target target = target_of(whole_, piece->extent, of_cells_, grid_.world, grid_.turned);
      auto done = fill_piece(snapshot, *piece, field, target, mask, samples, shared, out);
      if (!done) return done;
    }
    return shared.check(*file_, info_.fields[field].name);
  }

  // Reads the values of the points or cells of the mesh.
  Result<std::vector<float>> mesh_values(const Snapshot& snapshot, std::size_t field) {
    const std::size_t components = info_.fields[field].components.size();
    const std::uint64_t count = of_cells_ ? mesh_->cell_count() : mesh_->point_count();
    std::vector<float> values(count * components, std::numeric_limits<float>::quiet_NaN());
    std::uint64_t base = 0;
    SharedSamples shared(has_overlaps(snapshot) ? count : 0);
    for (const Piece& piece : snapshot.pieces) {
      if (kind_ == Kind::structured) {
        const Target target = target_of(whole_, piece.extent, of_cells_, {0, 1, 2}, {});
        auto done = fill_piece(snapshot, piece, field, target, 0, count, shared, values.data());
        if (!done) return done.error();
        continue;
      }
      const std::uint64_t tuples = of_cells_ ? piece.cells : piece.points;
      if (tuples > count - base) {
        return file_->fault("has a mesh that changed since it was opened");
      }
      const auto array = array_of(snapshot, piece, field);
      if (!array) return array.error();
      if (*array != nullptr) {
        const auto file = piece.file.open(*files_);
        if (!file) return file.error();
        const auto take = [&](std::uint64_t tuple, const double* from) {
          for (std::size_t c = 0; c < components; ++c) {
            values[base + tuple + c * count] = static_cast<float>(from[c]);
          }
        };
        auto done = read_tuples(*file, **array, take, [&](std::size_t n) { report(n); });
        if (!done) return done.error();
      }
      base += tuples;
    }
    if (auto done = shared.check(*file_, info_.fields[field].name); !done) return done.error();
    return values;
  }

  Result<void> fill_resampled(const Snapshot& snapshot, std::size_t field, std::size_t step,
                              float* out) {
    if (step > 0) {
      const auto mesh = read_mesh(*files_, snapshot);
      if (!mesh) return mesh.error();
      if (digest_of_mesh(*mesh) != mesh_digest_) {
        return step_fault(step, "has a mesh that differs from that of the first step");
      }
    }
    const auto values = mesh_values(snapshot, field);
    if (!values) return values.error();
    const std::size_t samples = info_.grid.samples();
    const std::size_t components = info_.fields[field].components.size();
    const std::size_t count = values->size() / components;
    for (std::size_t c = 0; c < components; ++c) {
      const float* from = values->data() + c * count;
      if (of_cells_) {
        gather_cells(resampling_, from, out + c * samples);
      } else {
        gather_points(*mesh_, resampling_, from, out + c * samples);
      }
    }
    return {};
  }

  std::shared_ptr<Files> files_;
  StepReader reader_;
  FilePtr file_;  // file of the last step read
  std::vector<Step> steps_;
  std::size_t files_read_ = 0;
  DatasetInfo info_;
  std::uint64_t tuples_done_ = 0;  // of the read in progress
  std::uint64_t tuples_all_ = 1;
  Kind kind_ = Kind::image;
  Extent whole_;
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
