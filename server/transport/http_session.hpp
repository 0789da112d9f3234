// One HTTP connection: bytes -> checked Request -> router -> response bytes, one at a time, until
// it is closed or becomes a stream.
#pragma once

#include "server/api/router.hpp"
#include "server/transport/connections.hpp"

namespace windsplat::net {

class Wire;

// `late`: a drain does not wait for it.
void start_http_session(Wire wire, Services& services, Connections& connections, Visitor visitor,
                        bool late);
// Answers a request in plain HTTP that came where TLS is spoken.
void refuse_plain_http(Wire wire, Services& services, Connections& connections, Visitor visitor,
                       bool late);

}  // namespace windsplat::net
