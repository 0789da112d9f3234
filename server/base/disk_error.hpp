// The one translation of the errors of files to those of the project.
#pragma once

#include <string>

#include "server/base/error.hpp"

namespace windsplat {

// "what: reason" of an errno: out_of_memory if the disk is full or the file too large for it
// (ENOSPC, EDQUOT, EFBIG), otherwise internal.
Error disk_error(int fault, const std::string& what);

}  // namespace windsplat
