// The OpenSSL context behind TlsContext, for the network sources only.
#pragma once

#include <boost/asio/ssl/context.hpp>
#include <boost/system/error_code.hpp>

namespace windsplat::transport {

struct TlsContext {
  boost::asio::ssl::context context{boost::asio::ssl::context::tls_server};
};

// Whether a handshake failed because the client sent plain HTTP.
bool is_plain_http(const boost::system::error_code& fault);

}  // namespace windsplat::transport
