// Who may come in: the bearer token, the cookie that stands for it, the origins of web pages. Pure:
// a request in, a verdict out.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"
#include "server/http/exchange.hpp"

namespace windsplat::net {

// The secret that whoever may come in knows. What is compared takes as long wherever it differs.
class Token {
 public:
  static constexpr std::size_t chars_min = 16;
  static constexpr std::size_t chars_max = 512;

  // The text of a token file: one line of the characters of RFC 6750's b64token.
  // Errors: invalid, which do not repeat the text.
  static Result<Token> parse(std::string_view file);

  [[nodiscard]] bool is(std::string_view given) const;

  // A cookie's value: good until `ends_s` (seconds since 1970), for this token alone. Nothing has
  // to be kept for it.
  [[nodiscard]] std::string cookie(std::int64_t ends_s) const;
  [[nodiscard]] bool admits(std::string_view cookie, std::int64_t now_s) const;

  bool operator==(const Token& other) const = default;  // of tokens of ours, not of a given one

 private:
  using Digest = std::array<std::uint8_t, 32>;
  [[nodiscard]] Digest signature(std::string_view text) const;

  Digest digest_{};
  Digest cookie_key_{};
};

// Overwrites a secret before its memory is given back.
void wipe(std::string& secret);

// Whether who was let in under `before` has to show a token anew; null: none is asked for.
bool is_other_token(const Token* before, const Token* now);

// "windsplat", with the port that the request's Host names: cookies are sent to every port of a
// host, and two daemons there would log each other's viewers out.
std::string cookie_name(const Request& request);
// Of a WebSocket, for clients that can set no header: "bearer." and the token in base64url (RFC
// 4648, 5) without padding.
inline constexpr std::string_view bearer_protocol = "bearer.";

enum class Verdict {
  allowed,
  token_in_url,  // where it would be logged and kept
  wrong_origin,  // a page of another site
  no_token,
  wrong_token,
};

// `token` null: nobody is asked for one. `upgrade`: the request opens a WebSocket. `tls`: it came
// in TLS. What needs no token: /livez and /readyz, and the login itself, which must come from a
// page of ours.
Verdict judge(const Request& request, bool upgrade, const Token* token,
              const std::vector<std::string>& allowed_origins, std::int64_t now_s,
              bool tls = false);

// Whether judge() would compare a token that the request shows, so that it may be a guess.
bool shows_token(const Request& request, bool upgrade);

// Whether it posts the login form; only where there is a token.
bool is_login(const Request& request);

}  // namespace windsplat::net
