// The command line: arguments -> one command -> exit code.
#pragma once

namespace windsplat::cli {

// Exit codes: 0 ok, 1 failed, 2 usage, 3 bad data. Data goes to stdout, messages to stderr.
int run(int argc, const char* const* argv);

}  // namespace windsplat::cli
