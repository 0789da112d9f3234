// One HTTP connection: bytes -> checked Request -> router -> response bytes, one request at a time,
// until it is closed or upgraded to a stream.
#pragma once

#include "server/api/router.hpp"
#include "server/transport/connections.hpp"

namespace windsplat::transport {

class Wire;

// `late`: accepted during a drain, which does not wait for it.
void start_http_session(Wire wire, api::Services& services, Connections& connections,
                        access::Visitor visitor, bool late);
// Responds to a plain HTTP request on a TLS port.
void refuse_plain_http(Wire wire, api::Services& services, Connections& connections,
                       access::Visitor visitor, bool late);

}  // namespace windsplat::transport
