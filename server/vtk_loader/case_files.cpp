// Names below /case/ -> Files.
#include "server/vtk_loader/case_files.hpp"

#include <algorithm>
#include <iterator>

namespace windsplat::vtk_loader {

namespace {

std::string parent_of(const std::string& name) {
  const auto slash = name.rfind('/');
  return slash == std::string::npos ? "" : name.substr(0, slash);
}

// "processor3/system/controlDict" -> "system/controlDict"
std::string shared_name(const std::string& name) {
  constexpr std::string_view folder = "processor";
  const auto slash = name.find('/');
  const bool is_shared = name.starts_with(folder) && slash != std::string::npos &&
                         std::string_view(name).substr(slash + 1).starts_with("system");
  return is_shared ? name.substr(slash + 1) : name;
}

}  // namespace

std::optional<std::string> CaseFiles::name_of(std::string_view path) {
  if (path.starts_with(case_root)) {
    path.remove_prefix(case_root.size());
  } else if (path == case_root.substr(0, case_root.size() - 1)) {
    path = {};
  } else {
    return {};
  }
  std::string out;
  while (!path.empty()) {
    const auto end = std::min(path.find('/'), path.size());
    const std::string_view part = path.substr(0, end);
    path.remove_prefix(std::min(end + 1, path.size()));
    if (part.empty() || part == ".") continue;
    if (part == "..") {
      if (out.empty()) return {};
      out = parent_of(out);
      continue;
    }
    if (!out.empty()) out += '/';
    out += part;
  }
  return shared_name(out);
}

Result<std::shared_ptr<const data::InputFile>> CaseFiles::open(const std::string& name) {
  auto file = files_->open(name);
  if (!file) {
    if (!fault_ && file.error().kind != ErrorKind::not_found) fault_ = file.error();
    return file;
  }
  opened_.push_back(name);
  const auto [known, is_new] = states_.try_emplace(name, (*file)->identity());
  if (!is_new && known->second != (*file)->identity() && !fault_) {
    fault_ = (*file)->fault("has changed since the case was opened; open it again");
  }
  return file;
}

const std::vector<std::string>* CaseFiles::list(const std::string& folder) {
  const auto [at, is_new] = folders_.try_emplace(folder);
  if (is_new) {
    if (auto names = files_->list(folder)) at->second = std::move(*names);
  }
  return at->second ? &*at->second : nullptr;
}

std::optional<std::vector<std::string>> CaseFiles::list_shown(const std::string& folder) {
  const auto* const names = list(folder);
  if (names == nullptr) return {};
  std::vector<std::string> out;
  const std::string begin = folder.empty() ? "" : folder + '/';
  std::copy_if(names->begin(), names->end(), std::back_inserter(out),
               [&](const std::string& name) { return hidden_.count(begin + name) == 0; });
  return out;
}

bool CaseFiles::exists(const std::string& name) {
  if (name.empty()) return true;
  const auto* const names = list(parent_of(name));
  if (names == nullptr) return false;
  const std::string last = name.substr(name.rfind('/') + 1);
  return std::binary_search(names->begin(), names->end(), last) ||
         std::binary_search(names->begin(), names->end(), last + '/');
}

bool CaseFiles::is_folder(const std::string& name) { return exists(name) && list(name) != nullptr; }

Result<void> CaseFiles::note(const std::string& name) {
  const auto file = open(name);
  if (file) return {};
  return file.error();
}

std::string CaseFiles::identity() const {
  std::string out;
  for (const auto& [name, state] : states_) {
    out += name;
    out += '=';
    out += state;
    out += '\n';
  }
  return out;
}

std::vector<std::string> CaseFiles::take_opened() {
  std::vector<std::string> out;
  out.swap(opened_);
  return out;
}

std::optional<Error> CaseFiles::take_fault() {
  std::optional<Error> out;
  out.swap(fault_);
  return out;
}

}  // namespace windsplat::vtk_loader
