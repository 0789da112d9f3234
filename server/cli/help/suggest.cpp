#include "server/cli/help/suggest.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <system_error>
#include <vector>

#include "server/base/error.hpp"
#include "server/base/nearest_word.hpp"
#include "server/cli/help/command_text.hpp"

namespace windsplat::cli {
namespace {

constexpr std::size_t option_bytes_max = 64;

const CLI::App& chosen_command(const CLI::App& app) {
  const auto chosen = app.get_subcommands();
  return chosen.empty() ? app : *chosen.front();
}

bool is_option(const std::string& word) { return word.size() > 1 && word.front() == '-'; }

}  // namespace

std::string unknown_command(const CLI::App& app, const std::string& word) {
  std::vector<std::string> names;
  for (const CommandText& command : describe_command(app).commands) names.push_back(command.name);
  return "unknown command '" + printable(word) + "'" + did_you_mean(word, names);
}

std::optional<std::string> unknown_option(const CLI::App& app) {
  const std::vector<std::string> extras = app.remaining(true);
  const auto first = std::find_if(extras.begin(), extras.end(), is_option);
  if (first == extras.end()) return std::nullopt;
  const CLI::App& command = chosen_command(app);
  const std::string word = first->substr(0, std::min(first->find('='), option_bytes_max));
  std::vector<std::string> names;
  for (const OptionText& option : describe_command(command).options) {
    for (const std::string& name : option.names) {
      if (name.starts_with("--")) names.push_back(name);
    }
  }
  const std::string nearest = nearest_word(word, names);
  return "'" + printable(word) + "' is not an option of '" + command.get_name() + "'" +
         (nearest.empty() ? "" : "; did you mean " + nearest + "?");
}

std::optional<std::string> unknown_word(const CLI::App& app) {
  if (auto option = unknown_option(app)) return option;
  const std::vector<std::string> extras = app.remaining(true);
  if (extras.empty()) return std::nullopt;
  const std::string& word = extras.front();
  std::error_code ignored;
  const bool is_file = std::filesystem::exists(word, ignored);
  return "'" + printable(word) + "' is an unexpected argument of '" +
         chosen_command(app).get_name() + "'" +
         (is_file ? "; a pattern of files must be in quotes, as must a list, such as '{a,b}.nc'"
                  : "");
}

}  // namespace windsplat::cli
