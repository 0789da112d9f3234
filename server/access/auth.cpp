// Tokens are compared by SHA-256 digests, so that the time reveals neither length nor position of a
// difference.
#include "server/access/auth.hpp"

#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>

#include <algorithm>
#include <charconv>
#include <optional>

#include "server/base/check.hpp"
#include "server/http/negotiate.hpp"

namespace windsplat::access {
namespace {

using Digest = std::array<std::uint8_t, 32>;

Digest sha256(std::string_view text) {
  Digest out{};
  unsigned int bytes = 0;
  WINDSPLAT_CHECK(EVP_Digest(text.data(), text.size(), out.data(), &bytes, EVP_sha256(), nullptr) ==
                      1 &&
                  bytes == out.size());
  return out;
}

Digest hmac_sha256(std::string_view key, std::string_view text) {
  Digest out{};
  unsigned int bytes = 0;
  WINDSPLAT_CHECK(HMAC(EVP_sha256(), key.data(), static_cast<int>(key.size()),
                       reinterpret_cast<const unsigned char*>(text.data()), text.size(), out.data(),
                       &bytes) != nullptr &&
                  bytes == out.size());
  return out;
}

std::string hex(const Digest& digest) {
  constexpr std::string_view digits = "0123456789abcdef";
  std::string out;
  for (const std::uint8_t byte : digest) {
    out += digits[byte >> 4U];
    out += digits[byte & 15U];
  }
  return out;
}

bool is_letter_or_digit(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

// RFC 6750, 2.1: 1*( ALPHA / DIGIT / "-" / "." / "_" / "~" / "+" / "/" ) *"="
bool is_b64token(std::string_view text) {
  while (!text.empty() && text.back() == '=') text.remove_suffix(1);
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return is_letter_or_digit(c) || std::string_view("-._~+/").find(c) != std::string_view::npos;
  });
}

Error token_error(std::string detail) {
  return make_error(ErrorKind::invalid, "the token " + std::move(detail));
}

// RFC 4648, 5, without padding. Empty if invalid.
std::optional<std::string> from_base64url(std::string_view text) {
  constexpr std::string_view letters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  std::string out;
  std::uint32_t bits = 0;
  unsigned count = 0;
  for (const char c : text) {
    const std::size_t value = letters.find(c);
    if (value == std::string_view::npos) return std::nullopt;
    bits = bits << 6U | static_cast<std::uint32_t>(value);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    out += static_cast<char>(bits >> count & 0xffU);
  }
  const bool whole = count < 6 && (bits & ((1U << count) - 1)) == 0;
  return whole ? std::optional(out) : std::nullopt;
}

// "Bearer TOKEN"; scheme names are case-insensitive (RFC 9110, 11.1). None for other schemes, which
// belong to a proxy.
std::optional<std::string> bearer_of(const http::Request& request) {
  const std::string authorization = request.header("Authorization");
  const std::string_view text = authorization;
  const std::size_t space = text.find(' ');
  if (!http::equal_without_case(text.substr(0, space), "Bearer")) return std::nullopt;
  return std::string(space == std::string_view::npos ? "" : http::trimmed(text.substr(space)));
}

std::optional<std::string> offered_token(const http::Request& request, bool upgrade) {
  if (!upgrade) return std::nullopt;
  const std::string offers = request.header("Sec-WebSocket-Protocol");
  for (const std::string_view name : http::split_list(offers, ',')) {
    if (!name.starts_with(bearer_protocol)) continue;
    return from_base64url(name.substr(bearer_protocol.size())).value_or("");
  }
  return std::nullopt;
}

// A browser sends every cookie whose path matches.
bool has_good_cookie(const http::Request& request, const Token& token, std::int64_t now_s) {
  const std::string ours = cookie_name(request);
  for (const auto& [name, value] : request.headers) {
    if (!http::equal_without_case(name, "Cookie")) continue;
    for (const std::string_view pair : http::split_list(value, ';')) {
      const std::size_t equals = pair.find('=');
      if (equals == std::string_view::npos || pair.substr(0, equals) != ours) continue;
      if (token.admits(pair.substr(equals + 1), now_s)) return true;
    }
  }
  return false;
}

enum class Credential { none, wrong, token, cookie };

// The first credential decides: a valid cookie does not compensate for a wrong token.
Credential credential_of(const http::Request& request, bool upgrade, const Token& token,
                         std::int64_t now_s) {
  auto shown = bearer_of(request);
  if (!shown) shown = offered_token(request, upgrade);
  if (shown) return token.is(*shown) ? Credential::token : Credential::wrong;
  return has_good_cookie(request, token, now_s) ? Credential::cookie : Credential::none;
}

bool names_token(const http::Request& request) {
  return std::any_of(request.query.begin(), request.query.end(), [](const auto& parameter) {
    return http::equal_without_case(parameter.first, "token") ||
           http::equal_without_case(parameter.first, "access_token");
  });
}

bool is_health(const http::Request& request) {
  return request.path.size() == 1 && (request.path[0] == "livez" || request.path[0] == "readyz");
}

bool reads_problem_page(const http::Request& request) {
  return request.below_base && (request.method == "GET" || request.method == "HEAD") &&
         !request.path.empty() && request.path.size() <= 2 && request.path[0] == "problems";
}

}  // namespace

