// A request target: the parser, the readers of parameters and of Accept headers, and the routes
// with a query of a server in this process. After a zero byte: a header value.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>

#include "server/http/negotiate.hpp"
#include "server/http/request_target.hpp"
#include "tests/fuzz/support/check.hpp"
#include "tests/fuzz/support/daemon.hpp"

namespace {

using fuzz::expect;
using namespace windsplat;

void read_parameters(const http::Request& request) {
  http::QueryReader query(request.query);
  if (const auto x = query.number("x", -10, 10)) {
    expect(*x >= -10 && *x <= 10, "a number is in range");
  }
  if (const auto bins = query.integer("bins", 1, 4096)) {
    expect(*bins >= 1 && *bins <= 4096, "a whole number is in range");
  }
  if (const auto step = query.integer("step")) {
    expect(!step->empty() && step->size() <= 18 &&
               step->find_first_not_of("0123456789", step->front() == '-' ? 1 : 0) ==
                   std::string::npos,
           "a whole number is written as JSON allows", *step);
  }
  if (const auto range = query.pair("range", 0, 1)) {
    expect((*range)[0] >= 0 && (*range)[0] <= 1 && std::isfinite((*range)[1]),
           "a pair is in range");
  }
  (void)query.boolean("log");
  (void)query.text("preset");
  if (const auto done = query.finish(); !done) {
    expect(!done.error().message.empty() && done.error().message.size() < 2000,
           "a refusal has a short reason");
  }
}

void read_target(std::string_view target) {
  http::Request request;
  const auto ok = http::parse_target(target, "/base/", request);
  if (!ok) {
    expect(ok.error().kind == ErrorKind::malformed, "a target is understood or malformed");
    return;
  }
  std::size_t bytes = 0;
  for (const std::string& segment : request.path) bytes += segment.size() + 1;
  for (const auto& [key, value] : request.query) bytes += key.size() + value.size() + 1;
  expect(bytes <= target.size() + 1, "what is decoded is no longer than what was written", target);
  read_parameters(request);
}

void read_header(std::string_view value) {
  static constexpr std::array<std::string_view, 3> offers{"image/jpeg", "image/png",
                                                          "application/x-npy"};
  const auto chosen = http::choose_type(value, offers);
  expect(!chosen || *chosen < offers.size(), "what is chosen was offered");
  (void)http::accepts_gzip(value);
  const bool matches = http::matches_etag(value, "\"tag\"");
  expect(!matches || value.find('*') != std::string_view::npos ||
             value.find("\"tag\"") != std::string_view::npos,
         "a tag that matches is there", value);
  (void)http::allows_change(value, "\"tag\"");
  expect(!http::origin_allowed(value, "good.example", {}) ||
             value.find("good.example") != std::string_view::npos,
         "an origin of another host is refused", value);
  (void)http::local_host_allowed(value, {"https://good.example"});
  (void)http::normal_base_path(value);
}

// Line ends would start another field.
std::string one_line(std::string_view text) {
  std::string out(text);
  std::replace(out.begin(), out.end(), '\r', ' ');
  std::replace(out.begin(), out.end(), '\n', ' ');
  std::replace(out.begin(), out.end(), '\0', ' ');
  return out;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static std::uint64_t runs = 0;
  const std::string_view input = fuzz::text_of(data, size);
  const std::size_t cut = std::min(input.find('\0'), input.size());
  const std::string_view target = input.substr(0, cut);
  const std::string_view value = cut < input.size() ? input.substr(cut + 1) : std::string_view();
  read_target(target);
  read_header(value);
  fuzz::Peer peer;
  std::string request = "GET " + one_line(target) + " HTTP/1.1\r\nHost: localhost\r\n";
  for (const char* name : {"Accept: ", "If-None-Match: "}) {
    request += name + one_line(value) + "\r\n";
  }
  peer.talk(request + "Connection: close\r\n\r\n", std::chrono::milliseconds(500),
            [](const std::string&) { return false; });
  const std::size_t answers = fuzz::expect_answers(peer.heard(), peer.ended());
  if (peer.ended()) expect(answers == 1, "a request has one answer", peer.heard());
  if (++runs % 256 == 0) fuzz::expect_alive();
  return 0;
}
