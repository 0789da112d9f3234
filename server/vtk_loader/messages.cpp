// vtkOutputWindow -> lines without the addresses of objects and the lines of VTK's sources.
#include "server/vtk_loader/messages.hpp"

#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>

#include <string_view>

#include "server/base/ascii.hpp"
#include "server/vtk_loader/case_files.hpp"

namespace windsplat::vtk_loader {

namespace {

constexpr std::size_t kept_max = 20;

struct Said {
  std::vector<std::string> errors;
  std::vector<std::string> warnings;
};

Said& said() {
  static Said all;
  return all;
}

// "ERROR: In x.cxx, line 3\nvtkReader (0x55): Cannot open /case/p" -> "Cannot open p"
std::string plain(std::string_view text) {
  if (const auto mark = text.find("): "); mark != std::string_view::npos) {
    text.remove_prefix(mark + 3);
  }
  std::string out;
  while (!text.empty()) {
    if (text.starts_with(case_root)) {
      text.remove_prefix(case_root.size());
      continue;
    }
    const bool blank = is_blank(text.front());
    if (!blank || (!out.empty() && out.back() != ' ')) out += blank ? ' ' : text.front();
    text.remove_prefix(1);
  }
  return std::string(trim(out));
}

class Window final : public vtkOutputWindow {
 public:
  static Window* New();

  void DisplayText(const char* text) override {
    if (text == nullptr) return;
    const auto type = this->GetCurrentMessageType();
    auto& lines = type == MESSAGE_TYPE_ERROR ? said().errors : said().warnings;
    const bool counts = type == MESSAGE_TYPE_ERROR || type == MESSAGE_TYPE_WARNING ||
                        type == MESSAGE_TYPE_GENERIC_WARNING;
    if (counts && lines.size() < kept_max) lines.push_back(plain(text));
  }
};
vtkStandardNewMacro(Window)

}  // namespace

void collect_messages() {
  const vtkNew<Window> window;
  vtkOutputWindow::SetInstance(window);
}

std::optional<std::string> take_error() {
  std::optional<std::string> out;
  if (!said().errors.empty()) out = said().errors.front();
  said() = {};
  return out;
}

std::vector<std::string> take_warnings() {
  std::vector<std::string> out;
  out.swap(said().warnings);
  return out;
}

}  // namespace windsplat::vtk_loader
