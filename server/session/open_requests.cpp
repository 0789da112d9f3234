#include "server/session/open_requests.hpp"

#include <algorithm>

namespace windsplat::session {

void OpenRequests::add(std::uint32_t id, std::uint64_t version) {
  pending_.push_back({id, version});
  latest_id_ = id;
}

std::optional<std::uint64_t> OpenRequests::take(std::uint32_t id) {
  const auto found = std::find_if(pending_.begin(), pending_.end(),
                                  [&](const Request& known) { return known.id == id; });
  if (found == pending_.end()) return std::nullopt;
  const std::uint64_t version = found->version;
  pending_.erase(found);
  return version;
}

std::optional<std::uint32_t> OpenRequests::repeat() {
  const bool is_asked = std::any_of(pending_.begin(), pending_.end(),
                                    [&](const Request& known) { return known.id == latest_id_; });
  if (!latest_id_ || is_asked || full()) return std::nullopt;
  pending_.push_back({*latest_id_, 0});
  return latest_id_;
}

Error OpenRequests::nothing_open() const {
  if (!failure_) return make_error(ErrorKind::not_found, "no dataset is open");
  return make_error(failure_->kind, "no dataset is open: " + failure_->message);
}

}  // namespace windsplat::session
