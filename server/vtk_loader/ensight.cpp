// Cases of EnSight Gold by vtkGenericEnSightReader, which finds out the version and whether the
// files are binary.
#include <vtkDataArraySelection.h>
#include <vtkDataSet.h>
#include <vtkGenericEnSightReader.h>
#include <vtkInformation.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkNew.h>
#include <vtkStreamingDemandDrivenPipeline.h>

#include <algorithm>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "server/data/files/pattern.hpp"
#include "server/vtk_loader/case.hpp"
#include "server/vtk_loader/ensight_check.hpp"
#include "server/vtk_loader/ensight_times.hpp"
#include "server/vtk_loader/parts.hpp"

namespace windsplat::vtk_loader {

namespace {

// The types of variables, as GetVariableType() numbers them.
enum VariableType {
  scalar_per_node = 0,
  vector_per_node = 1,
  scalar_per_element = 3,
  vector_per_element = 4
};

class EnSightCase final : public Case {
 public:
  explicit EnSightCase(CaseFiles& files) : files_(files) {}

  Result<void> open() {
    const std::string name = files_.files().location().members.front().name;
    const auto text = text_of(name);
    if (!text) return text.error();
    const EnSightTimes times = times_of_case(*text);
    // VTK does not return from some of them.
    if (times.has_file_sets) return bad_case("has several steps in one file, which is not read");
    if (!times.ascends) return bad_case("has time values that are no ascending numbers");
    if (auto done = note_files(*text); !done) return done;
    reader_->SetCaseFileName((std::string(case_root) + name).c_str());
    reader_->ReadAllVariablesOff();
    if (auto fine = guarded(files_, [&] { reader_->UpdateInformation(); }); !fine) return fine;
    const int version = reader_->GetEnSightVersion();
    if (version != vtkGenericEnSightReader::ENSIGHT_GOLD &&
        version != vtkGenericEnSightReader::ENSIGHT_GOLD_BINARY) {
      return bad_case("is no case of EnSight Gold; EnSight 6 and lists of servers are not read");
    }
    contents_.format = version == vtkGenericEnSightReader::ENSIGHT_GOLD ? "EnSight Gold (ASCII)"
                                                                        : "EnSight Gold (binary)";
    find_times(times);
    find_fields();
    leave_out_other_times(times);
    give_names();
    return {};
  }

  Result<Parts> read(std::size_t step, const CaseField* field) override {
    reader_->GetPointDataArraySelection()->DisableAllArrays();
    reader_->GetCellDataArraySelection()->DisableAllArrays();
    if (field != nullptr && field->of_cells) reader_->SetCellArrayStatus(field->array.c_str(), 1);
    if (field != nullptr && !field->of_cells) reader_->SetPointArrayStatus(field->array.c_str(), 1);
    const auto fine = guarded(files_, [&] {
      if (is_timed_) {
        reader_->UpdateTimeStep(contents_.times.at(step));
      } else {
        reader_->Update();
      }
    });
    if (!fine) {
      // Marks that VTK does not know say more than what it says of their lines.
      auto marked = check_opened({}, field);
      return marked ? fine.error() : marked.error();
    }
    Parts out;
    vtkMultiBlockDataSet* const blocks = reader_->GetOutput();
    for (unsigned b = 0; blocks != nullptr && b < blocks->GetNumberOfBlocks(); ++b) {
      auto* const part = vtkDataSet::SafeDownCast(blocks->GetBlock(b));
      if (part == nullptr || part->GetNumberOfCells() == 0) continue;
      vtkSmartPointer<vtkDataSet> kept;
      kept.TakeReference(part->NewInstance());
      kept->ShallowCopy(part);
      out.push_back(kept);
    }
    if (out.empty()) {
      return bad_case("has no part with cells that VTK reads (the last file it read is " +
                      in_quotes(files_.opened().empty() ? "" : files_.opened().back()) + ')');
    }
    if (auto fine = check_opened(out, field); !fine) return fine.error();
    return out;
  }

 private:
  Result<std::string> text_of(const std::string& name) {
    const auto file = files_.open(name);
    if (!file) return file.error();
    constexpr std::size_t case_bytes_max = std::size_t{1} << 20;
    return (*file)->head(case_bytes_max);
  }

  // The reader has the times of all sets together.
  void find_times(const EnSightTimes& times) {
    auto* const about = reader_->GetOutputInformation(0);
    auto* const key = vtkStreamingDemandDrivenPipeline::TIME_STEPS();
    if (about != nullptr && about->Has(key)) {
      contents_.times.assign(about->Get(key), about->Get(key) + about->Length(key));
      std::sort(contents_.times.begin(), contents_.times.end());
    }
    is_timed_ = !contents_.times.empty();
    if (auto most = times.most_frequent(); is_timed_ && !most.empty()) contents_.times = most;
    if (!is_timed_) contents_.times = {0};
  }

