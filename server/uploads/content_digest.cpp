#include "server/uploads/content_digest.hpp"

#include <algorithm>

#include "server/base/check.hpp"

namespace windsplat::uploads {
namespace {

constexpr std::string_view key = "sha-256=";
constexpr std::size_t base64_chars = 44;  // of 32 bytes

std::string_view without_blanks(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

// ":...:", a byte sequence of RFC 8941, 3.3.5.
std::optional<Sha256> bytes_in(std::string_view item) {
  if (item.size() != base64_chars + 2 || item.front() != ':' || item.back() != ':') {
    return std::nullopt;
  }
  const std::string text(item.substr(1, base64_chars));
  std::array<unsigned char, 33> decoded{};
  if (EVP_DecodeBlock(decoded.data(), reinterpret_cast<const unsigned char*>(text.data()),
                      static_cast<int>(text.size())) != static_cast<int>(decoded.size())) {
    return std::nullopt;
  }
  Sha256 out{};
  std::copy_n(decoded.begin(), out.size(), out.begin());
  // Blanks and other padding are accepted above.
  return digest_text(out) == std::string(key) + std::string(item) ? std::optional(out)
                                                                  : std::nullopt;
}

}  // namespace

std::string digest_text(const Sha256& digest) {
  std::array<unsigned char, base64_chars + 1> text{};
  EVP_EncodeBlock(text.data(), digest.data(), static_cast<int>(digest.size()));
  return std::string(key) + ':' + reinterpret_cast<const char*>(text.data()) + ':';
}

Result<std::optional<Sha256>> parse_digest(std::string_view header) {
  std::optional<Sha256> out;
  if (without_blanks(header).empty()) return out;
  for (std::size_t at = 0; at <= header.size();) {
    const std::size_t end = std::min(header.find(',', at), header.size());
    const std::string_view member = without_blanks(header.substr(at, end - at));
    at = end + 1;
    if (!member.starts_with(key)) continue;
    out = bytes_in(member.substr(key.size()));
    if (out) continue;
    return make_error(ErrorKind::invalid,
                      "the digest " + printable(member, 80) + " is not sha-256=:BASE64:");
  }
  if (out) return out;
  return make_error(ErrorKind::invalid,
                    "the digest must have sha-256, which is the only algorithm "
                    "that is checked");
}

Hasher::Hasher() : context_(EVP_MD_CTX_new(), &EVP_MD_CTX_free) {
  WINDSPLAT_CHECK(context_ != nullptr);
  WINDSPLAT_CHECK(EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) == 1);
}

void Hasher::add(std::span<const std::byte> bytes) {
  WINDSPLAT_CHECK(EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size()) == 1);
}

Sha256 Hasher::finish() {
  Sha256 out{};
  WINDSPLAT_CHECK(EVP_DigestFinal_ex(context_.get(), out.data(), nullptr) == 1);
  return out;
}

}  // namespace windsplat::uploads
