// Files that the daemon's settings name: token, certificate, key, configuration.
#pragma once

#include <string>

#include "server/base/error.hpp"

namespace windsplat::cli {

// The whole of a file that is needed to start or to go on: one that is no regular file, such as a
// pipe, is not waited for. Errors: not_found, invalid, too_large beyond `bytes_max`.
Result<std::string> read_settings_file(const std::string& path, std::size_t bytes_max);

}  // namespace windsplat::cli
