#include "server/http/framing.hpp"

#include <algorithm>
#include <charconv>
#include <string_view>

namespace windsplat::http {
namespace {

bool is_embedder_host(std::string_view host) {
  return !host.empty() && host.front() != '.' && std::all_of(host.begin(), host.end(), [](char c) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    return letter || c == '-' || c == '.' || c == '_';
  });
}

bool is_embedder_port(std::string_view text) {
  constexpr unsigned port_max = 65535;
  unsigned port = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, fault] = std::from_chars(text.data(), end, port);
  return fault == std::errc() && rest == end && port >= 1 && port <= port_max;
}

}  // namespace

bool asks_embedded(const Request& request) {
  return std::any_of(request.query.begin(), request.query.end(),
                     [](const auto& parameter) { return parameter.first == "embed"; });
}

bool is_in_frame(const Request& request) {
  const std::string into = request.header("Sec-Fetch-Dest");
  return into == "iframe" || into == "frame" || into == "embed" || into == "object";
}

std::string frame_ancestors(const std::vector<std::string>& embedders) {
  std::string directive = "frame-ancestors 'self'";
  for (const std::string& origin : embedders) directive += ' ' + origin;
  return directive;
}

bool is_embedder(const std::string& text) {
  std::string_view rest = text;
  for (const std::string_view scheme : {"https://", "http://"}) {
    if (!rest.starts_with(scheme)) continue;
    rest.remove_prefix(scheme.size());
    if (rest.starts_with("*.")) rest.remove_prefix(2);
    const std::size_t colon = rest.find(':');
    const bool has_port = colon != std::string_view::npos;
    return is_embedder_host(rest.substr(0, colon)) &&
           (!has_port || is_embedder_port(rest.substr(colon + 1)));
  }
  return false;
}

}  // namespace windsplat::http
