// Completions of bash, zsh and fish.
#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "server/cli/help/pages.hpp"
#include "server/data/samples/samples.hpp"

namespace windsplat::cli {
namespace {

std::string joined(const std::vector<std::string>& words, std::string_view between = " ") {
  std::string out;
  for (const std::string& word : words) out.append(out.empty() ? "" : between).append(word);
  return out;
}

std::vector<std::string> names_of(const std::vector<CommandText>& commands) {
  std::vector<std::string> out;
  out.reserve(commands.size());
  for (const CommandText& command : commands) out.push_back(command.name);
  return out;
}

std::vector<std::string> option_names(const CommandText& command) {
  std::vector<std::string> out;
  for (const OptionText& option : command.options) {
    out.insert(out.end(), option.names.begin(), option.names.end());
  }
  return out;
}

// Words that a value may be; files come besides, by its kind.
std::vector<std::string> words_of(const OptionText& option, const CommandText& program) {
  switch (option.kind) {
    case ValueKind::choice:
      return option.choices;
    case ValueKind::dataset:
      return data::sample_names();
    case ValueKind::command:
      return names_of(program.commands);
    case ValueKind::none:
    case ValueKind::file:
    case ValueKind::folder:
    case ValueKind::other:
      break;
  }
  return {};
}

// --- bash ---------------------------------------------------------------------------------------

std::string bash_values(const OptionText& option, const CommandText& program) {
  const std::string words = joined(words_of(option, program));
  switch (option.kind) {
    case ValueKind::choice:
    case ValueKind::command:
      return "_windsplat_words '" + words + "'";
    case ValueKind::dataset:
      return "_windsplat_files -f '" + words + "'";
    case ValueKind::file:
      return "_windsplat_files -f";
    case ValueKind::folder:
      return "_windsplat_files -d";
    case ValueKind::none:
    case ValueKind::other:
      break;
  }
  return ":";
}

std::string bash_command(const CommandText& command, const CommandText& program) {
  std::string out = "    " + command.name + ")\n      case $previous in\n";
  std::string arguments;
  for (const OptionText& option : command.options) {
    if (option.is_argument()) {
      if (arguments.empty()) arguments = bash_values(option, program);
    } else if (option.kind != ValueKind::none) {
      out += "        " + joined(option.names, "|") + ") " + bash_values(option, program) +
             "; return ;;\n";
    }
  }
  out += "      esac\n";
  out += "      case $current in\n        -*) _windsplat_words '" + joined(option_names(command)) +
         "' ;;\n        *) " + (arguments.empty() ? ":" : arguments) +
         " ;;\n      esac\n      ;;\n";
  return out;
}

constexpr const char* bash_head =
    R"(# Completion of windsplat for bash, made by `windsplat completions bash`.

_windsplat_words() {
  mapfile -t COMPREPLY < <(compgen -W "$1" -- "$current")
}

# Files (-f) or folders (-d), and words besides.
_windsplat_files() {
  compopt -o filenames 2>/dev/null
  mapfile -t COMPREPLY < <(compgen -W "${2-}" -- "$current"; compgen "$1" -- "$current")
}

_windsplat() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]} command= i
  COMPREPLY=()
  # bash divides --option=value into three words.
  if [[ $current == = ]]; then
    current=
  elif [[ $previous == = ]]; then
    previous=${COMP_WORDS[COMP_CWORD-2]}
  fi
  for ((i = 1; i < COMP_CWORD; ++i)); do
    if [[ ${COMP_WORDS[i]} != -* ]]; then
      command=${COMP_WORDS[i]}
      break
    fi
  done
  case $command in
)";

// --- zsh ----------------------------------------------------------------------------------------

// Within single quotes, and where [ ] : \ have a meaning.
std::string zsh_text(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '\'') {
      out += "'\\''";
    } else if (c == '\n') {
      out += ' ';
    } else {
      if (std::string_view("[]:\\").find(c) != std::string_view::npos) out += '\\';
      out += c;
    }
  }
  return out;
}

std::string zsh_action(const OptionText& option, const CommandText& program) {
  const std::string words = joined(words_of(option, program));
  switch (option.kind) {
    case ValueKind::choice:
    case ValueKind::command:
      return "(" + words + ")";
    case ValueKind::dataset:
      return "{_alternative \"samples:sample:(" + words + ")\" \"files:file:_files\"}";
    case ValueKind::file:
      return "_files";
    case ValueKind::folder:
      return "_files -/";
    case ValueKind::none:
    case ValueKind::other:
      break;
  }
  return " ";
}

