// Access to untrusted paths below the data root, which the kernel resolves component by component:
// shared by the functions that locate and list.
#pragma once

#include <cstdint>
#include <string>

#include "server/base/error.hpp"
#include "server/data/files/descriptor.hpp"

namespace windsplat::data::beneath {

// Opens the data root. Errors: internal.
Result<Descriptor> open_root(const std::string& root);

// openat2 below `root` with these flags of open(2), close-on-exec; "..", absolute paths and links
// cannot leave it, and absolute links are not followed. A descriptor, or -1 with errno set.
int open(int root, const std::string& path, std::uint64_t flags);

// Whether this errno of open() means that the name leads nowhere: dangling, or out of the root.
bool leads_nowhere(int reason);

// The error for this errno of open(); the message has the path as given.
Error not_reached(const std::string& path, int reason);

// Checks the text of a path alone, before the file system is accessed. Errors: invalid.
Result<void> check_letters(const std::string& path);

}  // namespace windsplat::data::beneath
