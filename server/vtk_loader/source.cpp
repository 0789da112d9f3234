// Case -> mesh -> lattice, computed once -> volumes.
#include "server/vtk_loader/source.hpp"

#include <vtkCellArray.h>
#include <vtkPoints.h>
#include <vtkUnstructuredGrid.h>

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/base/check.hpp"
#include "server/data/cf/grid/grid.hpp"
#include "server/data/cf/time.hpp"
#include "server/data/formats/vtk/mesh.hpp"
#include "server/data/formats/vtk/resample.hpp"
#include "server/data/model/digest.hpp"
#include "server/vtk_loader/case.hpp"
#include "server/vtk_loader/case_files.hpp"
#include "server/vtk_loader/messages.hpp"
#include "server/vtk_loader/parts.hpp"

namespace windsplat::vtk_loader {

namespace {

using data::FieldKind;

constexpr std::array<const char*, 3> axis_names{"x", "y", "z"};
constexpr std::size_t warnings_shown = 5;

class CaseSource final : public data::FileSource {
 public:
  explicit CaseSource(const std::shared_ptr<data::Files>& files)
      : files_(files), case_files_(files) {
    const data::Location& location = files->location();
    name_ = location.members.empty() ? location.stem : location.members.front().name;
    serve(&case_files_);
  }
  ~CaseSource() override {
    case_.reset();
    serve(nullptr);
  }
  CaseSource(const CaseSource&) = delete;
  CaseSource& operator=(const CaseSource&) = delete;

  Result<void> prepare(data::CaseFormat format) {
    auto opened = format == data::CaseFormat::openfoam ? open_openfoam(case_files_)
                                                       : open_ensight(case_files_);
    if (!opened) return of_case(opened.error());
    case_ = std::move(*opened);
    const CaseContents& all = case_->contents();
    if (all.fields.empty()) return fault("has no scalar or vector of cells or points at all times");
    if (auto done = find_mesh(); !done) return of_case(done.error());
    describe(all);
    return {};
  }

  [[nodiscard]] const data::DatasetInfo& info() const override { return info_; }

  Result<void> fill(std::size_t field, std::size_t step, float* out) override {
    WINDSPLAT_CHECK(field < info_.fields.size() && step < info_.steps.size());
    const CaseField& wanted = case_->contents().fields[field];
    const auto parts = case_->read(step, &wanted);
    if (!parts) return of_case(parts.error());
    if (auto same = check_mesh(*parts, step); !same) return of_case(same.error());
    const auto values = values_of(*parts, wanted, mesh_);
    if (!values) return of_case(at_step(values.error(), step));
    const std::size_t samples = info_.grid.samples();
    const std::size_t count = values->size() / static_cast<std::size_t>(wanted.components);
    for (std::size_t c = 0; c < static_cast<std::size_t>(wanted.components); ++c) {
      const float* const from = values->data() + c * count;
      if (wanted.of_cells) {
        data::vtk::gather_cells(resampling_, from, out + c * samples);
      } else {
        data::vtk::gather_points(mesh_, resampling_, from, out + c * samples);
      }
    }
    return {};
  }

 private:
  // Points and cells of a part, held so that their addresses identify them.
  struct Kept {
    vtkSmartPointer<vtkObject> points;
    vtkSmartPointer<vtkObject> cells;
    bool operator==(const Kept& other) const {
      return points == other.points && cells == other.cells && points != nullptr;
    }
  };

  static std::vector<Kept> kept_of(const Parts& parts) {
    std::vector<Kept> out;
    for (const auto& part : parts) {
      Kept one;
      if (auto* const grid = vtkUnstructuredGrid::SafeDownCast(part)) {
        one = {grid->GetPoints(), grid->GetCells()};
      }
      out.push_back(one);
    }
    return out;
  }

  [[nodiscard]] Error fault(const std::string& what) const {
    return make_error(ErrorKind::bad_data, in_quotes(name_) + ' ' + what);
  }

