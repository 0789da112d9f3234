// The login page is self-contained, so that unauthenticated clients need no other resource. Its
// script keeps the fragment of the URL, which holds the view of a shared link; without scripts the
// login still works.
#include "server/access/login.hpp"

#include <openssl/evp.h>

#include <array>
#include <optional>
#include <string_view>

#include "server/base/check.hpp"
#include "server/base/log.hpp"
#include "server/http/framing.hpp"
#include "server/http/negotiate.hpp"
#include "server/http/problem.hpp"

namespace windsplat::access {
namespace {

constexpr std::string_view style =
    ":root{color-scheme:light dark;font:16px/1.5 system-ui,sans-serif}"
    "body{margin:0;min-height:100vh;display:grid;place-items:center}"
    "main{width:min(22rem,90vw)}h1{font-size:1.4rem}"
    "label,input,button{display:block;width:100%;box-sizing:border-box;font:inherit}"
    "input,button{margin:.3rem 0 1rem;padding:.6rem}[role=alert]{font-weight:600}";

constexpr std::string_view script = "document.forms[0].action+=location.hash";

const std::string& policy() {
  static const std::string text =
      "default-src 'none'; style-src " + policy_hash(style) + "; script-src " +
      policy_hash(script) +
      "; img-src data:; base-uri 'none'; form-action 'self'; frame-ancestors 'none'";
  return text;
}

// Neither `base_path` nor `message` needs HTML escaping.
std::string page(const std::string& base_path, std::string_view message) {
  std::string html =
      "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">"
      // Without it the browser would send the form with Origin: null.
      "<meta name=\"referrer\" content=\"same-origin\"><link rel=\"icon\" href=\"data:,\">"
      "<title>windsplat: log in</title><style>";
  html += style;
  html += "</style></head><body><main><h1>windsplat</h1>";
  if (!message.empty()) {
    html += "<p role=\"alert\">";
    html += message;
    html += "</p>";
  }
  html += "<form method=\"post\" action=\"" + base_path +
          "login\"><label for=\"token\">Access token</label>"
          "<input id=\"token\" name=\"token\" type=\"password\" required autofocus "
          "autocomplete=\"current-password\"><button>Log in</button></form></main><script>";
  html += script;
  html += "</script></body></html>\n";
  return html;
}

void add_challenge(http::Response& response, bool wrong) {
  // RFC 6750, 3: no error code if the request has no credentials.
  response.headers.emplace_back(
      "WWW-Authenticate",
      wrong ? "Bearer realm=\"windsplat\", error=\"invalid_token\"" : "Bearer realm=\"windsplat\"");
}

http::Response login_page(const std::string& base_path, std::string_view message, bool wrong) {
  http::Response response;
  response.status = 401;
  response.content_type = "text/html; charset=utf-8";
  response.headers = {{"Cache-Control", "no-store"},
                      {"Content-Security-Policy", policy()},
                      {"Cross-Origin-Opener-Policy", "same-origin"}};
  add_challenge(response, wrong);
  response.body = http::Body::of(page(base_path, message));
  return response;
}

// In a frame there is no login: a foreign page around it could lead a user to type the token into a
// form of its own, and browsers neither store nor send the cookie there.
constexpr std::string_view frame_script = "document.links[0].hash=location.hash";

http::Response frame_page(const std::string& base_path, const std::vector<std::string>& embedders) {
  static const std::string policy = "default-src 'none'; style-src " + policy_hash(style) +
                                    "; script-src " + policy_hash(frame_script) +
                                    "; img-src data:; base-uri 'none'; form-action 'none'; ";
  http::Response response;
  response.status = 401;
  response.content_type = "text/html; charset=utf-8";
  response.headers = {{"Cache-Control", "no-store"},
                      {"Content-Security-Policy", policy + http::frame_ancestors(embedders)}};
  add_challenge(response, false);
  std::string html =
      "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">"
      "<link rel=\"icon\" href=\"data:,\"><title>windsplat: not shown here</title><style>";
  html += style;
  html +=
      "</style></head><body><main><p role=\"alert\">This picture needs a login, which browsers do "
      "not pass on to frames of other sites.</p><p><a target=\"_blank\" rel=\"noopener\" href=\"";
  html += base_path + "\">Open in windsplat</a></p></main><script>";
  html += frame_script;
  html += "</script></body></html>\n";
  response.body = http::Body::of(std::move(html));
  return response;
}

bool wants_page(const http::Request& request) {
  if (request.method != "GET" && request.method != "HEAD") return false;
  constexpr std::array<std::string_view, 2> offers{"application/problem+json", "text/html"};
  return http::choose_type(request.header("Accept"), offers) == 1U;
}

std::optional<unsigned> hex_digit(char c) {
  if (c >= '0' && c <= '9') return static_cast<unsigned>(c - '0');
  if (c >= 'a' && c <= 'f') return static_cast<unsigned>(c - 'a') + 10U;
  if (c >= 'A' && c <= 'F') return static_cast<unsigned>(c - 'A') + 10U;
  return std::nullopt;
}

// Decodes application/x-www-form-urlencoded; invalid escapes are kept as they are.
std::string form_text(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%' && i + 2 < text.size()) {
      const auto high = hex_digit(text[i + 1]);
      const auto low = hex_digit(text[i + 2]);
      if (high && low) {
        out += static_cast<char>(*high << 4U | *low);
        i += 2;
        continue;
      }
    }
    out += text[i] == '+' ? ' ' : text[i];
  }
  return out;
}

