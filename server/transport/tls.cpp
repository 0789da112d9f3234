// Builds an OpenSSL context with the accepted protocol versions and ciphers from PEM files.
#include "server/transport/tls.hpp"

#include <openssl/ssl.h>
#include <openssl/x509.h>

#include <array>
#include <boost/asio/buffer.hpp>
#include <ctime>
#include <string_view>

#include "server/transport/tls_context.hpp"

namespace windsplat::transport {
namespace {

namespace asio = boost::asio;
using ErrorCode = boost::system::error_code;

// For TLS 1.2; all ciphers of 1.3 have forward secrecy.
constexpr const char* ciphers = "ECDHE+AESGCM:ECDHE+CHACHA20";

// Finite-field groups cost up to 7 ms of processor time for a few bytes sent by the client, P-384
// twenty times as much as these. P-256 is mandatory in TLS 1.3 (RFC 8446, 9.1).
constexpr const char* groups = "X25519:P-256";

// Above these limits handshakes are expensive. Doubling the bits of an RSA key makes a signature
// eight times slower.
constexpr int rsa_bits_usual_max = 4096;
constexpr int chain_bytes_usual_max = 16 * 1024;

// ALPN wire format (RFC 7301): length and name.
constexpr std::array<unsigned char, 9> http_1_1{8, 'h', 't', 't', 'p', '/', '1', '.', '1'};

// Rejects with an alert a client whose protocols do not include this one.
int choose_protocol(SSL* /*ssl*/, const unsigned char** chosen, unsigned char* chosen_bytes,
                    const unsigned char* offered, unsigned int offered_bytes, void* /*data*/) {
  unsigned char* found = nullptr;
  if (SSL_select_next_proto(&found, chosen_bytes, http_1_1.data(), http_1_1.size(), offered,
                            offered_bytes) != OPENSSL_NPN_NEGOTIATED) {
    return SSL_TLSEXT_ERR_ALERT_FATAL;
  }
  *chosen = found;
  return SSL_TLSEXT_ERR_OK;
}

// Refuses a passphrase: there is no terminal to prompt on.
int no_passphrase(char* /*text*/, int /*size*/, int /*writing*/, void* /*data*/) { return -1; }

Error pem_error(const char* what, const ErrorCode& fault) {
  return make_error(ErrorKind::invalid, std::string(what) + ": " + printable(fault.message()));
}

}  // namespace

Result<std::shared_ptr<TlsContext>> make_tls(const std::string& chain, const std::string& key) {
  auto tls = std::make_shared<TlsContext>();
  SSL_CTX* const handle = tls->context.native_handle();
  SSL_CTX_set_min_proto_version(handle, TLS1_2_VERSION);
  SSL_CTX_set_options(handle, SSL_OP_NO_COMPRESSION | SSL_OP_NO_RENEGOTIATION |
                                  SSL_OP_CIPHER_SERVER_PREFERENCE | SSL_OP_PRIORITIZE_CHACHA);
  // Sessions are resumed by tickets kept by the clients, which need no memory here. Resumption
  // saves the signature, the most expensive part of a handshake, but not the key exchange.
  SSL_CTX_set_session_cache_mode(handle, SSL_SESS_CACHE_OFF);
  // Early data (0-RTT) can be replayed by an attacker.
  SSL_CTX_set_max_early_data(handle, 0);
  // Most connections are idle most of the time.
  SSL_CTX_set_mode(handle, SSL_MODE_RELEASE_BUFFERS);
  SSL_CTX_set_default_passwd_cb(handle, no_passphrase);
  SSL_CTX_set_alpn_select_cb(handle, choose_protocol, nullptr);
  if (SSL_CTX_set_cipher_list(handle, ciphers) != 1) {
    return make_error(ErrorKind::internal, "OpenSSL supports none of the required TLS ciphers");
  }
  if (SSL_CTX_set1_groups_list(handle, groups) != 1) {
    return make_error(ErrorKind::internal, "OpenSSL does not support the groups X25519 and P-256");
  }
  ErrorCode fault;
  tls->context.use_certificate_chain(asio::buffer(chain), fault);
  if (fault && chain.find("PRIVATE KEY-----") != std::string::npos) {
    return make_error(ErrorKind::invalid,
                      "the certificate file contains a private key; are the two files swapped?");
  }
  if (fault) return pem_error("is not a PEM certificate", fault);
  // Also checks that the key matches the certificate.
  tls->context.use_private_key(asio::buffer(key), asio::ssl::context::pem, fault);
  if (fault) return pem_error("is not the private key of the certificate", fault);
  return tls;
}

std::int64_t certificate_ends(const TlsContext& tls) {
  auto& context = const_cast<asio::ssl::context&>(tls.context);  // native_handle() is not const
  const X509* const own = SSL_CTX_get0_certificate(context.native_handle());
  std::tm end{};
  if (own == nullptr || ASN1_TIME_to_tm(X509_get0_notAfter(own), &end) != 1) return 0;
  return timegm(&end);
}

std::string expensive_handshakes(const TlsContext& tls) {
  auto& context = const_cast<asio::ssl::context&>(tls.context);  // native_handle() is not const
  SSL_CTX* const handle = context.native_handle();
  X509* const own = SSL_CTX_get0_certificate(handle);
  const EVP_PKEY* const key = SSL_CTX_get0_privatekey(handle);
  if (own == nullptr || key == nullptr) return "";
  if (EVP_PKEY_get_base_id(key) == EVP_PKEY_RSA && EVP_PKEY_get_bits(key) > rsa_bits_usual_max) {
    return "RSA key of " + std::to_string(EVP_PKEY_get_bits(key)) + " bits; P-256 signs faster";
  }
  STACK_OF(X509)* others = nullptr;
  SSL_CTX_get0_chain_certs(handle, &others);
  int bytes = i2d_X509(own, nullptr);
  for (int n = 0; n < sk_X509_num(others); ++n) {
    bytes += i2d_X509(sk_X509_value(others, n), nullptr);
  }
  if (bytes <= chain_bytes_usual_max) return "";
  return "certificate chain of " + std::to_string(bytes) + " bytes, sent in each handshake";
}

bool is_plain_http(const ErrorCode& fault) {
  return fault.category() == asio::error::get_ssl_category() &&
         ERR_GET_REASON(static_cast<unsigned long>(fault.value())) == SSL_R_HTTP_REQUEST;
}

}  // namespace windsplat::transport