  // Errors begin with the name of the case. Those of VTK and of files name a file themselves.
  [[nodiscard]] Error of_case(const Error& error) const {
    const bool is_sentence = error.message.starts_with("is ") ||
                             error.message.starts_with("has ") ||
                             error.message.starts_with("refers ");
    return make_error(error.kind, in_quotes(name_) + (is_sentence ? " " : ": ") + error.message);
  }

  [[nodiscard]] Error at_step(const Error& error, std::size_t step) const {
    return make_error(error.kind, error.message + " at the time " + info_.steps[step].text);
  }

  Result<void> find_mesh() {
    const auto parts = case_->read(0, nullptr);
    if (!parts) return parts.error();
    auto mesh = mesh_of(*parts);
    if (!mesh) return mesh.error();
    kept_ = kept_of(*parts);
    mesh_digest_ = data::vtk::digest_of_mesh(*mesh);
    auto resampling = data::vtk::resample(*mesh);
    if (!resampling) return resampling.error();
    mesh_ = std::move(*mesh);
    mesh_.forget_points();
    resampling_ = std::move(*resampling);
    return {};
  }

  // A step with another mesh than the first is refused.
  Result<void> check_mesh(const Parts& parts, std::size_t step) {
    auto kept = kept_of(parts);
    if (kept == kept_) return {};
    const auto mesh = mesh_of(parts);
    if (!mesh) return mesh.error();
    if (data::vtk::digest_of_mesh(*mesh) != mesh_digest_) {
      return make_error(ErrorKind::bad_data,
                        "has a mesh that differs from that of the first step "
                        "at the time " +
                            info_.steps[step].text);
    }
    kept_ = std::move(kept);
    return {};
  }

  void describe(const CaseContents& all) {
    info_.id = files_->location().stem;
    info_.title = info_.id;
    info_.source = name_;
    info_.format = all.format;
    info_.digest = data::digest_of(case_files_.identity() + mesh_digest_ + WINDSPLAT_VERSION);
    info_.stored_bytes = files_->opened_bytes();
    info_.left_out = all.left_out;
    info_.notes = all.notes;
    for (std::size_t a = 0; a < 3; ++a) {
      info_.grid.axes.at(a).name = axis_names.at(a);
      info_.grid.axes.at(a).units = all.length_units;
      info_.grid.axes.at(a).coordinates = resampling_.coordinates.at(a);
    }
    bool of_cells = false;
    for (const CaseField& from : all.fields) {
      data::FieldInfo field;
      field.name = from.name;
      field.kind = from.components > 1 ? FieldKind::vector : FieldKind::scalar;
      field.units = from.units;
      field.dtype = "float32";
      for (std::size_t c = 0; c < static_cast<std::size_t>(from.components); ++c) {
        field.components.push_back(from.components == 1 ? from.name
                                                        : from.name + '_' + axis_names.at(c));
        field.component_units.push_back(from.units);
      }
      of_cells = of_cells || from.of_cells;
      info_.fields.push_back(std::move(field));
    }
    for (std::string& note : data::vtk::notes_on(mesh_, resampling_, of_cells)) {
      info_.notes.push_back(std::move(note));
    }
    std::vector<std::string> warnings = take_warnings();
    warnings.resize(std::min(warnings.size(), warnings_shown));
    for (const std::string& warning : warnings) {
      info_.notes.push_back("VTK: " + printable(warning, 300));
    }
    for (const double time : all.times) info_.steps.push_back({time, data::cf::number_text(time)});
    info_.time_units = all.time_units;
  }

  std::shared_ptr<data::Files> files_;
  CaseFiles case_files_;
  std::string name_;
  std::unique_ptr<Case> case_;
  data::DatasetInfo info_;
  data::vtk::Mesh mesh_;  // without its points
  data::vtk::Resampling resampling_;
  std::string mesh_digest_;
  std::vector<Kept> kept_;  // the mesh as read last
};

}  // namespace

Result<std::unique_ptr<data::FileSource>> open(const std::shared_ptr<data::Files>& files,
                                               data::CaseFormat format) {
  collect_messages();
  auto source = std::make_unique<CaseSource>(files);
  if (auto done = source->prepare(format); !done) return done.error();
  return std::unique_ptr<data::FileSource>(std::move(source));
}

}  // namespace windsplat::vtk_loader
