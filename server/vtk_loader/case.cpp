// Errors of VTK -> errors of the case.
#include "server/vtk_loader/case.hpp"

#include <algorithm>
#include <exception>
#include <new>

#include "server/vtk_loader/messages.hpp"

namespace windsplat::vtk_loader {

Result<void> guarded(CaseFiles& files, const std::function<void()>& read) {
  std::optional<std::string> said;
  static_cast<void>(files.take_opened());
  try {
    read();
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& fault) {
    said = fault.what();
  }
  auto fault = files.take_fault();
  if (auto first = take_error()) said = std::move(first);
  if (fault) return std::move(*fault);
  if (!said) return {};
  const auto& opened = files.opened();
  const bool is_named =
      opened.empty() || std::any_of(opened.begin(), opened.end(), [&](const std::string& name) {
        return said->find(name) != std::string::npos;
      });
  const std::string last =
      is_named ? "" : " (the last file it read is " + in_quotes(opened.back()) + ')';
  return make_error(ErrorKind::bad_data, "VTK cannot read it: " + printable(*said, 500) + last);
}

}  // namespace windsplat::vtk_loader
