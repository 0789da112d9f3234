// Work of client jobs on the renderer's thread while that is otherwise idle.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/tasks/backend.hpp"

namespace windsplat::tasks {

// Owner of the render jobs and the address charged.
struct BackgroundOwner {
  std::uint64_t owner = 0;
  std::string payer;
};

// Runs `draw` on the renderer's thread as a background job, again after each interruption, until
// its result is not `cancelled` or the job is cancelled. Copies `draw`, which may outlive the call
// briefly. Errors: those of `draw`; cancelled.
Result<void> in_background(Backend& backend, const BackgroundOwner& owner,
                           const CancelToken& unwanted,
                           const std::function<Result<void>(const CancelToken& stop)>& draw);

}  // namespace windsplat::tasks