// The form's only field, without spaces around pasted text.
std::string posted_token(const std::string& body) {
  for (const std::string_view pair : http::split_list(body, '&')) {
    const std::size_t equals = pair.find('=');
    if (equals == std::string_view::npos || pair.substr(0, equals) != "token") continue;
    const std::string text = form_text(pair.substr(equals + 1));
    return std::string(http::trimmed(text));
  }
  return {};
}

}  // namespace

std::string policy_hash(std::string_view text) {
  std::array<unsigned char, 32> digest{};
  unsigned int bytes = 0;
  WINDSPLAT_CHECK(
      EVP_Digest(text.data(), text.size(), digest.data(), &bytes, EVP_sha256(), nullptr) == 1);
  std::array<unsigned char, 45> base64{};  // 32 bytes, and the NUL that OpenSSL adds
  EVP_EncodeBlock(base64.data(), digest.data(), static_cast<int>(digest.size()));
  return "'sha256-" + std::string(reinterpret_cast<const char*>(base64.data())) + "'";
}

http::Response turned_away(Verdict verdict, const http::Request& request,
                           const std::string& base_path,
                           const std::vector<std::string>& embedders) {
  switch (verdict) {
    case Verdict::token_in_url:
      return http::problem_response(400, "Bad Request",
                                    "do not send the token in the URL, where it is stored and "
                                    "logged: send it as Authorization: Bearer");
    case Verdict::wrong_origin:
      if (request.header("Origin").empty()) {
        return http::problem_response(
            403, "Forbidden",
            "cookies and the login form require an Origin header of a page; "
            "programs must send Authorization: Bearer");
      }
      return http::problem_response(403, "Forbidden",
                                    "pages of " + printable(request.header("Origin")) +
                                        " may not connect; use --allow-origin to allow them");
    case Verdict::allowed:
    case Verdict::no_token:
    case Verdict::wrong_token:
      break;
  }
  const bool wrong = verdict == Verdict::wrong_token;
  if (wants_page(request)) {
    const bool framed = http::is_in_frame(request) && http::asks_embedded(request);
    return framed && !embedders.empty() ? frame_page(base_path, embedders)
                                        : login_page(base_path, "", wrong);
  }
  http::Response response = http::problem_response(
      401, "Unauthorized",
      wrong ? "invalid token" : "a token is required: Authorization: Bearer TOKEN");
  add_challenge(response, wrong);
  return response;
}

http::Response log_in(const http::Request& request, const Token& token,
                      const std::string& base_path, bool tls, std::int64_t now_s) {
  const std::string type = request.header("Content-Type");
  if (!http::equal_without_case(http::split_list(type, ';')[0],
                                "application/x-www-form-urlencoded")) {
    return http::problem_response(415, "Unsupported Media Type",
                                  "Content-Type must be application/x-www-form-urlencoded");
  }
  if (!token.is(posted_token(request.body))) {
    log::warn("login failed", {{"request", request.id}});
    return login_page(base_path, "Invalid token.", true);
  }
  std::string cookie = cookie_name(request) + '=' + token.cookie(now_s + cookie_lasts_s);
  cookie += "; Path=" + base_path + "; Max-Age=" + std::to_string(cookie_lasts_s) +
            "; HttpOnly; SameSite=Strict";
  // Behind a proxy that terminates TLS, the page's origin shows https.
  if (tls || request.header("Origin").starts_with("https://")) cookie += "; Secure";
  return {
      303,
      "",
      {{"Location", base_path}, {"Set-Cookie", std::move(cookie)}, {"Cache-Control", "no-store"}},
      {}};
}

}  // namespace windsplat::access
