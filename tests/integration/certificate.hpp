// Self-signed certificates for the TLS tests, for localhost and 127.0.0.1.
#pragma once

#include <string>

namespace server_test {

struct Certificate {
  std::string chain;  // PEM
  std::string key;
};

// `name` is the subject, which distinguishes certificates. `days`: expiry relative to now, in days.
Certificate make_certificate(const std::string& name, int days = 2);

}  // namespace server_test
