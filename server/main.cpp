// The program: everything is put together by the commands in server/cli.
#include <cstdlib>  // defines __GLIBC__ where that is the library

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "server/cli/cli.hpp"

namespace {

// Large blocks come from the system and go back to it at once. Left to itself, glibc keeps ever
// larger ones for later, scattered among those in use: after a file is read, twice its data.
void return_large_blocks() {
#ifdef __GLIBC__
  constexpr int block_bytes = 1 << 20;
  mallopt(M_MMAP_THRESHOLD, block_bytes);
  mallopt(M_TRIM_THRESHOLD, 2 * block_bytes);
#endif
}

}  // namespace

int main(int argc, char** argv) {
  return_large_blocks();
  return windsplat::cli::run(argc, argv);
}
