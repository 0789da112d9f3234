// Emulates system calls with a file name inside a confined process: a signal handler replaces the
// kernel.
#pragma once

#include <string>
#include <vector>

#include "server/base/error.hpp"

namespace windsplat::data::loader {

// The system calls that the filter redirects to the handler, as numbered by libseccomp; negative if
// this architecture has no such call.
const std::vector<int>& calls_by_name();

// Installs the handler of SIGSYS; see confine(). socket -1: files of libraries are not available.
Result<void> answer_calls_by_name(int socket, std::vector<std::string> library_folders);

}  // namespace windsplat::data::loader
