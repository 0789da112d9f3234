// Percent-decoding with Boost.URL; numbers with from_chars, whole text only.
#include "server/http/request_target.hpp"

#include <algorithm>
#include <array>
#include <boost/url/parse.hpp>
#include <boost/url/url_view.hpp>
#include <charconv>
#include <cmath>
#include <cstdio>

namespace windsplat::http {
namespace {

std::vector<std::string> segments_of(std::string_view path) {
  std::vector<std::string> segments;
  for (const std::string_view part : split_list(path, '/')) {
    if (!part.empty()) segments.emplace_back(part);
  }
  return segments;
}

// An absolute-form target (RFC 9112, 3.2.2) is accepted if its host equals the Host header;
// otherwise nothing is returned.
std::optional<std::string> origin_form(std::string_view target, std::string_view host) {
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (!equal_without_case(target.substr(0, scheme.size()), scheme)) continue;
    const std::string_view rest = target.substr(scheme.size());
    const std::size_t end = std::min(rest.find_first_of("/?#"), rest.size());
    if (!equal_without_case(rest.substr(0, end), host)) return std::nullopt;
    const std::string_view path = rest.substr(end);
    return path.starts_with('/') ? std::string(path) : '/' + std::string(path);
  }
  return std::string(target);
}

// Parses the whole text or fails.
std::optional<double> parse_number(std::string_view text) {
  double value = 0;
  const char* end = text.data() + text.size();
  const auto [stop, fault] = std::from_chars(text.data(), end, value);
  if (fault != std::errc() || stop != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

}  // namespace

std::string normal_base_path(std::string_view path) {
  std::string base = "/";
  for (const std::string& segment : segments_of(path)) base += segment + '/';
  return base;
}

Result<void> parse_target(std::string_view target, std::string_view base_path, Request& request) {
  if (target == "*") {
    request.path = {"*"};
    request.below_base = false;
    return {};
  }
  const auto origin = origin_form(target, request.header("Host"));
  if (!origin) {
    return make_error(ErrorKind::malformed, "the request target '" + printable(target) +
                                                "' does not match the Host header");
  }
  const auto url = boost::urls::parse_origin_form(*origin);
  if (!url) {
    return make_error(ErrorKind::malformed,
                      "the request target '" + printable(target) + "' is not a path");
  }
  for (const auto& segment : url->segments()) request.path.emplace_back(segment);
  request.ends_in_slash = !request.path.empty() && request.path.back().empty();
  if (request.ends_in_slash) request.path.pop_back();
  if (url->has_query()) {
    for (const auto& parameter : url->params()) {
      if (parameter.key.empty() && !parameter.has_value) continue;  // "?" alone, or "&&"
      request.query.emplace_back(parameter.key, parameter.value);
    }
  }
  const std::vector<std::string> base = segments_of(base_path);
  request.below_base = request.path.size() >= base.size() &&
                       std::equal(base.begin(), base.end(), request.path.begin());
  if (request.below_base) {
    request.path.erase(request.path.begin(),
                       request.path.begin() + static_cast<std::ptrdiff_t>(base.size()));
  }
  return {};
}

void QueryReader::fail(ErrorKind kind, std::string message) {
  if (!fault_) fault_ = make_error(kind, std::move(message));
}

const std::string* QueryReader::find(std::string_view key) {
  asked_.push_back(key);
  const std::string* value = nullptr;
  for (const auto& [name, text] : query_) {
    if (name != key) continue;
    if (value != nullptr) fail(ErrorKind::malformed, "query parameter '" + name + "' is repeated");
    value = &text;
  }
  return value;
}

void QueryReader::fail_range(std::string_view key, double min, double max, std::string_view text) {
  std::array<char, 100> limits{};
  std::snprintf(limits.data(), limits.size(), "' must be %g to %g, not ", min, max);
  fail(ErrorKind::invalid,
       "query parameter '" + std::string(key) + limits.data() + printable(text, 40));
}

std::optional<std::string> QueryReader::text(std::string_view key) {
  const std::string* value = find(key);
  return value == nullptr ? std::nullopt : std::optional(*value);
}

std::optional<double> QueryReader::number(std::string_view key, double min, double max) {
  const std::string* text = find(key);
  if (text == nullptr) return std::nullopt;
  const auto value = parse_number(*text);
  if (!value) {
    fail(ErrorKind::malformed,
         "query parameter '" + std::string(key) + "' is not a number: " + printable(*text, 40));
    return std::nullopt;
  }
  if (*value < min || *value > max) {
    fail_range(key, min, max, *text);
    return std::nullopt;
  }
  return value;
}

std::optional<std::string> QueryReader::integer(std::string_view key) {
  const std::string* text = find(key);
  if (text == nullptr) return std::nullopt;
  const std::size_t sign = !text->empty() && (*text)[0] == '-' ? 1 : 0;
  const bool digits = text->size() > sign && text->size() <= 18 &&
                      text->find_first_not_of("0123456789", sign) == std::string::npos;
  if (!digits) {
    fail(ErrorKind::malformed,
         "query parameter '" + std::string(key) + "' is not an integer: " + printable(*text, 40));
    return std::nullopt;
  }
  std::int64_t value = 0;
  std::from_chars(text->data(), text->data() + text->size(), value);
  return std::to_string(value);  // drops leading zeros, which JSON does not allow
}

std::optional<int> QueryReader::integer(std::string_view key, int min, int max) {
  const auto text = integer(key);
  if (!text) return std::nullopt;
  const long long value = std::stoll(*text);  // at most 18 characters
  if (value >= min && value <= max) return static_cast<int>(value);
  fail(ErrorKind::invalid, "query parameter '" + std::string(key) + "' must be " +
                               std::to_string(min) + " to " + std::to_string(max) + ", not " +
                               *text);
  return std::nullopt;
}

std::optional<bool> QueryReader::boolean(std::string_view key) {
  const std::string* text = find(key);
  if (text == nullptr) return std::nullopt;
  if (*text == "true" || *text == "1") return true;
  if (*text == "false" || *text == "0") return false;
  fail(ErrorKind::malformed, "query parameter '" + std::string(key) +
                                 "' must be true or false, not " + printable(*text, 40));
  return std::nullopt;
}

std::optional<std::array<double, 2>> QueryReader::pair(std::string_view key, double min,
                                                       double max) {
  const std::string* text = find(key);
  if (text == nullptr) return std::nullopt;
  const std::vector<std::string_view> parts = split_list(*text, ',');
  std::array<double, 2> out{};
  for (std::size_t i = 0; i < 2; ++i) {
    const auto value = parts.size() == 2 ? parse_number(parts[i]) : std::nullopt;
    if (!value) {
      fail(ErrorKind::malformed, "query parameter '" + std::string(key) +
                                     "' must be two numbers separated by a comma, not " +
                                     printable(*text, 80));
      return std::nullopt;
    }
    if (*value < min || *value > max) {
      fail_range(key, min, max, parts[i]);
      return std::nullopt;
    }
    out[i] = *value;
  }
  return out;
}

std::string QueryReader::known() const {
  if (asked_.empty()) return "this resource has no query parameters";
  std::string list = "known parameters: ";
  for (std::size_t i = 0; i < asked_.size(); ++i) {
    if (i > 0) list += ", ";
    list += asked_[i];
  }
  return list;
}

Result<void> QueryReader::finish() const {
  if (fault_) return *fault_;
  for (const auto& [name, value] : query_) {
    if (std::find(asked_.begin(), asked_.end(), name) == asked_.end()) {
      return make_error(ErrorKind::malformed,
                        "unknown query parameter '" + printable(name, 40) + "'; " + known());
    }
  }
  return {};
}

}  // namespace windsplat::http