Result<Token> Token::parse(std::string_view file) {
  if (file.ends_with('\n')) file.remove_suffix(1);
  if (file.ends_with('\r')) file.remove_suffix(1);
  if (file.empty()) return token_error("is missing: the file is empty");
  if (file.find('\n') != std::string_view::npos) {
    return token_error("must be on the only line of the file");
  }
  if (file.size() < chars_min || file.size() > chars_max) {
    return token_error("has " + std::to_string(file.size()) + " characters; it must have " +
                       std::to_string(chars_min) + " to " + std::to_string(chars_max));
  }
  if (!is_b64token(file)) {
    return token_error(
        "has an invalid character; it may contain letters, digits and -._~+/, "
        "and = at the end");
  }
  Token token;
  token.digest_ = sha256(file);
  token.cookie_key_ = hmac_sha256(file, "windsplat cookie, version 1");
  return token;
}

bool Token::is(std::string_view given) const {
  const Digest digest = sha256(given);
  return CRYPTO_memcmp(digest.data(), digest_.data(), digest.size()) == 0;
}

void wipe(std::string& secret) {
  OPENSSL_cleanse(secret.data(), secret.size());
  secret.clear();
}

bool is_other_token(const Token* before, const Token* now) {
  return now != nullptr && (before == nullptr || *before != *now);
}

std::string cookie_name(const http::Request& request) {
  const std::string host = request.header("Host");
  const std::size_t colon = host.find(':', host.starts_with('[') ? host.find(']') : 0);
  std::string name = "windsplat";
  if (colon != std::string::npos && colon + 1 < host.size()) name += '-' + host.substr(colon + 1);
  return name;
}

Token::Digest Token::signature(std::string_view text) const {
  return hmac_sha256({reinterpret_cast<const char*>(cookie_key_.data()), cookie_key_.size()}, text);
}

std::string Token::cookie(std::int64_t ends_s) const {
  const std::string ends = std::to_string(ends_s);
  return ends + '.' + hex(signature(ends));
}

bool Token::admits(std::string_view cookie, std::int64_t now_s) const {
  const std::size_t dot = cookie.find('.');
  if (dot == std::string_view::npos) return false;
  const std::string_view text = cookie.substr(0, dot);
  std::int64_t ends_s = 0;
  const auto [stop, fault] = std::from_chars(text.data(), text.data() + text.size(), ends_s);
  if (fault != std::errc() || stop != text.data() + text.size()) return false;
  const Digest given = sha256(cookie.substr(dot + 1));
  const Digest right = sha256(hex(signature(text)));
  return CRYPTO_memcmp(given.data(), right.data(), right.size()) == 0 && now_s < ends_s;
}

bool is_login(const http::Request& request) {
  return request.below_base && request.method == "POST" &&
         request.path == std::vector<std::string>{"login"};
}

bool needs_no_token(const http::Request& request) {
  return is_health(request) || reads_problem_page(request);
}

bool shows_token(const http::Request& request, bool upgrade) {
  return !needs_no_token(request) && (bearer_of(request) || offered_token(request, upgrade));
}

Verdict judge(const http::Request& request, bool upgrade, const Token* token,
              const std::vector<std::string>& allowed_origins, std::int64_t now_s, bool tls) {
  if (names_token(request)) return Verdict::token_in_url;
  if (needs_no_token(request)) return Verdict::allowed;
  const std::string origin = request.header("Origin");
  const bool reads = !upgrade && (request.method == "GET" || request.method == "HEAD" ||
                                  request.method == "OPTIONS");
  // Browsers send one or the other for requests of a page; programs send neither.
  const bool own_page =
      origin.empty() ? request.header("Sec-Fetch-Site") == "same-origin"
                     : http::origin_allowed(origin, request.header("Host"), allowed_origins, tls);
  if (!reads && !origin.empty() && !own_page) return Verdict::wrong_origin;
  if (token == nullptr) return Verdict::allowed;
  if (is_login(request)) return own_page ? Verdict::allowed : Verdict::wrong_origin;
  switch (credential_of(request, upgrade, *token, now_s)) {
    case Credential::none:
      return Verdict::no_token;
    case Credential::wrong:
      return Verdict::wrong_token;
    case Credential::token:
      return Verdict::allowed;
    case Credential::cookie:
      // Cookies are attached by the browser for pages of any origin.
      return reads || own_page ? Verdict::allowed : Verdict::wrong_origin;
  }
  return Verdict::no_token;
}

}  // namespace windsplat::access
