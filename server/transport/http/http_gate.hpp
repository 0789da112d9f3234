// Whether a request may be served: its form, host and target, then its access.
#pragma once

#include <boost/beast/core/string_type.hpp>
#include <optional>

#include "server/access/admission.hpp"
#include "server/api/server_options.hpp"
#include "server/http/exchange.hpp"

namespace windsplat::transport {

// Parses the target into the request. `version`: as of Beast, 11 for HTTP/1.1. A refusal, or none.
std::optional<http::Response> check_form(const api::ServerOptions& options, http::Request& request,
                                         boost::beast::string_view target, unsigned version);
// Token, origin and login attempts. `upgrade`: to a stream. A refusal, or none.
std::optional<http::Response> check_access(const api::ServerOptions& options,
                                           access::Admission& admission,
                                           const http::Request& request, bool upgrade, bool secure);

}  // namespace windsplat::transport
