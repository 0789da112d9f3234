// Content negotiation, conditional requests and origin checks: Accept, Accept-Encoding,
// If-None-Match, Origin.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace windsplat::http {

// Returns the offer that an Accept header prefers (RFC 9110, 12.5.1); the first offer if there is a
// tie or the header is empty. nullopt if none is acceptable.
std::optional<std::size_t> choose_type(std::string_view accept,
                                       std::span<const std::string_view> offers);

bool accepts_gzip(std::string_view accept_encoding);

// Whether If-None-Match contains the strong tag, given in quotes.
bool matches_etag(std::string_view if_none_match, std::string_view etag);

// Whether If-Match permits a change of the resource with the strong tag; true if the header is
// empty.
bool allows_change(std::string_view if_match, std::string_view etag);

// A page may open a stream if it has the same host or its origin is in `allowed`. `tls`: the
// request used TLS, so an http:// page is another origin. Without it the page may still be
// https://, behind a proxy that terminates TLS.
bool origin_allowed(std::string_view origin, std::string_view host,
                    const std::vector<std::string>& allowed, bool tls = false);

// localhost, 127.x.y.z or [::1], with or without a port.
bool names_loopback(std::string_view host);

// An IPv4 address or a bracketed IPv6 address, with or without port: unlike a name, it cannot be
// rebound to this machine.
bool is_address(std::string_view host);

// Whether a Host is a loopback name, the host of an allowed origin or one of `names` (without
// port). Protects against DNS rebinding, where the page's own name resolves to this machine.
bool local_host_allowed(std::string_view host, const std::vector<std::string>& origins,
                        const std::vector<std::string>& names = {});

}  // namespace windsplat::http
