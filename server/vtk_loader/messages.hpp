// What VTK says: errors and warnings of its readers, which it prints unless they are collected.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace windsplat::vtk_loader {

// Collects what VTK says from now on; call it once.
void collect_messages();

// The first error since the last call, in one line and with the names of files within the case.
// Forgets all messages.
std::optional<std::string> take_error();
// The warnings so far, likewise; forgets them.
std::vector<std::string> take_warnings();

}  // namespace windsplat::vtk_loader
