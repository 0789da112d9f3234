// Builds the TLS context from the certificate and key of the daemon.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "server/base/error.hpp"

namespace windsplat::transport {

// Opaque: only the network sources include OpenSSL (tls_context.hpp).
struct TlsContext;

inline constexpr std::size_t pem_bytes_max = std::size_t{1} << 20;

// `chain` holds the server's certificate followed by the intermediates, `key` its private key
// without passphrase, both as PEM. TLS 1.2 and 1.3, only ciphers with forward secrecy. Errors:
// invalid, naming the certificate or the key and the reason.
Result<std::shared_ptr<TlsContext>> make_tls(const std::string& chain, const std::string& key);

// Expiry of the server's certificate, in seconds since 1970.
std::int64_t certificate_ends(const TlsContext& tls);

// Reason why handshakes are expensive (a large RSA key or a long chain); empty if they are not.
std::string expensive_handshakes(const TlsContext& tls);

}  // namespace windsplat::transport
