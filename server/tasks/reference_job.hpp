// Draws the reference of a view: loaded by the job's thread, drawn by the renderer in strips
// between other work, then cached.
#pragma once

#include <memory>
#include <string>

#include "protocol/view.hpp"
#include "server/tasks/backend.hpp"
#include "server/tasks/jobs.hpp"

namespace windsplat::tasks {

// Returns at once if the reference is cached, otherwise blocks until it is drawn. Cancellation
// takes effect within about a tenth of a second, except while loading. Drawing is charged to the
// address `payer`. Errors: cancelled; those of frame::ReferenceDrawing.
Result<protocol::JobResult> draw_reference(Backend& backend, const protocol::View& view,
                                           data::Dataset& dataset, const Jobs::Handle& handle,
                                           const std::string& payer, const std::string& base_path);

}  // namespace windsplat::tasks
