// A view -> its truth among those that are kept: loaded and listed by the job's thread, drawn by
// the renderer's in strips between other work.
#pragma once

#include <memory>
#include <string>

#include "protocol/view.hpp"
#include "server/work/backend.hpp"
#include "server/work/jobs.hpp"

namespace windsplat::net {

// Unless it is kept already. Takes as long as it takes; cancelled within about a tenth of a second,
// but while it loads; drawing is charged to the address `payer`. Errors: cancelled; those of
// frame::ReferenceDrawing.
Result<protocol::JobResult> draw_reference(Backend& backend, const protocol::View& view,
                                           data::Dataset& dataset, const Jobs::Handle& handle,
                                           const std::string& payer, const std::string& base_path);

}  // namespace windsplat::net
