// Cache of recently drawn references and admission of new ones; the least recently used is evicted.
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

namespace windsplat::tasks {

// Thread-safe.
class References {
 public:
  static constexpr std::size_t bytes_max = std::size_t{32} << 20;  // limit on encoded pictures
  static constexpr std::size_t wanted_max = 4;  // of a kind, waiting or being drawn

  struct Kept {
    protocol::ReferenceDescription description;
    std::shared_ptr<const image::Bytes> png;
  };

  // At least one picture is kept, however large.
  void keep(Kept kept);
  std::optional<Kept> find(const std::string& id);

  enum class Drawn { reference, animation };
  // Admits one drawing, valid while the value is held and `cancel` is not raised; one of either
  // kind at a time per address. Errors: busy.
  using Ticket = std::shared_ptr<const void>;
  Result<Ticket> admit(const std::string& address, const CancelToken& cancel,
                       Drawn kind = Drawn::reference);
  // Owner id of render jobs; distinct from all connection ids.
  std::uint64_t next_owner() { return ~owners_++; }

 private:
  struct Wanted {
    std::string address;
    CancelToken cancel;
    Drawn kind;
    std::weak_ptr<const void> ticket;
  };

  std::atomic<std::uint64_t> owners_{0};
  std::mutex mutex_;
  std::list<Kept> kept_;  // most recently used first
  std::vector<Wanted> wanted_;
};

}  // namespace windsplat::tasks
