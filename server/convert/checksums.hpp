// The list of the files of a store with their sizes and checksums, itself a file of the store. Its
// digest is the `contents` of the store's attributes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"

namespace windsplat::convert {

inline constexpr const char* checksums_name = "checksums.crc32c";

struct Checksum {
  std::uint64_t bytes = 0;
  std::uint32_t crc32c = 0;
  bool operator==(const Checksum&) const = default;
};
// By path in the store. Metadata of the root contain the digest of the list: their checksums are
// those with zeros in its place (without_contents()).
using Checksums = std::map<std::string, Checksum>;

Checksum checksum_of(std::string_view bytes);
// Reads a file in pieces. Errors: not_found, cancelled.
Result<Checksum> checksum_of_file(const std::filesystem::path& path, const CancelToken& cancel);

// "crc32c bytes path", a line for each.
std::string text_of(const Checksums& checksums);
// Errors: bad_data.
Result<Checksums> parse_checksums(const std::string& text);

// As long as a digest.
inline constexpr const char* no_contents = "0000000000000000";
// Replaces the digest in a text.
std::string without_contents(std::string text, const std::string& contents);

}  // namespace windsplat::convert
