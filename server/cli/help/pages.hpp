// The options of the program -> completions of shells and manual pages. The text depends on the
// program alone: neither date nor machine.
#pragma once

#include <string>

#include "server/cli/help/command_text.hpp"

namespace windsplat::cli {

std::string bash_completion(const CommandText& program);
std::string zsh_completion(const CommandText& program);
std::string fish_completion(const CommandText& program);

// Manual page of the program (section 1), or of one of its commands, in the macros of man(7).
std::string manual_page(const CommandText& program);
std::string manual_page(const CommandText& program, const CommandText& command);

}  // namespace windsplat::cli
