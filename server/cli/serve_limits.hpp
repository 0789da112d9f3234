// The options of `serve` that limit what clients may take.
#pragma once

#include <CLI/CLI.hpp>

#include "server/access/limits.hpp"

namespace windsplat::cli {

void add_limit_options(CLI::App& command, net::Limits& limits);

}  // namespace windsplat::cli