std::string zsh_option(const OptionText& option, const CommandText& program) {
  const std::string value = option.kind == ValueKind::none
                                ? ""
                                : ":" + zsh_text(option.value) + ":" + zsh_action(option, program);
  const std::string text = "[" + zsh_text(option.description) + "]" + value + "' \\\n";
  std::string out;
  for (const std::string& name : option.names) {
    // A name excludes the others of its option unless it may be repeated.
    out += option.repeats ? "        '*" : "        '(" + joined(option.names) + ")";
    out += name + text;
  }
  return out;
}

// --- fish ---------------------------------------------------------------------------------------

std::string fish_text(std::string_view text) {
  std::string out = "'";
  for (const char c : text) {
    if (c == '\'' || c == '\\') out += '\\';
    out += c == '\n' ? ' ' : c;
  }
  return out + "'";
}

std::string fish_value(const OptionText& option, const CommandText& program) {
  const std::string words = joined(words_of(option, program));
  switch (option.kind) {
    case ValueKind::none:
      return "";
    case ValueKind::choice:
    case ValueKind::command:
      return " -x -a " + fish_text(words);
    case ValueKind::dataset:
      return " -r -F -a " + fish_text(words);
    case ValueKind::file:
      return " -r -F";
    case ValueKind::folder:
      return " -x -a '(__fish_complete_directories)'";
    case ValueKind::other:
      break;
  }
  return " -x";
}

std::string fish_option(const OptionText& option, const std::string& condition,
                        const CommandText& program) {
  std::string out = "complete -c windsplat -n " + fish_text(condition);
  if (option.is_argument()) {
    const std::string words = joined(words_of(option, program));
    const bool files = option.kind == ValueKind::dataset || option.kind == ValueKind::file;
    out += files ? " -F" : " -f";
    return words.empty() ? out + "\n" : out + " -a " + fish_text(words) + "\n";
  }
  for (const std::string& name : option.names) {
    out += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
  }
  return out + fish_value(option, program) + " -d " + fish_text(option.description) + "\n";
}

}  // namespace

std::string bash_completion(const CommandText& program) {
  std::string out = bash_head;
  out += "    '') _windsplat_words '" + joined(names_of(program.commands)) + " " +
         joined(option_names(program)) + "' ;;\n";
  for (const CommandText& command : program.commands) out += bash_command(command, program);
  return out + "  esac\n}\n\ncomplete -F _windsplat windsplat\n";
}

std::string zsh_completion(const CommandText& program) {
  std::string out =
      "#compdef windsplat\n"
      "# Completion of windsplat for zsh, made by `windsplat completions zsh`.\n\n"
      "_windsplat() {\n  local context state state_descr line\n  typeset -A opt_args\n"
      "  _arguments -C \\\n";
  for (const OptionText& option : program.options) out += zsh_option(option, program);
  out +=
      "        '1:command:->command' \\\n        '*::argument:->argument'\n"
      "  case $state in\n    command)\n      local -a commands=(\n";
  for (const CommandText& command : program.commands) {
    out += "        '" + command.name + ":" + zsh_text(command.description) + "'\n";
  }
  out +=
      "      )\n      _describe command commands\n      ;;\n    argument)\n"
      "      case ${line[1]} in\n";
  for (const CommandText& command : program.commands) {
    out += "        " + command.name + ")\n          _arguments -S \\\n";
    int place = 0;
    for (const OptionText& option : command.options) {
      if (!option.is_argument()) {
        out += zsh_option(option, program);
        continue;
      }
      out += option.repeats ? "        '*" : "        '" + std::to_string(++place);
      out += ":" + zsh_text(option.value) + ":" + zsh_action(option, program) + "' \\\n";
    }
    out += "          ;;\n";
  }
  return out +
         "      esac\n      ;;\n  esac\n}\n\n"
         "if [[ $funcstack[1] == _windsplat ]]; then\n  _windsplat \"$@\"\nelse\n"
         "  compdef _windsplat windsplat\nfi\n";
}

std::string fish_completion(const CommandText& program) {
  std::string out =
      "# Completion of windsplat for fish, made by `windsplat completions fish`.\n"
      "complete -c windsplat -f\n";
  for (const OptionText& option : program.options) {
    out += fish_option(option, "__fish_use_subcommand", program);
  }
  for (const CommandText& command : program.commands) {
    out += "complete -c windsplat -n '__fish_use_subcommand' -a " + command.name + " -d " +
           fish_text(command.description) + "\n";
  }
  for (const CommandText& command : program.commands) {
    const std::string condition = "__fish_seen_subcommand_from " + command.name;
    for (const OptionText& option : command.options) {
      out += fish_option(option, condition, program);
    }
  }
  return out;
}

}  // namespace windsplat::cli
