// What a client accepts and already has: Accept, Accept-Encoding, If-None-Match, Origin.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace windsplat::net {

// Which of `offers` an Accept header likes best (RFC 9110, 12.5.1); the first offer wins a tie and
// an empty header. None if it accepts none of them.
std::optional<std::size_t> choose_type(std::string_view accept,
                                       std::span<const std::string_view> offers);

bool accepts_gzip(std::string_view accept_encoding);

// Whether If-None-Match names the strong tag, given with its quotes.
bool matches_etag(std::string_view if_none_match, std::string_view etag);

// Whether a change may be made to what has the strong tag, by If-Match; empty: by all means.
bool allows_change(std::string_view if_match, std::string_view etag);

// A page may open a stream if it was served by the same host, or its origin is in `allowed`. `tls`:
// the request came in TLS, so a page of http:// was served by somebody else. Without it the page
// may be https all the same, by a proxy that speaks TLS for us.
bool origin_allowed(std::string_view origin, std::string_view host,
                    const std::vector<std::string>& allowed, bool tls = false);

// localhost, 127.x.y.z or [::1], with or without a port.
bool names_loopback(std::string_view host);

// An IPv4 address or one in brackets, with or without a port: no name that can be made to resolve
// to this machine.
bool is_address(std::string_view host);

// Whether a Host names this machine's loopback, the host of an allowed origin or one of `names`,
// which have no port: a page whose name was made to resolve to this machine (DNS rebinding) says
// another.
bool local_host_allowed(std::string_view host, const std::vector<std::string>& origins,
                        const std::vector<std::string>& names = {});

}  // namespace windsplat::net
