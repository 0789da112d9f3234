// Atomic file writes: a file is either complete or unchanged.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "server/base/error.hpp"

namespace windsplat {

// Writes a temporary file in the same folder and renames it, so that readers see either the old or
// the new file, and a failure leaves the old one. Follows symbolic links, including dangling ones.
// Devices, pipes and descriptors of this process (/dev/stdout) are written directly and never
// removed.
// Errors: internal; out_of_memory if the disk is full.
enum class Sync : std::uint8_t { later, now };  // now: flush to disk before returning
Result<void> write_whole_file(const std::filesystem::path& path, std::string_view bytes,
                              Sync sync = Sync::later);

// The target of a chain of symbolic links, which need not exist; for a cycle, one of its links.
std::filesystem::path end_of_links(std::filesystem::path path);

// The temporary name of a file until it is complete, unique to this process, in the same folder.
std::filesystem::path part_of(const std::filesystem::path& target);

// The descriptor of this process that a path names, such as /dev/stdout, /dev/fd/3 or a link to one
// of them; otherwise -1. To write to it, duplicate it: opening the path would begin at its start.
int inherited_descriptor(std::filesystem::path path);

// Whether a path is a pipe, a device or a descriptor of this process.
bool is_stream(const std::filesystem::path& path);

// Flushes a folder to disk, so that created, renamed and removed names persist.
Result<void> sync_folder(const std::filesystem::path& folder);

}  // namespace windsplat
