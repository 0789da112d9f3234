// Matches weighted lists of header values against the offers.
#include "server/http/negotiate.hpp"

#include <arpa/inet.h>

#include <algorithm>
#include <charconv>
#include <string>
#include <utility>

#include "server/http/exchange.hpp"

namespace windsplat::http {
namespace {

struct Weighted {
  std::string_view name;
  double weight = 1;
};

// "a;q=0.5, b" -> names with weights. An invalid weight counts as 0.
std::vector<Weighted> weighted_list(std::string_view header) {
  std::vector<Weighted> out;
  for (const std::string_view entry : split_list(header, ',')) {
    const auto parts = split_list(entry, ';');
    if (parts[0].empty()) continue;
    Weighted weighted{parts[0]};
    for (std::size_t i = 1; i < parts.size(); ++i) {
      if (parts[i].size() < 2 || !equal_without_case(parts[i].substr(0, 2), "q=")) continue;
      const std::string_view text = parts[i].substr(2);
      const auto [stop, fault] =
          std::from_chars(text.data(), text.data() + text.size(), weighted.weight);
      const bool whole = fault == std::errc() && stop == text.data() + text.size();
      if (!whole || !(weighted.weight >= 0 && weighted.weight <= 1)) weighted.weight = 0;
    }
    out.push_back(weighted);
  }
  return out;
}

// Specificity of a media range for a type: 3 exact, 2 "image/*", 1 "*/*", 0 no match.
int closeness(std::string_view range, std::string_view type) {
  if (equal_without_case(range, type)) return 3;
  if (range == "*/*") return 1;
  const std::string_view family = type.substr(0, type.find('/') + 1);
  const bool wild = range.size() == family.size() + 1 && range.back() == '*';
  return wild && equal_without_case(range.substr(0, family.size()), family) ? 2 : 0;
}

double weight_of(const std::vector<Weighted>& list, std::string_view type) {
  int best = 0;
  double weight = 0;
  for (const Weighted& entry : list) {
    const int close = closeness(entry.name, type);
    if (close > best) {
      best = close;
      weight = entry.weight;
    }
  }
  return weight;
}

std::string_view without_suffix(std::string_view text, std::string_view suffix) {
  return text.size() > suffix.size() && text.ends_with(suffix)
             ? text.substr(0, text.size() - suffix.size())
             : text;
}

std::string_view without_port(std::string_view host) {
  const bool literal = !host.empty() && host.front() == '[';
  return host.substr(0, literal ? host.find(':', host.find(']')) : host.rfind(':'));
}

}  // namespace

std::optional<std::size_t> choose_type(std::string_view accept,
                                       std::span<const std::string_view> offers) {
  const std::vector<Weighted> list = weighted_list(accept);
  if (list.empty()) return 0;
  std::optional<std::size_t> best;
  double best_weight = 0;
  for (std::size_t i = 0; i < offers.size(); ++i) {
    const double weight = weight_of(list, offers[i]);
    if (weight > best_weight) {
      best = i;
      best_weight = weight;
    }
  }
  return best;
}

bool accepts_gzip(std::string_view accept_encoding) {
  double any = 0;
  for (const Weighted& entry : weighted_list(accept_encoding)) {
    if (equal_without_case(entry.name, "gzip")) return entry.weight > 0;
    if (entry.name == "*") any = entry.weight;
  }
  return any > 0;
}

bool matches_etag(std::string_view if_none_match, std::string_view etag) {
  const auto names = split_list(if_none_match, ',');
  return std::any_of(names.begin(), names.end(), [&](std::string_view name) {
    if (name.substr(0, 2) == "W/") name.remove_prefix(2);  // weak comparison (RFC 9110, 13.1.2)
    return name == "*" || name == etag;
  });
}

bool allows_change(std::string_view if_match, std::string_view etag) {
  if (if_match.empty()) return true;
  const auto names = split_list(if_match, ',');  // strong comparison (RFC 9110, 13.1.1)
  return std::any_of(names.begin(), names.end(),
                     [&](std::string_view name) { return name == "*" || name == etag; });
}

bool origin_allowed(std::string_view origin, std::string_view host,
                    const std::vector<std::string>& allowed, bool tls) {
  for (const auto& [scheme, port] :
       {std::pair<std::string_view, std::string_view>{"http://", ":80"}, {"https://", ":443"}}) {
    if (origin.substr(0, scheme.size()) != scheme || (tls && scheme == "http://")) continue;
    // The default port of the scheme may be present or absent on either side.
    const std::string_view authority = without_suffix(origin.substr(scheme.size()), port);
    if (!authority.empty() && equal_without_case(authority, without_suffix(host, port)))
      return true;
  }
  return std::any_of(allowed.begin(), allowed.end(),
                     [&](const std::string& other) { return equal_without_case(origin, other); });
}

bool names_loopback(std::string_view host) {
  const std::string_view name = without_port(host);
  if (equal_without_case(name, "localhost") || name == "[::1]") return true;
  constexpr std::string_view digits = "0123456789.";
  return name.starts_with("127.") && name.find_first_not_of(digits) == std::string_view::npos;
}

bool is_address(std::string_view host) {
  const std::string name(without_port(host));
  in_addr v4{};
  if (inet_pton(AF_INET, name.c_str(), &v4) == 1) return true;
  in6_addr v6{};
  return name.size() > 2 && name.front() == '[' && name.back() == ']' &&
         inet_pton(AF_INET6, name.substr(1, name.size() - 2).c_str(), &v6) == 1;
}

bool local_host_allowed(std::string_view host, const std::vector<std::string>& origins,
                        const std::vector<std::string>& names) {
  if (names_loopback(host)) return true;
  const std::string_view name = without_port(host);
  return std::any_of(origins.begin(), origins.end(),
                     [&](const std::string& origin) { return origin_allowed(origin, host, {}); }) ||
         std::any_of(names.begin(), names.end(),
                     [&](const std::string& other) { return equal_without_case(name, other); });
}

}  // namespace windsplat::http
