// Bytes -> a file that is there whole or not at all.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "server/base/error.hpp"

namespace windsplat {

// A regular file is written beside its place and renamed into it, so that a reader sees the old
// file or the new one, and a failure leaves the old one alone; of a symbolic link, the file that it
// leads to, also where that is not there yet. What is no regular file (a device, a pipe) is written
// to as it is and never removed, and so is what a descriptor of this process stands for
// (/dev/stdout).
// Errors: internal; out_of_memory where the disk is full.
enum class Sync : std::uint8_t { later, now };  // now: it outlasts the machine's going down
Result<void> write_whole_file(const std::filesystem::path& path, std::string_view bytes,
                              Sync sync = Sync::later);

// Where the symbolic links of a name lead, also where nothing is there yet. Links that lead to one
// another: one of them.
std::filesystem::path end_of_links(std::filesystem::path path);

// The name that a file has until it is whole: of this process alone, beside its place.
std::filesystem::path part_of(const std::filesystem::path& target);

// Whether a name is that of a pipe, a device or a descriptor of this process.
bool is_stream(const std::filesystem::path& path);

// The names in a folder as they are now: what was made, renamed or removed stays so.
Result<void> sync_folder(const std::filesystem::path& folder);

}  // namespace windsplat
