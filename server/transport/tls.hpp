// The certificate and key of the daemon -> what TLS handshakes are made with.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "server/base/error.hpp"

namespace windsplat::net {

// Opaque: only the files of the network see OpenSSL (tls_context.hpp).
struct TlsContext;

inline constexpr std::size_t pem_bytes_max = std::size_t{1} << 20;

// `chain` is the server's own certificate and then those that lead to a root, `key` its private key
// without a passphrase, both as PEM. TLS 1.2 and 1.3, ciphers with forward secrecy alone.
// Errors: invalid, saying which of the two is at fault and why.
Result<std::shared_ptr<TlsContext>> make_tls(const std::string& chain, const std::string& key);

// Seconds since 1970 after which clients refuse the server's own certificate.
std::int64_t certificate_ends(const TlsContext& tls);

// Why each handshake costs more than it needs to: a large RSA key, a long chain. Empty: it does
// not.
std::string expensive_handshakes(const TlsContext& tls);

}  // namespace windsplat::net
