// Request id for the response and the log: the client's if it is valid, otherwise a new one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace windsplat::http {

inline constexpr const char* request_id_header = "X-Request-Id";
inline constexpr std::size_t request_id_bytes_max = 64;

// 1 to 64 of A-Z a-z 0-9 . _ -
bool is_request_id(std::string_view text);

// Used by one thread. Ids are unique within a server, and very probably between servers.
class RequestIds {
 public:
  RequestIds();
  std::string next();  // 16 hexadecimal digits

 private:
  std::uint64_t state_;
};

}  // namespace windsplat::http
