// windsplat help, man and completions: texts about the program, made from its options.
#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "server/cli/command.hpp"
#include "server/cli/help/command_text.hpp"
#include "server/cli/help/pages.hpp"
#include "server/cli/help/suggest.hpp"

namespace windsplat::cli {
namespace {

int print_text(const std::string& text) {
  const auto written = write_stdout(text);
  return written ? exit_ok : answer(written.error());
}

// Calls print(program or command); 2 for an unknown one.
template <class Print>
int for_command(const CLI::App& app, const std::string& name, const Print& print) {
  if (name.empty()) return print(app);
  const auto found =
      app.get_subcommands([&name](const CLI::App* command) { return command->check_name(name); });
  if (!found.empty()) return print(*found.front());
  complain(unknown_command(app, name));
  return exit_usage;
}

int help(const CLI::App& app, const std::string& name) {
  return for_command(app, name, [&app](const CLI::App& command) {
    // App::help() of the program would be that of the command that runs, which is this one.
    return print_text(&command == &app ? app.get_formatter()->make_help(&app, app.get_name(),
                                                                        CLI::AppFormatMode::Normal)
                                       : command.help(app.get_name()));
  });
}

int man(const CLI::App& app, const std::string& name) {
  return for_command(app, name, [&app](const CLI::App& command) {
    const CommandText program = describe_command(app);
    return print_text(&command == &app ? manual_page(program)
                                       : manual_page(program, describe_command(command)));
  });
}

int completions(const CLI::App& app, const std::string& shell) {
  const CommandText program = describe_command(app);
  return print_text(shell == "bash"  ? bash_completion(program)
                    : shell == "zsh" ? zsh_completion(program)
                                     : fish_completion(program));
}

using RunWithText = int (*)(const CLI::App& app, const std::string& argument);

// A command with one argument, which is passed to `run`.
CLI::Option* add_text_command(CLI::App& app, Action& chosen, const char* name,
                              const char* description, const char* argument_name,
                              const char* argument_text, RunWithText run) {
  CLI::App* command = app.add_subcommand(name, description);
  const auto argument = std::make_shared<std::string>();
  CLI::Option* option = command->add_option(argument_name, *argument, argument_text);
  add_verbosity_options(*command);
  command->callback([&chosen, &app, argument, run] {
    chosen = [&app, argument, run] { return run(app, *argument); };
  });
  return option;
}

}  // namespace

void add_help(CLI::App& app, Action& chosen) {
  add_text_command(app, chosen, "help", "Print the options of a command", "command",
                   "A command; default: the list of all", help)
      ->type_name("COMMAND");
  add_text_command(app, chosen, "man", "Print the manual page of a command, for man -l -",
                   "command", "A command; default: that of the program", man)
      ->type_name("COMMAND");
  add_text_command(app, chosen, "completions", "Print the completions for a shell", "shell",
                   "The shell", completions)
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
}

}  // namespace windsplat::cli
