// Calls that name a file, inside a confined process: a signal handler replaces the kernel.
#pragma once

#include <string>
#include <vector>

#include "server/base/error.hpp"

namespace windsplat::data::loader {

// The calls that the filter hands to the handler instead of the kernel, as libseccomp numbers them:
// negative where this machine has no such call.
const std::vector<int>& calls_by_name();

// Sets the handler of SIGSYS; see confine(). socket -1: no library's file is asked for.
Result<void> answer_calls_by_name(int socket, std::vector<std::string> library_folders);

}  // namespace windsplat::data::loader
