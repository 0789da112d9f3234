// Arguments -> the chosen command; what escapes it -> exit codes.
#include "server/cli/cli.hpp"

#include <csignal>
#include <exception>
#include <iostream>
#include <new>
#include <string_view>

#include "server/cli/command.hpp"
#include "server/data/loader/loader.hpp"

namespace windsplat::cli {
namespace {

constexpr const char* description =
    "windsplat draws winds and clouds from a 3-D field, on the CPU, for a browser or a file.\n"
    "Exit codes: 0 ok, 1 failed, 2 usage, 3 bad data, 130 interrupted (animate, study).\n"
    "An option that names an environment variable may be given by it; the option wins.";

int run_parsed(CLI::App& app, const Action& chosen, int argc, const char* const* argv) {
  if (argc <= 1) {
    std::cerr << app.help();
    return exit_usage;
  }
  const auto is_meant = [&](const CLI::App* command) { return command->check_name(argv[1]); };
  if (argv[1][0] != '-' && app.get_subcommands(is_meant).empty()) {
    complain("there is no command '" + printable(argv[1]) + "'; run with --help for those there");
    return exit_usage;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& stop) {  // --help and --version too
    if (stop.get_exit_code() == 0) return app.exit(stop, std::cout, std::cerr);
    complain(printable(stop.what(), 2000));
    complain("run with --help for more information");
    return exit_usage;
  }
  return chosen();
}

}  // namespace

int run(int argc, const char* const* argv) {
  // A reader that goes away is an error of write, not the end of the process.
  std::signal(SIGPIPE, SIG_IGN);
  try {
    if (argc == 2 && std::string_view(argv[1]) == "load") return load();
    data::loader::set_program("/proc/self/exe");
    CLI::App app(description, "windsplat");
    app.set_version_flag("--version", "windsplat " WINDSPLAT_VERSION);
    app.require_subcommand(1);
    Action chosen;
    add_serve(app, chosen);
    add_render(app, chosen);
    add_animate(app, chosen);
    add_inspect(app, chosen);
    add_synth(app, chosen);
    add_healthcheck(app, chosen);
    add_study(app, chosen);
    return run_parsed(app, chosen, argc, argv);
  } catch (const std::bad_alloc&) {
    complain("the machine has no memory left");
  } catch (const std::exception& fault) {
    complain("internal error: " + printable(fault.what(), 1000));
  }
  return exit_failed;
}

}  // namespace windsplat::cli
