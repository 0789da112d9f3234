// Authentication: bearer token, login cookie and origins of web pages. Pure functions: request in,
// verdict out.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"
#include "server/http/exchange.hpp"

namespace windsplat::access {

// The shared secret. Comparisons take constant time.
class Token {
 public:
  static constexpr std::size_t chars_min = 16;
  static constexpr std::size_t chars_max = 512;

  // Parses a token file: one line of the characters of RFC 6750's b64token. Errors: invalid,
  // without the text of the token.
  static Result<Token> parse(std::string_view file);

  [[nodiscard]] bool is(std::string_view given) const;

  // A cookie value, valid until `ends_s` (seconds since 1970) for this token only. Needs no stored
  // state.
  [[nodiscard]] std::string cookie(std::int64_t ends_s) const;
  [[nodiscard]] bool admits(std::string_view cookie, std::int64_t now_s) const;

  bool operator==(const Token& other) const = default;  // for own tokens, not constant-time

 private:
  using Digest = std::array<std::uint8_t, 32>;
  [[nodiscard]] Digest signature(std::string_view text) const;

  Digest digest_{};
  Digest cookie_key_{};
};

// Overwrites a secret before its memory is freed.
void wipe(std::string& secret);

// Whether clients authorised under `before` must authenticate again; null: no token required.
bool is_other_token(const Token* before, const Token* now);

// "windsplat" with the port of the request's Host: cookies are sent to every port of a host, and
// two daemons would overwrite each other's.
std::string cookie_name(const http::Request& request);
// WebSocket subprotocol for clients that cannot set headers: "bearer." and the token in base64url
// (RFC 4648, 5) without padding.
inline constexpr std::string_view bearer_protocol = "bearer.";

enum class Verdict {
  allowed,
  token_in_url,  // URLs are logged and stored
  wrong_origin,  // a page of another origin
  no_token,
  wrong_token,
};

// `token` null: no authentication. `upgrade`: the request opens a WebSocket. `tls`: it uses TLS.
// Exempt from the token: needs_no_token(), and the login itself, which must come from a page of
// this server.
Verdict judge(const http::Request& request, bool upgrade, const Token* token,
              const std::vector<std::string>& allowed_origins, std::int64_t now_s,
              bool tls = false);

// Whether the request is answered without a token: /livez and /readyz, and reading the pages of
// problem types, to which refusals refer.
bool needs_no_token(const http::Request& request);

// Whether judge() would compare a token of the request, which may be an attempt to guess it.
bool shows_token(const http::Request& request, bool upgrade);

// Whether the request posts the login form; only if a token is set.
bool is_login(const http::Request& request);

}  // namespace windsplat::access
