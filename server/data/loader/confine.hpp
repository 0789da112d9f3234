// Sandbox of a loader, applied before it reads a file: limited memory, no capabilities, no files by
// name, no sockets, no other processes. Irreversible, for the whole process.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "server/base/error.hpp"

namespace windsplat::data::loader {

// Private memory beyond a loader's limit, for internal tables of libraries.
inline constexpr std::uint64_t room_of_libraries = std::uint64_t{32} << 20;

struct Confinement {
  std::uint64_t memory_bytes = 0;  // maximum private memory
  // a lower maximum until the daemon allows all of it (Process::allow_memory())
  std::uint64_t opening_bytes = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t files = 0;  // maximum number of open files
  int socket = -1;          // socket to the daemon, which opens the files of libraries
  std::vector<std::string> library_folders;
};

// From now on the process may read, compute and communicate over its open sockets. System calls
// that open or look up a file by name invoke a handler that permits two kinds of names:
// /proc/self/fd/N is a duplicate of that descriptor (InputFile::library_path()), read from its
// beginning; a file in a library folder is requested from the daemon (Kind::ask_library); all
// others yield EACCES. Every other call that is not needed yields EPERM. Errors: internal, if the
// system has no seccomp.
Result<void> confine(Confinement how);

}  // namespace windsplat::data::loader
