// Errors of VTK -> errors of the case.
#include "server/vtk_loader/case.hpp"

#include <exception>
#include <new>

#include "server/vtk_loader/messages.hpp"

namespace windsplat::vtk_loader {

Result<void> guarded(CaseFiles& files, const std::function<void()>& read) {
  std::optional<std::string> said;
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
  const std::string last = files.last_opened();
  const bool is_named = last.empty() || said->find(last) != std::string::npos;
  return make_error(ErrorKind::bad_data,
                    "VTK cannot read it: " + printable(*said, 500) +
                        (is_named ? "" : " (the last file it read is " + in_quotes(last) + ')'));
}

}  // namespace windsplat::vtk_loader
