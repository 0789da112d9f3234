// What a loader gives up before it looks at a file: memory beyond a bound, files by name, sockets,
// other processes. One way, for the whole process, until its end.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/base/error.hpp"

namespace windsplat::data::loader {

struct Confinement {
  std::uint64_t memory_bytes = 0;  // private memory that may still be taken
  std::uint64_t files = 0;         // open at a time
  int socket = -1;                 // to the daemon, which is asked for files of libraries
  std::vector<std::string> library_folders;
};

// From here on the process may read, compute and talk over the sockets it has. Whatever opens or
// looks up a file by name meets a handler that knows two kinds of names: /proc/self/fd/N is a
// duplicate of that descriptor (InputFile::library_path()), read from its begin; what lies in a
// library folder is asked of the daemon (Kind::ask_library); all else is EACCES. Everything else
// that is not needed is EPERM. Errors: internal, where the system has no seccomp.
Result<void> confine(Confinement how);

}  // namespace windsplat::data::loader
