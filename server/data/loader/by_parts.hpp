// Reads of files that are here in parts: the system calls are redirected to a handler, which has
// the daemon fetch what is missing first.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <utility>

namespace windsplat::data::loader {

// From this number on descriptors are those of files in parts, and reads of them are redirected.
// Before reserve_parts(): none are.
int first_of_parts();
// The last-but-one argument of preadv2 by which the reads of this file are told from those of
// libraries, which are forbidden. The kernel ignores it where offsets have 64 bits.
inline constexpr std::uint64_t mark_of_own_reads = 0x7061'7274'736f'776e;
// Descriptors [first, end) are for files in parts; `socket` leads to the daemon.
void reserve_parts(int first, int end, int socket);
// Notes the number of the parts (FileParts) of an open file, and moves its descriptor there unless
// it is whole. -1: none is left; it is closed.
int place(int descriptor, std::uint64_t number);

// The functions below are async-signal-safe; results are negative errnos.

// A duplicate of a descriptor from first_of_parts() on.
int copy_of_parts(int descriptor);
// read(2), and pread(2) with an offset.
long read_part(int descriptor, void* out, std::size_t count);
long read_part(int descriptor, void* out, std::size_t count, off_t offset);

}  // namespace windsplat::data::loader
