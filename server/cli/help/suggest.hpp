// Messages on words of the command line that are not understood, with the word that was meant.
#pragma once

#include <optional>
#include <string>

namespace CLI {
class App;
}

namespace windsplat::cli {

std::string unknown_command(const CLI::App& app, const std::string& word);

// The first word that is not an option of the chosen command, or an argument too many. Empty: none
// is left over.
std::optional<std::string> unknown_word(const CLI::App& app);

// The same for options alone: a misspelt option is the reason that a required one lacks.
std::optional<std::string> unknown_option(const CLI::App& app);

}  // namespace windsplat::cli
