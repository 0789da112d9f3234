// Work of client jobs on the renderer's thread while that is otherwise idle, or, where it was
// interrupted often, in its turn.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/tasks/render_service.hpp"

namespace windsplat::tasks {

// After so many interruptions, or if it has waited for so long, a piece of work is drawn as a
// request, which nothing interrupts.
inline constexpr int interruptions_max = 3;
inline constexpr std::chrono::milliseconds wait_max{500};
// Work drawn so takes at most one part in so many of the time.
inline constexpr int insisting_parts = 4;

// The work of one job: whom it is charged to, and when it has to end.
struct BackgroundOwner {
  using Clock = std::chrono::steady_clock;
  std::uint64_t owner = 0;  // of the render jobs
  std::string payer;        // address charged
  double cost_ms = 0;       // estimate of a piece; 0: unknown
  std::optional<Clock::time_point> until = {};
  Clock::time_point insists_from = {};  // before it the next piece is only drawn in the background
  int interruptions = 0;                // since a piece was last drawn in the background
};

// Runs `draw` on the renderer's thread as a background job, again after each interruption, until
// its result is not `cancelled` or the job is cancelled; after `interruptions_max` of them or
// `wait_max` without a beginning as a request of the payer. Copies `draw`, which may outlive the
// call briefly. Errors: those of `draw`; cancelled; busy after `until`.
Result<void> in_background(RenderService& renderer, BackgroundOwner& owner,
                           const CancelToken& unwanted,
                           const std::function<Result<void>(const CancelToken& stop)>& draw);

}  // namespace windsplat::tasks
