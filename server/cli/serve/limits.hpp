// The options of `serve` that limit the usage of clients.
#pragma once

#include <CLI/CLI.hpp>

#include "server/access/limits.hpp"

namespace windsplat::cli {

void add_limit_options(CLI::App& command, access::Limits& limits);

}  // namespace windsplat::cli
