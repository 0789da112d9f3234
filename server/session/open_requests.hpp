// Requests of the client to open datasets, until each has been described or refused.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "server/base/error.hpp"

namespace windsplat::session {

class OpenRequests {
 public:
  static constexpr std::size_t pending_max = 4;

  [[nodiscard]] bool pending() const { return !pending_.empty(); }
  [[nodiscard]] bool full() const { return pending_.size() >= pending_max; }

  // `version`: the version of the view after the change made by the request; 0 if it made none.
  void add(std::uint32_t id, std::uint64_t version);
  // Ends the request and returns its version; nullopt if it is not pending.
  std::optional<std::uint64_t> take(std::uint32_t id);
  // Repeats the latest request after its dataset was reopened and returns its id; nullopt if there
  // was none, it is pending, or too many are.
  std::optional<std::uint32_t> repeat();

  // Why the last view could not be shown.
  void failed(const Error& error) { failure_ = error; }
  void succeeded() { failure_.reset(); }
  // The error of a request to play or draw without a dataset.
  [[nodiscard]] Error nothing_open() const;

 private:
  struct Request {
    std::uint32_t id = 0;
    std::uint64_t version = 0;
  };
  std::vector<Request> pending_;
  std::optional<std::uint32_t> latest_id_;
  std::optional<Error> failure_;
};

}  // namespace windsplat::session
