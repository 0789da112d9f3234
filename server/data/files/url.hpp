// URLs of datasets: https, http and s3. Text -> parts, and -> Location.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "server/base/error.hpp"
#include "server/data/files/files.hpp"

namespace windsplat::data {

struct Url {
  std::string scheme;      // "https", "http" or "s3"
  std::string host;        // lower case, an IPv6 address without brackets; for s3 the bucket
  std::uint16_t port = 0;  // of https and http, also if it is the default; 0 for s3
  std::string path;        // percent-encoded (RFC 3986), begins with '/'

  // "https://host/path"; the port only if it is not the default.
  [[nodiscard]] std::string text() const;
};

bool looks_like_url(std::string_view text);

// An absolute URL without user, query and fragment, whose path has no empty, "." or ".." segments.
// Errors: invalid; messages never contain a user, password or query.
Result<Url> parse_url(std::string_view text);

// The text up to the first '?' and without user and password, for messages about any URL.
std::string without_secrets(std::string_view url);

// Percent-encodes all but letters, digits, "-._~" and '/'.
std::string percent_encoded(std::string_view name);
// Undoes percent-encoding; malformed sequences stay as they are.
std::string percent_decoded(std::string_view text);

// The location of a URL, which may be followed by "#/group" and a selection as a path may; reads
// nothing. A URL that ends in '/' or ".zarr" is a folder, every other one a file. Errors: invalid,
// also for patterns, OPeNDAP services and other queries than a selection.
Result<Location> locate_url(const std::string& text);

}  // namespace windsplat::data
