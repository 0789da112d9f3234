// The command line: arguments -> one command -> exit code.
#pragma once

namespace windsplat::cli {

// Exit codes: 0 success, 1 failure, 2 usage, 3 bad data. Data is written to stdout, messages to
// stderr.
int run(int argc, const char* const* argv);

}  // namespace windsplat::cli
