// Merges options from the command line, the environment and a JSON file, in this precedence. The
// options themselves are defined by CLI11 only.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "server/base/error.hpp"

namespace windsplat::cli {

// Copies to `command` the options that were given to `given`, a command with the same options, on
// the command line and in the environment.
void give_again(const CLI::App& given, CLI::App& command);

// Sets the options that were not given to the values of the file. Errors name the file: those of
// reading it and of parse_config; invalid, with the pointer, for an unknown option, a value of the
// wrong type or out of range.
Result<void> apply_config(CLI::App& command, const std::string& path);

// Names, without leading dashes, of options with different values.
std::vector<std::string> changed_options(const CLI::App& before, const CLI::App& after);

}  // namespace windsplat::cli
