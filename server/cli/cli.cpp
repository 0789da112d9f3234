// Runs the chosen command; converts exceptions to exit codes.
#include "server/cli/cli.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <exception>
#include <filesystem>
#include <iostream>
#include <new>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "server/cli/command.hpp"
#include "server/cli/help/suggest.hpp"
#include "server/data/loader/loader.hpp"

namespace windsplat::cli {
namespace {

constexpr const char* description =
    "windsplat draws winds and clouds from a 3-D field, on the CPU, for a browser or a file.\n"
    "Exit codes: 0 ok, 1 failed, 2 usage, 3 bad data, 130 interrupted (animate, convert, study,\n"
    "synth).\n"
    "Where an option names an environment variable, that may set it; the option has precedence.";

// The first option or argument with an empty value, as "--size"; empty if there is none. An empty
// value probably comes from an unset variable, so it is an error.
std::string given_empty(const CLI::App& command) {
  for (const CLI::Option* option : command.get_options()) {
    const auto& values = option->results();
    const bool empty = std::any_of(values.begin(), values.end(),
                                   [](const std::string& value) { return value.empty(); });
    if (empty) return option->get_name();
  }
  return {};
}

// Output of --help and --version is data: failing to write it is a failure.
int print(const CLI::App& app, const CLI::ParseError& wanted) {
  std::ostringstream text;
  app.exit(wanted, text, std::cerr);
  const auto written = write_stdout(text.str());
  return written ? exit_ok : answer(written.error());
}

int run_parsed(CLI::App& app, const Action& chosen, int argc, const char* const* argv) {
  if (argc <= 1) {
    std::cerr << app.help();
    return exit_usage;
  }
  const auto is_meant = [&](const CLI::App* command) { return command->check_name(argv[1]); };
  if (argv[1][0] != '-' && app.get_subcommands(is_meant).empty()) {
    complain(unknown_command(app, argv[1]));
    complain("run with --help to list the commands");
    return exit_usage;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& stop) {  // --help and --version too
    if (stop.get_exit_code() == 0) return print(app, stop);
    const bool has_extras = dynamic_cast<const CLI::ExtrasError*>(&stop) != nullptr;
    const auto unknown = has_extras ? unknown_word(app) : unknown_option(app);
    complain(unknown.value_or(printable(stop.what(), 2000)));
    complain("run with --help for more information");
    return exit_usage;
  }
  if (const std::string empty = given_empty(*app.get_subcommands().front()); !empty.empty()) {
    complain(empty + " has an empty value");
    return exit_usage;
  }
  return chosen();
}

// Resource limits of this process, where known: " (limits: ...)".
std::string memory_limits() {
  struct Limited {
    __rlimit_resource which;
    const char* name;
  };
  std::string text;
  for (const auto& [which, name] :
       {Limited{RLIMIT_AS, "address space, ulimit -v"}, Limited{RLIMIT_DATA, "data, ulimit -d"}}) {
    rlimit now{};
    if (::getrlimit(which, &now) != 0 || now.rlim_cur == RLIM_INFINITY) continue;
    text += (text.empty() ? "" : "; ") + std::to_string(now.rlim_cur / 1024) + " KiB of " + name;
  }
  return text.empty() ? text : " (limited to " + text + ')';
}

// Threads fail to start for lack of stack memory or thread ids.
bool is_shortage(const std::error_code& code) {
  return code == std::errc::resource_unavailable_try_again || code == std::errc::not_enough_memory;
}

std::string shortage(const std::string& what) {
  const std::string limits = memory_limits();
  return limits.empty() ? "out of memory or threads: " + what +
                              "; threads are limited by ulimit -u, TasksMax or pids_limit"
                        : "out of memory: " + what + limits;
}

// The path of another program in the folder of this one; empty if that is not known.
std::string beside_this_program(const char* name) {
  std::error_code fault;
  const auto here = std::filesystem::read_symlink("/proc/self/exe", fault);
  return fault ? std::string() : (here.parent_path() / name).native();
}

std::string text_on_cases() {
  return std::string("Cases of OpenFOAM and EnSight are ") +
         (data::loader::has_case_program() ? "read by windsplat-vtk."
                                           : "not read: windsplat-vtk is not installed.");
}

}  // namespace

int run(int argc, const char* const* argv) {
  // A closed pipe and a file above the permitted size are write errors, which must not kill the
  // process.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  try {
    if (argc == 2 && std::string_view(argv[1]) == "load") return load();
    data::loader::set_program("/proc/self/exe");
    data::loader::set_case_program(beside_this_program("windsplat-vtk"));
    CLI::App app(description, "windsplat");
    app.set_version_flag("--version", "windsplat " WINDSPLAT_VERSION);
    app.footer(text_on_cases());
    app.require_subcommand(1);
    Action chosen;
    add_serve(app, chosen);
    add_render(app, chosen);
    add_animate(app, chosen);
    add_inspect(app, chosen);
    add_synth(app, chosen);
    add_convert(app, chosen);
    add_healthcheck(app, chosen);
    add_study(app, chosen);
    add_help(app, chosen);
    return run_parsed(app, chosen, argc, argv);
  } catch (const std::bad_alloc&) {
    complain("out of memory" + memory_limits());
  } catch (const std::system_error& fault) {
    complain(is_shortage(fault.code()) ? shortage("cannot start a thread")
                                       : "internal error: " + printable(fault.what(), 1000));
  } catch (const std::exception& fault) {
    complain("internal error: " + printable(fault.what(), 1000));
  }
  return exit_failed;
}

}  // namespace windsplat::cli
