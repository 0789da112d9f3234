// ZIP archives of folders (PKWARE APPNOTE 6.3, without ZIP64): a file -> what it has -> files below
// a folder.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "server/base/error.hpp"

namespace windsplat::uploads {

struct ZipEntry {
  std::string name;  // relative, parts separated by '/'; of a folder with a '/' at its end
  std::uint32_t crc = 0;
  std::uint64_t packed_bytes = 0;
  std::uint64_t bytes = 0;
  std::uint64_t header_at = 0;  // of its local header
  bool deflated = false;
};

// The entries of an archive, checked against its size: names lead nowhere else, and there are no
// links, no encryption, at most 20000 entries and 200 times the packed bytes. Errors: bad_data.
Result<std::vector<ZipEntry>> list_zip(int file, std::uint64_t file_bytes);

// Bytes that the files of the entries and their folders take on disk, in blocks of 4 KiB.
std::uint64_t disk_bytes_of(const std::vector<ZipEntry>& entries);

// Writes the files of the entries below an empty folder. Errors: bad_data (sizes, checksums, equal
// names), out_of_memory (disk full), internal (disk); then some of them remain.
Result<void> unpack_zip(int file, const std::vector<ZipEntry>& entries,
                        const std::filesystem::path& folder);

}  // namespace windsplat::uploads
