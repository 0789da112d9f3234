// One request of a connection and what is known of its response.
#pragma once

#include <chrono>

#include "server/api/routes.hpp"
#include "server/http/exchange.hpp"

namespace windsplat::transport {

struct CurrentRequest {
  http::Request request;
  const char* route = api::route_other;
  std::chrono::steady_clock::time_point began;  // first byte of the request
  bool charged = false;                         // the request was charged to its address
  bool quiet = false;                           // do not log the request
  bool is_head = false;
  bool keep_alive = false;
};

}  // namespace windsplat::transport
