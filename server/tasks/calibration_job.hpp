// Measures time and error of each setting for a view at rest and stores them in the tables.
#pragma once

#include <cstdint>
#include <memory>

#include "protocol/view.hpp"
#include "server/base/cancel.hpp"
#include "server/tasks/backend.hpp"
#include "server/tasks/view_completion.hpp"

namespace windsplat::tasks {

// Prepares the levels of coarser settings on a thread that may block, then draws every
// setting while the renderer is idle. Does nothing if the tables cover the scene near this
// viewpoint, the picture is small, or `unwanted` is raised. Never evicts data of prefetch requests.
void submit_calibration(Backend& backend, std::uint64_t owner, const protocol::View& view,
                        const std::shared_ptr<ViewCompletion>& completion,
                        const CancelToken& unwanted);

}  // namespace windsplat::tasks
