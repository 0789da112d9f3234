// The App of a command -> its options as plain values, from which completions, manual pages and
// suggestions are made. They are thus those of the program itself.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace windsplat::cli {

// What a value is, for completions.
enum class ValueKind { none, choice, file, folder, dataset, command, other };

struct OptionText {
  std::vector<std::string> names;    // "-o", "--output"; empty: an argument
  std::string value;                 // "FILE"; empty: a flag
  ValueKind kind = ValueKind::none;  // none: a flag
  std::vector<std::string> choices;  // of ValueKind::choice
  std::string limits;                // "1 to 100"; empty: none
  std::string description;
  std::string preset;       // the default value; empty: none, or the description says it
  std::string environment;  // a variable that sets it; empty: none
  std::string group;        // a heading
  bool required = false;
  bool repeats = false;

  [[nodiscard]] bool is_argument() const { return names.empty(); }
};

struct CommandText {
  std::string name;         // "windsplat" or "render"
  std::string description;  // of "windsplat" with further lines
  std::vector<OptionText> options;
  std::vector<CommandText> commands;  // of "windsplat"
};

CommandText describe_command(const CLI::App& app);

}  // namespace windsplat::cli
