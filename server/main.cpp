// The program: everything is put together by the commands in server/cli.
#include "server/cli/cli.hpp"

int main(int argc, char** argv) { return windsplat::cli::run(argc, argv); }
