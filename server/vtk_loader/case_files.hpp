// The files of a case under the folder /case/, as the functions of the C library that VTK calls see
// them (file_functions.cpp). A loader cannot open files by name: each is opened by the daemon.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/files/files.hpp"

namespace windsplat::vtk_loader {

inline constexpr std::string_view case_root = "/case/";

// Not thread-safe: VTK reads in one thread here.
class CaseFiles {
 public:
  explicit CaseFiles(std::shared_ptr<data::Files> files) : files_(std::move(files)) {}

  // The name within the case of a path below /case/, without "." and ".."; nullopt for other paths,
  // and for those that lead out of the case.
  static std::optional<std::string> name_of(std::string_view path);

  // The files system/* of a decomposed case are also those of each folder processor*.
  Result<std::shared_ptr<const data::InputFile>> open(const std::string& name);
  // Names in a folder of the case, of which folders end in '/'; null if it is none. "": the case.
  const std::vector<std::string>* list(const std::string& folder);
  [[nodiscard]] bool is_folder(const std::string& name);
  [[nodiscard]] bool exists(const std::string& name);

  // Makes VTK's listings omit a file.
  void hide(const std::string& name) { hidden_.insert(name); }
  // The names in a folder without those that are hidden; null if it is none.
  std::optional<std::vector<std::string>> list_shown(const std::string& folder);

  // Opens a file to note its state. Errors: those of Files::open().
  Result<void> note(const std::string& name);
  // The states of all files opened so far.
  [[nodiscard]] std::string identity() const;
  // The first failure since the last call: a file that has changed since it was noted, or that is
  // there and cannot be opened.
  std::optional<Error> take_fault();
  // The names that were opened since the last call, in order.
  std::vector<std::string> take_opened();
  [[nodiscard]] const std::vector<std::string>& opened() const { return opened_; }
  [[nodiscard]] const data::Files& files() const { return *files_; }

 private:
  std::shared_ptr<data::Files> files_;
  std::map<std::string, std::optional<std::vector<std::string>>> folders_;
  std::map<std::string, std::string> states_;  // by name
  std::set<std::string> hidden_;
  std::vector<std::string> opened_;
  std::optional<Error> fault_;
};

// Makes /case/ that of `files`, which must outlive all calls of VTK; null: there is none.
void serve(CaseFiles* files);

}  // namespace windsplat::vtk_loader
