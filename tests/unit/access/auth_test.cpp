// Authentication by tokens, cookies and origins, and the responses to unauthenticated clients.
// Needs no server.
#include "server/access/auth.hpp"

#include <gmock/gmock.h>

#include <algorithm>

#include "server/access/login.hpp"

namespace windsplat::access {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr const char* secret = "0123456789abcdef-._~+/==";
constexpr const char* secret_in_base64url = "MDEyMzQ1Njc4OWFiY2RlZi0uX34rLz09";
constexpr std::int64_t now_s = 1'900'000'000;

Token token(std::string_view text = secret) { return Token::parse(text).value(); }

http::Request request(std::string method, std::vector<std::string> path,
                      http::Headers headers = {}) {
  http::Request out;
  out.method = std::move(method);
  out.path = std::move(path);
  out.headers = std::move(headers);
  out.headers.emplace_back("Host", "winds.example");
  return out;
}

Verdict verdict(const http::Request& request, bool upgrade = false) {
  const Token mine = token();
  return judge(request, upgrade, &mine, {"https://friend.example"}, now_s);
}

std::string cookie_header(const std::string& value) { return "a=b; windsplat=" + value + "; c=d"; }

TEST(TokenFile, IsOneLineOfBearerTokenCharacters) {
  EXPECT_TRUE(token("0123456789abcdef\n").is("0123456789abcdef"));
  EXPECT_TRUE(token("0123456789abcdef\r\n").is("0123456789abcdef"));
  EXPECT_TRUE(token(std::string(512, 'x')).is(std::string(512, 'x')));
  for (const std::string& bad :
       {std::string(), std::string("\n"), std::string("0123456789abcde"), std::string(513, 'x'),
        std::string("0123456789abcdef\n\n"), std::string("0123456789abcdef\nsecond"),
        std::string("0123456789 abcdef"), std::string("0123456789=abcdef"),
        std::string("0123456789abcdef\xc3\xa4"), std::string("0123456789abcdef\0", 17),
        std::string("================")}) {
    const auto parsed = Token::parse(bad);
    ASSERT_FALSE(parsed) << bad;
    EXPECT_EQ(parsed.error().kind, ErrorKind::invalid);
    if (bad.size() < 2) continue;
    EXPECT_THAT(parsed.error().message, Not(HasSubstr(bad)));
  }
}

TEST(TokenFile, MatchesOnlyItsToken) {
  const Token mine = token();
  EXPECT_TRUE(mine.is(secret));
  for (const char* other : {"", "0", "0123456789abcdef-._~+/=", "0123456789abcdef-._~+/===",
                            "1123456789abcdef-._~+/==", "0123456789ABCDEF-._~+/=="}) {
    EXPECT_FALSE(mine.is(other)) << other;
  }
}

TEST(Cookie, IsAnHmacOfItsExpiryByTheToken) {
  // Computed by Python's hmac: key = HMAC-SHA256(token, "windsplat cookie, version 1"),
  // HMAC-SHA256(key, end).
  const std::string end = "2000000000";
  const std::string mac = "0ecadcfbdcb915cc2f78f27377d8b4326d90cdb1f9c7c3bf9baf6e16c217df2d";
  EXPECT_EQ(token().cookie(2'000'000'000), end + "." + mac);
}

TEST(Cookie, ExpiresAndIsValidForItsTokenOnly) {
  const Token mine = token();
  const std::string cookie = mine.cookie(now_s + 1);
  EXPECT_TRUE(mine.admits(cookie, now_s));
  EXPECT_FALSE(mine.admits(cookie, now_s + 1));
  EXPECT_FALSE(token("another-token-of-24-char").admits(cookie, now_s));
  const std::string mac = cookie.substr(cookie.find('.'));
  std::string spoiled = cookie;
  spoiled.back() = spoiled.back() == '0' ? '1' : '0';
  for (const std::string& bad :
       {std::string(), std::string("."), mac, std::to_string(now_s + 2) + mac, "+" + cookie,
        " " + cookie, cookie + "0", cookie.substr(0, cookie.size() - 1), spoiled,
        "99999999999999999999" + mac}) {
    EXPECT_FALSE(mine.admits(bad, now_s)) << bad;
  }
}

TEST(Cookie, ContainsThePortInItsName) {
  const auto name = [](const char* host) {
    http::Request out;
    out.headers = {{"Host", host}};
    return cookie_name(out);
  };
  EXPECT_EQ(name("winds.example"), "windsplat");
  EXPECT_EQ(name("winds.example:8080"), "windsplat-8080");
  EXPECT_EQ(name("[::1]"), "windsplat");
  EXPECT_EQ(name("[::1]:8081"), "windsplat-8081");
  EXPECT_EQ(name("winds.example:"), "windsplat");
  const Token mine = token();
  http::Request asked = request("GET", {"v1"}, {{"Cookie", cookie_header(mine.cookie(now_s + 9))}});
  asked.headers.back().second = "winds.example:8080";  // the Host
  EXPECT_EQ(judge(asked, false, &mine, {}, now_s), Verdict::no_token) << "cookie of another daemon";
  asked.headers.front().second = "windsplat-8080=" + mine.cookie(now_s + 9);
  EXPECT_EQ(judge(asked, false, &mine, {}, now_s), Verdict::allowed);
}

TEST(TokenFile, NewTokenInvalidatesEarlierProofs) {
  const Token first = token();
  const Token same = token();
  const Token other = token("another-token-of-24-char");
  EXPECT_FALSE(is_other_token(&first, &same));
  EXPECT_TRUE(is_other_token(&first, &other));
  EXPECT_TRUE(is_other_token(nullptr, &first));
  EXPECT_FALSE(is_other_token(&first, nullptr)) << "the token is no longer required";
  EXPECT_FALSE(is_other_token(nullptr, nullptr));
}

TEST(TokenFile, SecretIsOverwrittenBeforeRelease) {
  std::string text(64, 's');
  const char* const bytes = text.data();
  wipe(text);
  EXPECT_TRUE(text.empty());
  EXPECT_EQ(std::count(bytes, bytes + 64, 's'), 0);
}

TEST(Authentication, OnlyHealthIsPublic) {
  EXPECT_EQ(verdict(request("GET", {"livez"})), Verdict::allowed);
  EXPECT_EQ(verdict(request("HEAD", {"readyz"})), Verdict::allowed);
  for (const std::vector<std::string>& path : {std::vector<std::string>{},
                                               {"metrics"},
                                               {"v1"},
                                               {"v1", "datasets"},
                                               {"livez", "x"},
                                               {"index.html"},
                                               {"login"},
                                               {"none"}}) {
    EXPECT_EQ(verdict(request("GET", path)), Verdict::no_token);
    EXPECT_EQ(verdict(request("DELETE", path)), Verdict::no_token);
    EXPECT_EQ(judge(request("GET", path), false, nullptr, {}, now_s), Verdict::allowed)
        << "without a token there is no authentication";
  }
}

TEST(Authentication, BearerTokenGrantsAccess) {
  const std::string right = std::string("Bearer ") + secret;
  const std::vector<std::string> path{"v1"};
  EXPECT_EQ(verdict(request("GET", path, {{"Authorization", right}})), Verdict::allowed);
  EXPECT_EQ(verdict(request("DELETE", path, {{"authorization", "bEARER  " + right.substr(7)}})),
            Verdict::allowed);
  EXPECT_EQ(verdict(request("GET", path, {{"Authorization", right}}), true), Verdict::allowed);
  for (const std::string& wrong :
       {std::string("Bearer"), std::string("Bearer "), right + "x", right + ", " + right}) {
    EXPECT_EQ(verdict(request("GET", path, {{"Authorization", wrong}})), Verdict::wrong_token)
        << wrong;
  }
  EXPECT_EQ(verdict(request("GET", path, {{"Authorization", right}, {"Authorization", right}})),
            Verdict::wrong_token)
      << "two cookies are ambiguous";
  EXPECT_EQ(verdict(request("GET", path,
                            {{"Authorization", "Bearer wrong"},
                             {"Cookie", cookie_header(token().cookie(now_s + 9))}})),
            Verdict::wrong_token);
}

// Browsers repeat the credentials of a proxy with every request.
TEST(Authentication, AnotherSchemeIsNeitherProofNorAWrongToken) {
  const std::string basic = "Basic dXNlcjpwYXNzd29yZA==";
  for (const std::string& other : {basic, std::string(secret), std::string("Bearers ") + secret}) {
    const http::Headers alone{{"Authorization", other}};
    EXPECT_EQ(verdict(request("GET", {"v1"}, alone)), Verdict::no_token) << other;
    EXPECT_FALSE(shows_token(request("GET", {"v1"}, alone), false)) << other;
  }
  EXPECT_EQ(verdict(request(
                "GET", {"v1"},
                {{"Authorization", basic}, {"Cookie", cookie_header(token().cookie(now_s + 9))}})),
            Verdict::allowed);
  EXPECT_EQ(verdict(request("GET", {"v1", "stream"},
                            {{"Authorization", basic},
                             {"Sec-WebSocket-Protocol",
                              std::string("windsplat.v1, bearer.") + secret_in_base64url}}),
                    true),
            Verdict::allowed);
}

// Credentials that could be attempts are counted before they are compared.
TEST(Authentication, WrongTokensCountOnlyWhereOneIsRequired) {
  const http::Headers bearer{{"Authorization", "Bearer x"}};
  const http::Headers offer{{"Sec-WebSocket-Protocol", "bearer.eA"}};
  EXPECT_TRUE(shows_token(request("GET", {"v1"}, bearer), false));
  EXPECT_TRUE(shows_token(request("GET", {"v1", "stream"}, offer), true));
  EXPECT_FALSE(shows_token(request("GET", {"v1", "stream"}, offer), false));
  EXPECT_FALSE(shows_token(request("GET", {"livez"}, bearer), false)) << "nothing is compared";
  EXPECT_FALSE(shows_token(request("GET", {"v1"}, {{"Cookie", "windsplat=1.2"}}), false));
}

TEST(Authentication, PlainHttpOriginDiffersFromTheTlsServer) {
  const Token mine = token();
  const auto posted = [&](const char* origin, bool tls) {
    return judge(request("POST", {"v1", "views"},
                         {{"Origin", origin}, {"Cookie", cookie_header(mine.cookie(now_s + 9))}}),
                 false, &mine, {"http://friend.example"}, now_s, tls);
  };
  EXPECT_EQ(posted("http://winds.example", true), Verdict::wrong_origin);
  EXPECT_EQ(posted("https://winds.example", true), Verdict::allowed);
  EXPECT_EQ(posted("http://friend.example", true), Verdict::allowed) << "the host was named";
  EXPECT_EQ(posted("http://winds.example", false), Verdict::allowed);
  EXPECT_EQ(posted("https://winds.example", false), Verdict::allowed)
      << "a proxy may terminate TLS";
}

TEST(Authentication, SubprotocolAuthenticatesAWebSocket) {
  const std::string right = std::string("windsplat.v1, bearer.") + secret_in_base64url;
  const auto with = [](const std::string& offers) {
    return request("GET", {"v1", "stream"}, {{"Sec-WebSocket-Protocol", offers}});
  };
  EXPECT_EQ(verdict(with(right), true), Verdict::allowed);
  EXPECT_EQ(verdict(with(right), false), Verdict::no_token) << "upgrades only";
  EXPECT_EQ(verdict(with("windsplat.v1"), true), Verdict::no_token);
  for (const std::string& wrong : {right + "=", right + "A", right.substr(0, right.size() - 1),
                                   std::string("bearer."), std::string("bearer.") + secret}) {
    EXPECT_EQ(verdict(with(wrong), true), Verdict::wrong_token) << wrong;
  }
}

TEST(Authentication, CookieAuthenticatesAndAllowsChangesFromOwnPagesOnly) {
  const std::string cookie = cookie_header(token().cookie(now_s + 100));
  const auto with = [&](const char* method, http::Headers more) {
    more.emplace_back("Cookie", cookie);
    return request(method, {"v1", "views"}, std::move(more));
  };
  EXPECT_EQ(verdict(with("GET", {})), Verdict::allowed);
  EXPECT_EQ(verdict(with("POST", {{"Origin", "http://winds.example"}})), Verdict::allowed);
  EXPECT_EQ(verdict(with("POST", {{"Origin", "https://friend.example"}})), Verdict::allowed);
  EXPECT_EQ(verdict(with("DELETE", {{"Sec-Fetch-Site", "same-origin"}})), Verdict::allowed);
  for (const http::Headers& foreign :
       {http::Headers{}, http::Headers{{"Origin", "http://evil.example"}},
        http::Headers{{"Origin", "null"}},
        http::Headers{{"Origin", "null"}, {"Sec-Fetch-Site", "same-origin"}},
        http::Headers{{"Sec-Fetch-Site", "same-site"}},
        http::Headers{{"Sec-Fetch-Site", "none"}}}) {
    EXPECT_EQ(verdict(with("POST", foreign)), Verdict::wrong_origin);
    EXPECT_EQ(verdict(with("GET", foreign), true), Verdict::wrong_origin) << "a WebSocket";
  }
  EXPECT_EQ(verdict(with("GET", {{"Origin", "http://winds.example"}}), true), Verdict::allowed);
  const std::string old = "windsplat=" + token().cookie(now_s);
  EXPECT_EQ(verdict(request("GET", {}, {{"Cookie", old}})), Verdict::no_token);
  EXPECT_EQ(verdict(request("GET", {}, {{"Cookie", old + "; " + cookie}})), Verdict::allowed)
      << "one of several";
  EXPECT_EQ(verdict(request("GET", {}, {{"Cookie", "other" + cookie.substr(5)}})),
            Verdict::no_token);
}

TEST(Authentication, ForeignOriginIsRefusedEvenWithTheToken) {
  const http::Headers headers{{"Authorization", std::string("Bearer ") + secret},
                              {"Origin", "https://evil.example"}};
  EXPECT_EQ(verdict(request("GET", {"v1", "stream"}, headers), true), Verdict::wrong_origin);
  EXPECT_EQ(verdict(request("POST", {"v1", "views"}, headers)), Verdict::wrong_origin);
  EXPECT_EQ(verdict(request("GET", {"v1"}, headers)), Verdict::allowed)
      << "the browser prevents the page from reading the response";
  EXPECT_EQ(judge(request("PUT", {"v1"}, {{"Origin", "https://evil.example"}}), false, nullptr, {},
                  now_s),
            Verdict::wrong_origin)
      << "also without a token";
}

TEST(Authentication, TokenInAUrlIsRefusedFirst) {
  for (const char* key : {"token", "access_token", "TOKEN"}) {
    http::Request asked =
        request("GET", {"livez"}, {{"Authorization", std::string("Bearer ") + secret}});
    asked.query = {{"width", "3"}, {key, secret}};
    EXPECT_EQ(verdict(asked), Verdict::token_in_url);
    EXPECT_EQ(judge(asked, false, nullptr, {}, now_s), Verdict::token_in_url);
    const http::Response answer = turned_away(Verdict::token_in_url, asked, "/");
    EXPECT_EQ(answer.status, 400);
    const std::string body(answer.body.bytes.begin(), answer.body.bytes.end());
    EXPECT_THAT(body, Not(HasSubstr(secret)));
  }
}

std::string header_of(const http::Response& response, const std::string& name) {
  for (const auto& [key, value] : response.headers) {
    if (key == name) return value;
  }
  return "";
}

std::string text_of(const http::Response& response) {
  return {response.body.bytes.begin(), response.body.bytes.end()};
}

TEST(AccessRefusal, ProgramsGetAProblemAndBrowsersAForm) {
  const http::Request program = request("GET", {"v1"}, {{"Accept", "*/*"}});
  const http::Response problem = turned_away(Verdict::no_token, program, "/");
  EXPECT_EQ(problem.status, 401);
  EXPECT_EQ(problem.content_type, "application/problem+json");
  EXPECT_EQ(header_of(problem, "WWW-Authenticate"), "Bearer realm=\"windsplat\"");
  const http::Response wrong = turned_away(Verdict::wrong_token, program, "/");
  EXPECT_EQ(wrong.status, 401);
  EXPECT_THAT(header_of(wrong, "WWW-Authenticate"), HasSubstr("invalid_token"));

  const http::Request person =
      request("GET", {}, {{"Accept", "text/html,application/xhtml+xml,*/*;q=0.8"}});
  const http::Response page = turned_away(Verdict::no_token, person, "/winds/");
  EXPECT_EQ(page.status, 401);
  EXPECT_THAT(page.content_type, HasSubstr("text/html"));
  EXPECT_THAT(header_of(page, "WWW-Authenticate"), HasSubstr("Bearer"));
  EXPECT_THAT(header_of(page, "Content-Security-Policy"), HasSubstr("form-action 'self'"));
  EXPECT_THAT(header_of(page, "Content-Security-Policy"), Not(HasSubstr("unsafe")));
  EXPECT_THAT(text_of(page), HasSubstr("method=\"post\" action=\"/winds/login\""));
  EXPECT_EQ(turned_away(Verdict::wrong_origin, person, "/").status, 403);
}

// A foreign page around a login form could ask for the token itself.
TEST(AccessRefusal, FramesOfOtherSitesGetAReasonInsteadOfAForm) {
  const std::vector<std::string> embedders{"https://site.example"};
  const auto framed = [](const std::string& into, http::Parameters query) {
    http::Request asked = request("GET", {}, {{"Accept", "text/html"}, {"Sec-Fetch-Dest", into}});
    asked.query = std::move(query);
    return asked;
  };
  const http::Response page =
      turned_away(Verdict::no_token, framed("iframe", {{"embed", ""}}), "/winds/", embedders);
  EXPECT_EQ(page.status, 401);
  EXPECT_THAT(text_of(page), Not(HasSubstr("<form")));
  EXPECT_THAT(text_of(page), HasSubstr("needs a login"));
  EXPECT_THAT(text_of(page), HasSubstr("href=\"/winds/\""));
  const std::string policy = header_of(page, "Content-Security-Policy");
  EXPECT_THAT(policy, HasSubstr("frame-ancestors 'self' https://site.example"));
  EXPECT_THAT(policy, HasSubstr("form-action 'none'"));
  EXPECT_THAT(policy, Not(HasSubstr("unsafe")));
  for (const http::Request& other :
       {framed("document", {{"embed", ""}}), framed("iframe", {}), framed("", {{"embed", ""}})}) {
    const http::Response form = turned_away(Verdict::no_token, other, "/winds/", embedders);
    EXPECT_THAT(text_of(form), HasSubstr("<form"));
    EXPECT_THAT(header_of(form, "Content-Security-Policy"), HasSubstr("frame-ancestors 'none'"));
  }
  const http::Response denied =
      turned_away(Verdict::no_token, framed("iframe", {{"embed", ""}}), "/winds/");
  EXPECT_THAT(header_of(denied, "Content-Security-Policy"), HasSubstr("frame-ancestors 'none'"));
}

http::Request login(const std::string& body,
                    http::Headers headers = {{"Origin", "http://winds.example"}}) {
  headers.emplace_back("Content-Type", "application/x-www-form-urlencoded; charset=utf-8");
  http::Request out = request("POST", {"login"}, std::move(headers));
  out.body = body;
  return out;
}

TEST(Login, RequiresAnOwnPage) {
  EXPECT_EQ(verdict(login("")), Verdict::allowed);
  EXPECT_EQ(verdict(login("", {{"Sec-Fetch-Site", "same-origin"}})), Verdict::allowed);
  EXPECT_EQ(verdict(login("", {})), Verdict::wrong_origin);
  EXPECT_EQ(verdict(login("", {{"Origin", "https://evil.example"}})), Verdict::wrong_origin);
  EXPECT_EQ(verdict(login("", {{"Origin", "null"}})), Verdict::wrong_origin);
}

TEST(Login, ExchangesTheTokenForACookie) {
  const Token mine = token();
  for (const char* body :
       {"token=0123456789abcdef-._~%2B%2F%3D%3D", "token=+0123456789abcdef-._~%2b/==+",
        "x=1&token=0123456789abcdef-._~%2B/=="}) {
    const http::Response in = log_in(login(body), mine, "/winds/", false, now_s);
    ASSERT_EQ(in.status, 303) << body;
    EXPECT_EQ(header_of(in, "Location"), "/winds/");
    const std::string cookie = header_of(in, "Set-Cookie");
    EXPECT_THAT(cookie, HasSubstr("; Path=/winds/; Max-Age=604800; HttpOnly; SameSite=Strict"));
    EXPECT_THAT(cookie, Not(HasSubstr("Secure")));
    EXPECT_THAT(cookie, Not(HasSubstr(secret)));
    const std::string value = cookie.substr(10, cookie.find(';') - 10);
    EXPECT_TRUE(mine.admits(value, now_s + cookie_lasts_s - 1));
    EXPECT_FALSE(mine.admits(value, now_s + cookie_lasts_s));
  }
}

TEST(Login, CookieIsSecureUnderTls) {
  const std::string body = "token=0123456789abcdef-._~%2B/==";
  const auto cookie = [&](bool tls, const char* origin) {
    return header_of(log_in(login(body, {{"Origin", origin}}), token(), "/", tls, now_s),
                     "Set-Cookie");
  };
  EXPECT_THAT(cookie(true, "https://winds.example"), HasSubstr("; Secure"));
  EXPECT_THAT(cookie(false, "https://winds.example"), HasSubstr("; Secure"));
  EXPECT_THAT(cookie(false, "http://winds.example"), Not(HasSubstr("Secure")));
}

TEST(Login, WrongTokenShowsTheFormAgain) {
  for (const char* body : {"", "token", "token=", "token=wrong", "nekot=0123456789abcdef-._~%2B/==",
                           "token=%", "token=%2", "token=%zz"}) {
    const http::Response out = log_in(login(body), token(), "/", false, now_s);
    EXPECT_EQ(out.status, 401) << body;
    EXPECT_EQ(header_of(out, "Set-Cookie"), "");
    EXPECT_THAT(text_of(out), HasSubstr("Invalid token."));
  }
  http::Request json = login("token=0123456789abcdef-._~%2B/==");
  json.headers.insert(json.headers.begin(), {"Content-Type", "application/json"});
  json.headers.erase(json.headers.begin() + 2);
  EXPECT_EQ(log_in(json, token(), "/", false, now_s).status, 415);
}

}  // namespace
}  // namespace windsplat::access
