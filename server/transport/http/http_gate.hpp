// Whether a request may be served: its form, host and target, then its access; and logins.
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
// Token, origin and login attempts. `health`: answered under any load. `upgrade`: to a stream. A
// refusal, or none.
std::optional<http::Response> check_access(const api::ServerOptions& options,
                                           access::Admission& admission,
                                           const http::Request& request, bool health, bool upgrade,
                                           bool secure);
// The answer to a login; none: the request is another.
std::optional<http::Response> answer_login(const api::ServerOptions& options,
                                           access::Admission& admission,
                                           const http::Request& request, bool secure);

}  // namespace windsplat::transport
