// ZIP archives (PKWARE APPNOTE 6.3, with ZIP64): a file -> its entries -> the bytes of each. Only a
// loader may call this for bytes of others.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"

namespace windsplat::data::archive {

// Bytes of disk are counted in blocks.
inline constexpr std::uint64_t block_bytes = 4096;
// Pieces of entries are at most so long.
inline constexpr std::size_t piece_bytes = std::size_t{64} << 10;

struct ZipEntry {
  std::string name;  // is_path_within(); of a folder with a '/' at its end
  std::uint32_t crc = 0;
  std::uint64_t packed_bytes = 0;
  std::uint64_t bytes = 0;
  std::uint64_t header_at = 0;  // of its local header
  bool deflated = false;

  [[nodiscard]] bool is_folder() const { return name.back() == '/'; }
};

// A relative path of at most 512 printable ASCII characters and 16 parts without backslashes; no
// part is empty, "." or "..", but the last one may end in '/'.
bool is_path_within(std::string_view name);

// The entries of an archive, checked against its size: their names are paths within it, and there
// are no links, no encryption, at most 100000 entries, 16 MiB of directory and 200 times the packed
// bytes. Errors: bad_data; internal (disk).
Result<std::vector<ZipEntry>> list_zip(int file);

// Bytes that the files of the entries and their folders take on disk.
std::uint64_t disk_bytes_of(const std::vector<ZipEntry>& entries);

// Passes the bytes of a file's entry on, in pieces, never more than it declares. Errors: bad_data
// (also of sizes and checksum, known at the end); internal (disk); those of `take`.
using TakeBytes = std::function<Result<void>(std::span<const unsigned char>)>;
Result<void> read_zip_entry(int file, const ZipEntry& entry, const TakeBytes& take);

}  // namespace windsplat::data::archive
