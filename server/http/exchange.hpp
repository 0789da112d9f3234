// One HTTP exchange as plain values: the parsed and checked request, and the response. Independent
// of the HTTP library.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/base/cancel.hpp"

namespace windsplat::http {

using Headers = std::vector<std::pair<std::string, std::string>>;
using Parameters = std::vector<std::pair<std::string, std::string>>;

class BodySink;

struct Request {
  std::string method;             // "GET"
  std::vector<std::string> path;  // decoded segments below the base path; an empty last segment is
                                  // omitted
  bool below_base = true;         // false: `path` is the whole path
  bool ends_in_slash = false;
  Parameters query;  // decoded, in order
  Headers headers;   // in the order received
  std::string body;
  std::shared_ptr<BodySink> sink;  // has taken the body in place of `body`; null: none
  CancelToken cancel;              // raised when the client disconnects
  std::uint64_t peer = 0;          // id of the connection
  std::string address;             // of the client, without a port, or its user; empty: unknown
  std::string id;                  // sent with the response and logged (request_id.hpp)

  // All values of the header in order, joined by ", "; names are case-insensitive.
  [[nodiscard]] std::string header(std::string_view name) const;
};

// Bytes to send, with shared ownership.
struct Body {
  std::shared_ptr<const void> owner;
  std::span<const std::uint8_t> bytes;

  static Body of(std::string text);
  static Body of(std::vector<std::uint8_t> bytes);
  static Body of_static(std::string_view text);
};

struct Response {
  int status = 200;
  std::string content_type;  // empty: no body
  Headers headers;
  Body body;
  bool close = false;  // close the connection after the response
};

// Responds to a request; call it once, from any thread.
using Reply = std::function<void(Response)>;

bool equal_without_case(std::string_view a, std::string_view b);
std::string_view trimmed(std::string_view text);  // without leading and trailing spaces and tabs
std::vector<std::string_view> split_list(std::string_view text, char separator);  // trimmed parts

// Status line and headers up to the empty line: those of the response, those of the connection, and
// the security headers of every response.
std::string response_head(const Response& response, bool keep_alive);

}  // namespace windsplat::http
