// Certificates for the tests of TLS: made here, signed by themselves, for localhost and 127.0.0.1.
#pragma once

#include <string>

namespace net_test {

struct Certificate {
  std::string chain;  // PEM
  std::string key;
};

// `name` is its subject, by which a client tells it from another. `days` before or after now it
// ends.
Certificate make_certificate(const std::string& name, int days = 2);

}  // namespace net_test
