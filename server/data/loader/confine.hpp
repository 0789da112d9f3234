// What a loader gives up before it looks at a file: memory beyond a bound, all capabilities, files
// by name, sockets, other processes. One way, for the whole process, until its end.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "server/base/error.hpp"

namespace windsplat::data::loader {

// Private memory beyond what a loader is allowed, for the libraries' own tables.
inline constexpr std::uint64_t room_of_libraries = std::uint64_t{32} << 20;

struct Confinement {
  std::uint64_t memory_bytes = 0;  // private memory, the most that may ever be taken
  // Of that before the daemon allows more (Process::allow_memory()).
  std::uint64_t opening_bytes = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t files = 0;  // open at a time
  int socket = -1;          // to the daemon, which is asked for files of libraries
  std::vector<std::string> library_folders;
};

// From here on the process may read, compute and talk over the sockets it has. Whatever opens or
// looks up a file by name meets a handler that knows two kinds of names: /proc/self/fd/N is a
// duplicate of that descriptor (InputFile::library_path()), read from its begin; what lies in a
// library folder is asked of the daemon (Kind::ask_library); all else is EACCES. Everything else
// that is not needed is EPERM. Errors: internal, where the system has no seccomp.
Result<void> confine(Confinement how);

}  // namespace windsplat::data::loader
