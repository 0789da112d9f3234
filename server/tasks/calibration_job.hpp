// Describes a view at rest, measures time and error of each setting for it, and stores both in the
// tables.
#pragma once

#include <cstdint>
#include <memory>

#include "protocol/view.hpp"
#include "server/base/cancel.hpp"
#include "server/tasks/backend.hpp"
#include "server/tasks/view_completion.hpp"

namespace windsplat::tasks {

// On a thread that may block, computes what the view shows from its resident data, and prepares the
// levels of coarser settings; then draws every setting while the renderer is idle. Nothing is drawn
// if the tables cover the scene near this viewpoint or the picture is small. Ends once `unwanted`
// is raised, even within the description. Never evicts data of prefetch requests.
void submit_calibration(Backend& backend, std::uint64_t owner, const protocol::View& view,
                        const std::shared_ptr<ViewCompletion>& completion,
                        const CancelToken& unwanted);

}  // namespace windsplat::tasks
