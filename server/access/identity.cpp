// The header as received: values are bytes, which the log escapes.
#include "server/access/identity.hpp"

#include <algorithm>
#include <optional>

namespace windsplat::access {
namespace {

constexpr std::string_view token_marks = "!#$%&'*+-.^_`|~";

bool is_token_char(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
         token_marks.find(c) != std::string_view::npos;
}

}  // namespace

bool is_field_name(std::string_view name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), is_token_char);
}

Result<std::string> named_user(const http::Request& request, std::string_view header) {
  std::optional<std::string_view> user;
  for (const auto& [name, value] : request.headers) {
    if (!http::equal_without_case(name, header)) continue;
    if (user) {
      return make_error(ErrorKind::malformed,
                        "the request has several headers " + std::string(header) +
                            ": the proxy must replace what clients send (--identity-header)");
    }
    user = http::trimmed(value);
  }
  if (user && user->size() > user_bytes_max) {
    return make_error(ErrorKind::malformed, "the header " + std::string(header) + " has " +
                                                std::to_string(user->size()) + " bytes; at most " +
                                                std::to_string(user_bytes_max) +
                                                " are a name (--identity-header)");
  }
  return std::string(user.value_or(""));
}

std::string counted_user(std::string_view user) { return "user:" + std::string(user); }

}  // namespace windsplat::access
