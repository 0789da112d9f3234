// Digests of bodies in header fields (RFC 9530).
#pragma once

#include <openssl/evp.h>

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "server/base/error.hpp"

namespace windsplat::uploads {

using Sha256 = std::array<unsigned char, 32>;

// The sha-256 of a value of Content-Digest or Repr-Digest; empty for an empty value. Others in it
// are not looked at. Errors: invalid (none of it is sha-256, or that is malformed).
Result<std::optional<Sha256>> parse_digest(std::string_view header);
// "sha-256=:...:"
std::string digest_text(const Sha256& digest);

// SHA-256 of bytes that come in parts.
class Hasher {
 public:
  Hasher();
  void add(std::span<const std::byte> bytes);
  Sha256 finish();  // once, last

 private:
  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context_;
};

}  // namespace windsplat::uploads
