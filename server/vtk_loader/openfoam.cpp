// Cases of OpenFOAM by vtkOpenFOAMReader: one reader for a case, or one for each processor* of a
// decomposed one. VTK lists the times and reads mesh and values; fields, their classes and units
// are found here, in the headers of their files.
#include <vtkDoubleArray.h>
#include <vtkInformation.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkNew.h>
#include <vtkOpenFOAMReader.h>
#include <vtkStringArray.h>
#include <vtkUnstructuredGrid.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "server/vtk_loader/case.hpp"
#include "server/vtk_loader/foam_header.hpp"

namespace windsplat::vtk_loader {

namespace {

constexpr std::string_view processor = "processor";
constexpr std::size_t processors_max = 4096;

struct FieldClass {
  const char* name;
  int components;
  bool of_cells;
};
constexpr auto field_classes = std::to_array<FieldClass>({
    {"volScalarField", 1, true},
    {"volVectorField", 3, true},
    {"volScalarField::Internal", 1, true},
    {"volVectorField::Internal", 3, true},
    {"pointScalarField", 1, false},
    {"pointVectorField", 3, false},
});

bool is_digits(std::string_view text) {
  return !text.empty() &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

// The name of a field's file without that of its compression.
std::string without_gz(const std::string& name) {
  return name.ends_with(".gz") ? name.substr(0, name.size() - 3) : name;
}

struct Root {
  std::string folder;  // "" or "processor3/"
  vtkNew<vtkOpenFOAMReader> reader;
  std::vector<std::string> time_names;
};

class OpenFoamCase final : public Case {
 public:
  explicit OpenFoamCase(CaseFiles& files) : files_(files) {}

  Result<void> open() {
    contents_.format = "OpenFOAM";
    contents_.time_units = "s";
    contents_.length_units = "m";
    for (auto stage : {&OpenFoamCase::find_roots, &OpenFoamCase::find_times,
                       &OpenFoamCase::check_meshes, &OpenFoamCase::find_fields,
                       &OpenFoamCase::choose_fields, &OpenFoamCase::leave_out_unlisted}) {
      if (auto done = (this->*stage)(); !done) return done;
    }
    contents_.notes.push_back("the mesh within the boundaries is shown; patches and zones are not");
    return {};
  }

  Result<Parts> read(std::size_t step, const CaseField* field) override {
    Parts out;
    for (const auto& root : roots_) {
      auto& reader = *root->reader;
      reader.DisableAllCellArrays();
      reader.DisableAllPointArrays();
      if (field != nullptr && field->of_cells) reader.SetCellArrayStatus(field->name.c_str(), 1);
      if (field != nullptr && !field->of_cells) reader.SetPointArrayStatus(field->name.c_str(), 1);
      auto fine = guarded(files_, [&] { reader.UpdateTimeStep(contents_.times.at(step)); });
      if (!fine) return fine.error();
      auto* const mesh = vtkUnstructuredGrid::SafeDownCast(
          reader.GetOutput() == nullptr ? nullptr : internal_mesh(*reader.GetOutput()));
      if (mesh == nullptr || mesh->GetNumberOfCells() == 0) {
        return bad_case(in_quotes(root->folder + "constant/polyMesh") +
                        " has no cells that VTK reads");
      }
      // The reader reuses its output for the next step.
      auto kept = vtkSmartPointer<vtkUnstructuredGrid>::New();
      kept->ShallowCopy(mesh);
      out.push_back(kept);
    }
    return out;
  }

 private:
  static vtkDataObject* internal_mesh(vtkMultiBlockDataSet& blocks) {
    for (unsigned b = 0; b < blocks.GetNumberOfBlocks(); ++b) {
      if (!blocks.HasMetaData(b)) continue;
      const char* const name = blocks.GetMetaData(b)->Get(vtkCompositeDataSet::NAME());
      if (name != nullptr && std::string_view(name) == "internalMesh") return blocks.GetBlock(b);
    }
    return nullptr;
  }

  [[nodiscard]] bool has_mesh(const std::string& folder) {
    const std::string points = folder + "constant/polyMesh/points";
    return files_.exists(points) || files_.exists(points + ".gz");
  }

  // Whether a folder has one with results, other than that of the time 0.
  [[nodiscard]] bool has_results(const std::string& folder) {
    const auto* const names = files_.list(folder.substr(0, folder.find('/')));
    return names != nullptr && std::any_of(names->begin(), names->end(), [](const auto& name) {
             return name.ends_with('/') && name != "0/" &&
                    is_digits(name.substr(0, name.find_first_of("./e")));
           });
  }

  Result<void> find_roots() {
    std::vector<std::string> folders;
    const auto* const names = files_.list("");
    if (names == nullptr) return bad_case("the folder of the case cannot be listed");
    bool is_collated = false;
    for (const std::string& name : *names) {
      const std::string_view rest =
          std::string_view(name).substr(std::min(name.size(), processor.size()));
      if (!name.starts_with(processor) || !name.ends_with('/')) continue;
      if (is_digits(rest.substr(0, rest.size() - 1))) folders.push_back(name);
      is_collated = is_collated || rest.starts_with('s');
    }
    const bool whole = has_mesh("");
    if (whole && (folders.empty() || has_results("") || !has_results(folders.front()))) {
      if (!folders.empty()) {
        contents_.notes.push_back("the reconstructed case is shown, not its folders processor*");
      }
      folders = {""};
    } else if (folders.empty()) {
      return bad_case(is_collated
                          ? "the case is decomposed with collated files (processors*), which "
                            "VTK does not read; run reconstructPar"
                          : "'constant/polyMesh/points': no such file; cases of several regions "
                            "are not read");
    } else {
      // processor10 after processor2
      std::sort(folders.begin(), folders.end(), [](const auto& a, const auto& b) {
        return std::pair(a.size(), a) < std::pair(b.size(), b);
      });
      contents_.notes.push_back("united from " + std::to_string(folders.size()) +
                                " folders processor*");
    }
    if (folders.size() > processors_max) {
      return bad_case("more than " + std::to_string(processors_max) + " folders processor*");
    }
    for (std::string& folder : folders) {
      roots_.push_back(std::make_unique<Root>());
      roots_.back()->folder = std::move(folder);
    }
    return {};
  }

  Result<void> find_times() {
    for (const auto& root : roots_) {
      auto& reader = *root->reader;
      reader.SetFileName((std::string(case_root) + root->folder + "case.foam").c_str());
      reader.SetCreateCellToPoint(0);
      reader.SetDecomposePolyhedra(1);
      reader.SetSkipZeroTime(false);
      reader.SetCacheMesh(1);
      reader.SetReadZones(0);
      reader.SetListTimeStepsByControlDict(0);
      auto fine = guarded(files_, [&] { reader.UpdateInformation(); });
      if (!fine) return fine;
      for (int p = 0; p < reader.GetNumberOfPatchArrays(); ++p) {
        const std::string name = reader.GetPatchArrayName(p);
        reader.SetPatchArrayStatus(name.c_str(), name == "internalMesh" ? 1 : 0);
      }
      auto* const names = reader.GetTimeNames();
      auto* const values = reader.GetTimeValues();
      std::vector<double> times;
      for (vtkIdType t = 0; names != nullptr && values != nullptr && t < names->GetNumberOfValues();
           ++t) {
        root->time_names.push_back(names->GetValue(t));
        times.push_back(values->GetValue(t));
      }
      if (times.empty()) return bad_case("the case has no folder of a time, such as 0 or 0.5");
      if (root == roots_.front()) contents_.times = times;
      if (times != contents_.times) {
        return bad_case(in_quotes(root->folder) + " has other times than " +
                        in_quotes(roots_.front()->folder));
      }
    }
    return {};
  }

  Result<void> check_meshes() {
    for (const auto& root : roots_) {
      for (const char* name : {"points", "faces", "owner", "neighbour"}) {
        std::string path = root->folder + "constant/polyMesh/" + name;
        if (!files_.exists(path)) path += ".gz";
        if (!files_.exists(path)) continue;  // VTK says so
        const auto file = files_.open(path);
        if (!file) return file.error();
        const auto header = foam_header_of(**file);
        if (!header) continue;
        if (const auto why = unread_layout_of(*header)) return (*file)->fault(*why);
      }
    }
    return {};
  }

  struct Found {
    CaseField field;
    std::string left_out;  // why
    std::string class_name;
    std::vector<bool> at;  // by step: whether the file is there, in every root
  };

  // Notes the state of every file of a field, so that a later change is noticed.
  Result<void> find_fields() {
    const std::size_t steps = contents_.times.size();
    for (std::size_t s = 0; s < steps; ++s) {
      std::map<std::string, std::size_t> seen;
      for (const auto& root : roots_) {
        const std::string folder = root->folder + root->time_names.at(s);
        const auto* const names = files_.list(folder);
        if (names == nullptr) return bad_case(in_quotes(folder) + " cannot be listed");
        for (const std::string& name : *names) {
          if (name.ends_with('/') || name.front() == '.') continue;
          const std::string field = without_gz(name);
          if (field == name && std::binary_search(names->begin(), names->end(), name + ".gz")) {
            continue;  // counted once
          }
          std::string path = folder;
          path += '/';
          path += name;
          auto done = take_file(path, field);
          if (!done) return done;
          ++seen[field];
        }
      }
      for (auto& [name, found] : found_) {
        found.at.resize(steps);
        found.at[s] = seen.count(name) > 0 && seen.at(name) == roots_.size();
      }
    }
    return {};
  }

  Result<void> take_file(const std::string& path, const std::string& field) {
    const auto file = files_.open(path);
    if (!file) return file.error();
    auto header = foam_header_of(**file);
    const auto [at, is_new] = found_.try_emplace(field);
    if (!header) {
      const bool was_field = !is_new && !at->second.class_name.empty();
      if (was_field) return bad_case(in_quotes(path) + ": " + header.error().message);
      return {};  // not of OpenFOAM
    }
    Found& known = at->second;
    // VTK names a field after the object in its header, and would take a copy for the field itself.
    if (!header->object.empty() && header->object != field) {
      files_.hide(path);
      known.left_out = "has the object " + in_quotes(printable(header->object, 100)) +
                       " in the header of " + in_quotes(path) + "; it must be the file's name";
    }
    if (const auto why = unread_layout_of(*header)) known.left_out = *why;
    if (is_new || known.class_name.empty()) {
      known.class_name = header->class_name;
      known.field.name = field;
      known.field.array = field;
      known.field.units = header->units.value_or("");
    } else if (known.class_name != header->class_name ||
               known.field.units != header->units.value_or("")) {
      return bad_case(in_quotes(path) +
                      " has another class or other dimensions than at another time");
    }
    return {};
  }

  // Fields of all steps. A folder 0, which holds initial values, is left out if a field is missing
  // there only.
  Result<void> choose_fields() {
    const auto begins_later = [](const Found& one) {
      return class_of(one) != nullptr && !one.at.front() &&
             std::all_of(one.at.begin() + 1, one.at.end(), [](bool is_there) { return is_there; });
    };
    const bool is_short = contents_.times.size() > 1 && contents_.times.front() == 0 &&
                          std::any_of(found_.begin(), found_.end(),
                                      [&](const auto& one) { return begins_later(one.second); });
    const std::size_t first = is_short ? 1 : 0;
    if (is_short) {
      contents_.times.erase(contents_.times.begin());
      contents_.notes.push_back(
          "the time 0 is omitted: fields of all later times are missing in its folder");
    }
    for (auto& [name, found] : found_) {
      if (found.class_name.empty()) continue;
      const FieldClass* const kind = class_of(found);
      if (kind == nullptr) {
        contents_.left_out.push_back(
            {name, "has the class " + printable(found.class_name) +
                       "; scalars and vectors of cells and points are supported"});
        continue;
      }
      if (!found.left_out.empty()) {
        contents_.left_out.push_back({name, found.left_out});
        continue;
      }
      const auto absent =
          std::find(found.at.begin() + static_cast<std::ptrdiff_t>(first), found.at.end(), false);
      if (absent != found.at.end()) {
        const auto step = static_cast<std::size_t>(absent - found.at.begin());
        contents_.left_out.push_back(
            {name, "is missing at the time " + roots_.front()->time_names.at(step)});
        continue;
      }
      found.field.components = kind->components;
      found.field.of_cells = kind->of_cells;
      contents_.fields.push_back(found.field);
    }
    return {};
  }

  // VTK omits files that it takes for old ones by their names, such as U_0, p.bak and p~.
  Result<void> leave_out_unlisted() {
    for (const auto& root : roots_) {
      root->reader->SetRefresh();  // without the files that were hidden
      auto fine = guarded(files_, [&] { root->reader->UpdateInformation(); });
      if (!fine) return fine;
    }
    auto& reader = *roots_.front()->reader;
    // It has listed the fields of its first time only.
    if (contents_.times.size() < roots_.front()->time_names.size()) {
      reader.DisableAllCellArrays();
      reader.DisableAllPointArrays();
      auto fine = guarded(files_, [&] { reader.UpdateTimeStep(contents_.times.front()); });
      if (!fine) return fine;
    }
    std::set<std::string> listed;
    for (int a = 0; a < reader.GetNumberOfCellArrays(); ++a) {
      listed.insert(reader.GetCellArrayName(a));
    }
    for (int a = 0; a < reader.GetNumberOfPointArrays(); ++a) {
      listed.insert(reader.GetPointArrayName(a));
    }
    std::vector<CaseField> kept;
    for (CaseField& field : contents_.fields) {
      if (listed.count(field.name) > 0) {
        kept.push_back(std::move(field));
      } else {
        contents_.left_out.push_back({field.name, "has the name of an old or a spare file"});
      }
    }
    contents_.fields = std::move(kept);
    return {};
  }

  static const FieldClass* class_of(const Found& found) {
    const auto* const at =
        std::find_if(field_classes.begin(), field_classes.end(),
                     [&](const FieldClass& one) { return found.class_name == one.name; });
    return at == field_classes.end() ? nullptr : at;
  }

  CaseFiles& files_;
  std::vector<std::unique_ptr<Root>> roots_;
  std::map<std::string, Found> found_;
};

}  // namespace

Result<std::unique_ptr<Case>> open_openfoam(CaseFiles& files) {
  auto out = std::make_unique<OpenFoamCase>(files);
  if (auto done = out->open(); !done) return done.error();
  return std::unique_ptr<Case>(std::move(out));
}

}  // namespace windsplat::vtk_loader
