// The truths that were drawn of late, and who has one drawn: pictures in, pictures out, the least
// recently asked for forgotten.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "protocol/measurements.hpp"
#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/image/encode.hpp"

namespace windsplat::net {

// Thread-safe.
class References {
 public:
  static constexpr std::size_t bytes_max = std::size_t{32} << 20;  // of encoded pictures
  static constexpr std::size_t wanted_max = 4;                     // that wait or are drawn

  struct Kept {
    protocol::ReferenceDescription description;
    std::shared_ptr<const image::Bytes> png;
  };

  // One is kept, however large.
  void keep(Kept kept);
  std::optional<Kept> find(const std::string& id);

  // Leave to have one drawn, as long as the answer is held and `cancel` is not raised; an address
  // has one at a time. Errors: busy.
  using Ticket = std::shared_ptr<const void>;
  Result<Ticket> admit(const std::string& address, const CancelToken& cancel);
  // Of jobs of the renderer: no connection's number.
  std::uint64_t next_owner() { return ~owners_++; }

 private:
  struct Wanted {
    std::string address;
    CancelToken cancel;
    std::weak_ptr<const void> ticket;
  };

  std::atomic<std::uint64_t> owners_{0};
  std::mutex mutex_;
  std::list<Kept> kept_;  // the most recently asked for first
  std::vector<Wanted> wanted_;
};

}  // namespace windsplat::net