  // Checks what VTK does not, of the files that it opened for these parts.
  Result<void> check_opened(const Parts& parts, const CaseField* field) {
    std::uint64_t geometry = 0;  // lines of numbers
    std::uint64_t values = 0;
    for (const auto& part : parts) {
      const auto points = static_cast<std::uint64_t>(part->GetNumberOfPoints());
      const auto cells = static_cast<std::uint64_t>(part->GetNumberOfCells());
      // Numbers of the part, its points and its elements; three coordinates; a line for each cell.
      if (part->IsA("vtkUnstructuredGrid") != 0) geometry += 3 + 3 * points + cells;
      const bool has_field = field != nullptr && array_of(*part, *field) != nullptr;
      if (!has_field) continue;
      const auto components = static_cast<std::uint64_t>(field->components);
      values += 1 + components * (field->of_cells ? cells : points);
    }
    const bool is_text = reader_->GetEnSightVersion() == vtkGenericEnSightReader::ENSIGHT_GOLD;
    std::vector<std::string> names = files_.take_opened();
    std::sort(names.begin(), names.end());
    names.erase(std::unique(names.begin(), names.end()), names.end());
    for (const std::string& name : names) {
      if (name == files_.files().location().members.front().name) continue;
      const bool is_model = data::alternative_matching({model_}, name) >= 0;
      if (!is_model && field == nullptr) continue;
      const auto file = files_.open(name);
      if (!file) return file.error();
      auto fine = check_ensight(**file, !is_text ? 0 : is_model ? geometry : values);
      if (!fine) return fine;
    }
    return {};
  }

  void find_fields() {
    // The reader of the version that was found holds the variables.
    vtkGenericEnSightReader* const inner = reader_->GetReader();
    if (inner == nullptr) return;
    for (int v = 0; v < inner->GetNumberOfVariables(); ++v) {
      const char* const name = inner->GetDescription(v);
      if (name == nullptr) continue;
      const int type = inner->GetVariableType(v);
      const bool is_scalar = type == scalar_per_node || type == scalar_per_element;
      if (!is_scalar && type != vector_per_node && type != vector_per_element) {
        contents_.left_out.push_back(
            {name, "is neither a scalar nor a vector of nodes or elements"});
        continue;
      }
      const bool of_cells = type == scalar_per_element || type == vector_per_element;
      contents_.fields.push_back({name, name, is_scalar ? 1 : 3, of_cells, ""});
    }
    for (int v = 0; v < inner->GetNumberOfComplexVariables(); ++v) {
      if (const char* const name = inner->GetComplexDescription(v)) {
        contents_.left_out.push_back({name, "is complex"});
      }
    }
  }

  // VTK would hold the values of the time before.
  void leave_out_other_times(const EnSightTimes& times) {
    const auto has_others = [&](const CaseField& field) {
      const auto set = times.set_of.find(EnSightTimes::key_of(field.name, field.of_cells));
      const auto own = set == times.set_of.end() ? times.sets.end() : times.sets.find(set->second);
      if (own == times.sets.end() || own->second == contents_.times) return false;
      contents_.left_out.push_back(
          {field.name, "has other times than most variables: time set " + set->second});
      return true;
    };
    auto& fields = contents_.fields;
    fields.erase(std::remove_if(fields.begin(), fields.end(), has_others), fields.end());
  }

  // A variable of elements has the name of one of nodes with "_of_elements".
  void give_names() {
    std::vector<CaseField> kept;
    std::set<std::pair<std::string, bool>> seen;
    std::set<std::string> names;
    std::stable_partition(contents_.fields.begin(), contents_.fields.end(),
                          [](const CaseField& field) { return !field.of_cells; });
    for (CaseField& field : contents_.fields) {
      if (!seen.emplace(field.name, field.of_cells).second) {
        contents_.left_out.push_back({field.name, "has the name of a variable before it"});
        continue;
      }
      field.array = field.name;
      if (names.count(field.name) > 0) field.name += "_of_elements";
      while (!names.insert(field.name).second) field.name += '_';
      kept.push_back(std::move(field));
    }
    contents_.fields = std::move(kept);
  }

  // Notes the states of all files that the case file names, of all steps.
  Result<void> note_files(const std::string& text) {
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t end = std::min(text.find('\n', at), text.size());
      std::string line = text.substr(at, end - at);
      at = end + 1;
      while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.pop_back();
      const auto colon = line.find(':');
      if (colon == std::string::npos) continue;
      const std::string last = line.substr(line.find_last_of(": \t\"") + 1);
      if (last.empty()) continue;
      if (line.starts_with("model:")) {
        model_ = CaseFiles::name_of(std::string(case_root) + last).value_or("");
      }
      if (auto done = note_matching(last); !done) return done;
    }
    return {};
  }

  Result<void> note_matching(const std::string& pattern) {
    const auto plain = CaseFiles::name_of(std::string(case_root) + pattern);
    if (!plain || pattern.starts_with('/')) {
      return bad_case("refers to " + in_quotes(pattern) +
                      ", which lies outside the folder of the case");
    }
    const auto slash = plain->rfind('/');
    const std::string folder = slash == std::string::npos ? "" : plain->substr(0, slash);
    const std::string last = plain->substr(folder.empty() ? 0 : folder.size() + 1);
    const auto* const names = files_.list(folder);
    if (names == nullptr) return {};
    for (const std::string& found : *names) {
      if (found.ends_with('/') || data::alternative_matching({last}, found) < 0) continue;
      std::string whole = folder;
      if (!whole.empty()) whole += '/';
      whole += found;
      if (auto done = files_.note(whole); !done) return done;
    }
    return {};
  }

  CaseFiles& files_;
  vtkNew<vtkGenericEnSightReader> reader_;
  bool is_timed_ = false;
  std::string model_;  // name or pattern of the geometry files
};

}  // namespace

Result<std::unique_ptr<Case>> open_ensight(CaseFiles& files) {
  auto out = std::make_unique<EnSightCase>(files);
  if (auto done = out->open(); !done) return done.error();
  return std::unique_ptr<Case>(std::move(out));
}

}  // namespace windsplat::vtk_loader
