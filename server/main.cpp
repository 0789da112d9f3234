// The program; server/cli assembles it from the commands.
#include <cstdlib>  // defines __GLIBC__ if the C library is glibc

#ifdef __GLIBC__
#include <malloc.h>
#include <sys/resource.h>
#endif

#include "server/cli/cli.hpp"

namespace {

// Map large blocks individually, so that they are returned to the system when freed. Otherwise
// glibc raises its threshold and keeps large free blocks between blocks in use: after reading a
// file, twice the size of its data.
void return_large_blocks() {
#ifdef __GLIBC__
  constexpr int block_bytes = 1 << 20;
  mallopt(M_MMAP_THRESHOLD, block_bytes);
  mallopt(M_TRIM_THRESHOLD, 2 * block_bytes);
#endif
}

// glibc reserves 64 MiB of addresses for each thread that allocates. Where addresses are limited
// (ulimit -v), threads share one heap: otherwise the reserves alone reach the limit, and the
// allocations of other threads fail.
void share_heap_if_addresses_are_limited() {
#ifdef __GLIBC__
  rlimit addresses{};
  if (getrlimit(RLIMIT_AS, &addresses) == 0 && addresses.rlim_cur != RLIM_INFINITY) {
    mallopt(M_ARENA_MAX, 1);
  }
#endif
}

}  // namespace

int main(int argc, char** argv) {
  return_large_blocks();
  share_heap_if_addresses_are_limited();
  return windsplat::cli::run(argc, argv);
}
