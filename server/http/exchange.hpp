// One HTTP exchange as plain values: what the edge has parsed and checked, and what is to be
// answered. Nothing here knows the HTTP library.
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

namespace windsplat::net {

using Headers = std::vector<std::pair<std::string, std::string>>;
using Parameters = std::vector<std::pair<std::string, std::string>>;

struct Request {
  std::string method;             // "GET"
  std::vector<std::string> path;  // decoded segments below the base path; a last "" is left out
  bool below_base = true;         // false: the path is not below the base path, `path` is all of it
  bool ends_in_slash = false;
  Parameters query;  // decoded, in order
  Headers headers;   // in order, as received
  std::string body;
  CancelToken cancel;      // raised when the client has gone
  std::uint64_t peer = 0;  // number of the connection
  std::string address;     // of its other end, without the port; empty: unknown
  std::string id;          // in the answer and in the log (request_id.hpp)

  // The header's values, in order, joined by ", "; names are compared without case.
  [[nodiscard]] std::string header(std::string_view name) const;
};

// Bytes to send with whatever keeps them alive.
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
  bool close = false;  // the connection is of no further use
};

// Answers a request, once, from any thread.
using Reply = std::function<void(Response)>;

bool equal_without_case(std::string_view a, std::string_view b);
std::string_view trimmed(std::string_view text);  // of spaces and tabs
std::vector<std::string_view> split_list(std::string_view text, char separator);  // trimmed parts

// Status line and headers up to the empty line: the response's own, those of the connection, and
// those that every answer bears for safety.
std::string response_head(const Response& response, bool keep_alive);

}  // namespace windsplat::net
