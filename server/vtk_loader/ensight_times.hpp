// What VTK does not tell of the case file of EnSight Gold: which variable has values at which
// times, and the files that it names.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace windsplat::vtk_loader {

struct EnSightTimes {
  std::map<std::string, std::vector<double>> sets;  // time set -> times, ascending
  std::map<std::string, std::string> set_of;        // key_of() -> time set; none: at each time
  bool has_file_sets = false;                       // several steps in one file
  bool ascends = true;                              // each set, without two equal times

  // Of a variable: nodes and elements may have variables of one name.
  static std::string key_of(const std::string& name, bool of_elements) {
    return (of_elements ? "e " : "n ") + name;
  }

  // The times of the set that most variables have; empty: no variable has one.
  [[nodiscard]] std::vector<double> most_frequent() const;
};

// The sections VARIABLE, TIME and FILE of a case file.
EnSightTimes times_of_case(const std::string& text);

}  // namespace windsplat::vtk_loader
