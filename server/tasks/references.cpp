// The cache is a short list, most recently used first.
#include "server/tasks/references.hpp"

#include <algorithm>
#include <utility>

namespace windsplat::tasks {
namespace {

// Retry-After time for a reference that has not been started, whose duration is unknown.
constexpr int retry_after_s = 5;

Error too_many(std::string detail) {
  Error error = make_error(ErrorKind::busy, std::move(detail));
  error.retry_after_s = retry_after_s;
  return error;
}

}  // namespace

void References::keep(Kept kept) {
  const std::lock_guard lock(mutex_);
  kept_.remove_if([&](const Kept& old) { return old.description.id == kept.description.id; });
  kept_.push_front(std::move(kept));
  std::size_t bytes = 0;
  for (const Kept& one : kept_) bytes += one.png->size();
  while (kept_.size() > 1 && bytes > bytes_max) {
    bytes -= kept_.back().png->size();
    kept_.pop_back();
  }
}

std::optional<References::Kept> References::find(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(kept_.begin(), kept_.end(),
                                  [&](const Kept& one) { return one.description.id == id; });
  if (found == kept_.end()) return std::nullopt;
  kept_.splice(kept_.begin(), kept_, found);
  return *found;
}

Result<References::Ticket> References::admit(const std::string& address, const CancelToken& cancel,
                                             Drawn kind) {
  const std::lock_guard lock(mutex_);
  std::erase_if(wanted_,
                [](const Wanted& one) { return one.ticket.expired() || one.cancel.cancelled(); });
  const bool has_one = std::any_of(wanted_.begin(), wanted_.end(),
                                   [&](const Wanted& one) { return one.address == address; });
  if (has_one) {
    return too_many(
        "a reference or an animation is being drawn for this address; cancel its job or wait for "
        "it");
  }
  const auto of_kind = std::count_if(wanted_.begin(), wanted_.end(),
                                     [&](const Wanted& one) { return one.kind == kind; });
  if (static_cast<std::size_t>(of_kind) >= wanted_max) {
    std::string detail = std::to_string(wanted_max);
    detail += kind == Drawn::reference ? " references" : " animations";
    detail += " are waiting or being drawn, which is the limit; try again later";
    return too_many(std::move(detail));
  }
  auto ticket = std::make_shared<const char>();
  wanted_.push_back({address, cancel, kind, ticket});
  return Ticket(std::move(ticket));
}

}  // namespace windsplat::tasks
