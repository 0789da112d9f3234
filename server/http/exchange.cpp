// Header lookup of requests; serialisation of status line and headers.
#include "server/http/exchange.hpp"

#include <array>
#include <ctime>

namespace windsplat::http {
namespace {

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

// Reason phrases of RFC 9110 and RFC 6585.
std::string_view reason(int status) {
  switch (status) {
    case 200:
      return "OK";
    case 201:
      return "Created";
    case 202:
      return "Accepted";
    case 204:
      return "No Content";
    case 303:
      return "See Other";
    case 304:
      return "Not Modified";
    case 308:
      return "Permanent Redirect";
    case 400:
      return "Bad Request";
    case 401:
      return "Unauthorized";
    case 403:
      return "Forbidden";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 406:
      return "Not Acceptable";
    case 408:
      return "Request Timeout";
    case 411:
      return "Length Required";
    case 412:
      return "Precondition Failed";
    case 413:
      return "Content Too Large";
    case 415:
      return "Unsupported Media Type";
    case 409:
      return "Conflict";
    case 417:
      return "Expectation Failed";
    case 421:
      return "Misdirected Request";
    case 422:
      return "Unprocessable Content";
    case 426:
      return "Upgrade Required";
    case 429:
      return "Too Many Requests";
    case 431:
      return "Request Header Fields Too Large";
    case 499:
      return "Client Closed Request";
    case 500:
      return "Internal Server Error";
    case 501:
      return "Not Implemented";
    case 503:
      return "Service Unavailable";
    case 505:
      return "HTTP Version Not Supported";
    case 507:
      return "Insufficient Storage";
    default:
      return "Answer";
  }
}

// IMF-fixdate; names are literal so that the locale does not matter.
std::string http_date(std::time_t time) {
  constexpr std::array<const char*, 7> days{"Sun", "Mon", "Tue", "Wed", "Thu", "Fri", "Sat"};
  constexpr std::array<const char*, 12> months{"Jan", "Feb", "Mar", "Apr", "May", "Jun",
                                               "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"};
  std::tm utc{};
  gmtime_r(&time, &utc);
  std::array<char, 16> day{};
  std::array<char, 32> rest{};
  std::strftime(day.data(), day.size(), ", %d ", &utc);
  std::strftime(rest.data(), rest.size(), " %Y %H:%M:%S GMT", &utc);
  return std::string(days[static_cast<std::size_t>(utc.tm_wday)]) + day.data() +
         months[static_cast<std::size_t>(utc.tm_mon)] + rest.data();
}

bool has_header(const Response& response, std::string_view name) {
  for (const auto& [key, value] : response.headers) {
    if (equal_without_case(key, name)) return true;
  }
  return false;
}

template <class Bytes>
Body owned(Bytes bytes) {
  auto owner = std::make_shared<const Bytes>(std::move(bytes));
  const auto* data = reinterpret_cast<const std::uint8_t*>(owner->data());
  const std::size_t size = owner->size();
  return {std::move(owner), {data, size}};
}

}  // namespace

std::string Request::header(std::string_view name) const {
  std::string joined;
  bool found = false;
  for (const auto& [key, value] : headers) {
    if (!equal_without_case(key, name)) continue;
    if (found) joined += ", ";
    joined += value;
    found = true;
  }
  return joined;
}

Body Body::of(std::string text) { return owned(std::move(text)); }

Body Body::of(std::vector<std::uint8_t> bytes) { return owned(std::move(bytes)); }

Body Body::of_static(std::string_view text) {
  return {nullptr, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}};
}

bool equal_without_case(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (lower(a[i]) != lower(b[i])) return false;
  }
  return true;
}

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

std::vector<std::string_view> split_list(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  while (true) {
    const std::size_t end = text.find(separator);
    parts.push_back(trimmed(text.substr(0, end)));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

std::string response_head(const Response& response, bool keep_alive) {
  std::string head = "HTTP/1.1 " + std::to_string(response.status) + ' ';
  head += reason(response.status);
  const auto add = [&head](std::string_view name, std::string_view value) {
    head += "\r\n";
    head += name;
    head += ": ";
    head += value;
  };
  add("Server", "windsplat");
  add("Date", http_date(std::time(nullptr)));
  for (const auto& [name, value] : response.headers) add(name, value);
  if (!response.content_type.empty()) add("Content-Type", response.content_type);
  // RFC 9110, 8.6: neither has a Content-Length.
  if (response.status != 204 && response.status != 304) {
    add("Content-Length", std::to_string(response.body.bytes.size()));
  }
  add("Connection", keep_alive ? "keep-alive" : "close");
  add("X-Content-Type-Options", "nosniff");
  add("Referrer-Policy", "no-referrer");
  add("Permissions-Policy", "camera=(), geolocation=(), microphone=(), payment=(), usb=()");
  if (!has_header(response, "Cache-Control")) add("Cache-Control", "no-store");
  if (!has_header(response, "Content-Security-Policy")) {
    add("Content-Security-Policy", "default-src 'none'; frame-ancestors 'none'");
  }
  if (!has_header(response, "Cross-Origin-Resource-Policy")) {
    add("Cross-Origin-Resource-Policy", "same-origin");
  }
  head += "\r\n\r\n";
  return head;
}

}  // namespace windsplat::http
