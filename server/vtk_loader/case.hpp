// A case: its steps, fields, and the data of a step as VTK reads them.
#pragma once

#include <vtkDataSet.h>
#include <vtkSmartPointer.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/vtk_loader/case_files.hpp"

namespace windsplat::vtk_loader {

struct CaseField {
  std::string name;
  std::string array;   // its name in VTK
  int components = 1;  // 1 or 3
  bool of_cells = false;
  std::string units;  // as in CF ("m s-1", "1"); empty: not known
};

struct CaseContents {
  std::string format;         // "OpenFOAM"
  std::vector<double> times;  // at least one
  std::string time_units;     // empty: not known
  std::string length_units;   // of the axes, likewise
  std::vector<CaseField> fields;
  std::vector<data::LeftOut> left_out;
  std::vector<std::string> notes;
};

inline Error bad_case(const std::string& what) { return make_error(ErrorKind::bad_data, what); }

using Parts = std::vector<vtkSmartPointer<vtkDataSet>>;

class Case {
 public:
  virtual ~Case() = default;
  [[nodiscard]] const CaseContents& contents() const { return contents_; }
  // The parts of the mesh at a step, with the values of `field` if it is not null. Points and cells
  // of a part are the same objects as before if they have not changed. Errors: bad_data.
  virtual Result<Parts> read(std::size_t step, const CaseField* field) = 0;

 protected:
  CaseContents contents_;
};

// Reads what is needed to describe the case. `files` are those of /case/. Errors: bad_data.
Result<std::unique_ptr<Case>> open_openfoam(CaseFiles& files);
Result<std::unique_ptr<Case>> open_ensight(CaseFiles& files);

// Calls what has VTK read. Errors: bad_data with the first error of VTK or of the files, and the
// file that VTK read last.
Result<void> guarded(CaseFiles& files, const std::function<void()>& read);

}  // namespace windsplat::vtk_loader
