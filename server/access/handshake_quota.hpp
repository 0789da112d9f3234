// Processor time of TLS handshakes: of each address, of all unknown ones and of all known ones.
#pragma once

#include <optional>

#include "server/access/address_table.hpp"

namespace windsplat::access {

class HandshakeQuota {
 public:
  using Micros = TokenBucket::Micros;

  explicit HandshakeQuota(const Limits& limits)
      : all_ms_(limits.handshake_ms), own_ms_(limits.handshake_ms_per_address) {}

  // `trusted`: of a proxy. The limits may be overdrawn, like those of bytes and render time: the
  // cost of a handshake is known afterwards.
  std::optional<Refusal> may_begin(AddressUsage& usage, bool trusted, Micros now);
  // `usage` null: of a forgotten address. Does not allocate.
  void took(AddressUsage* usage, bool trusted, Micros took, Micros now);

 private:
  // The bucket besides the address's own; null: none.
  TokenBucket* shared(const AddressUsage* usage, bool trusted);

  const double all_ms_;  // limits in milliseconds a second
  const double own_ms_;
  TokenBucket strangers_, known_;
};

}  // namespace windsplat::access
