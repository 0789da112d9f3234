// A view -> its truth among those that are kept: loaded and listed by the job's thread, drawn by
// the renderer's in strips between other work.
#pragma once

#include <memory>
#include <string>

#include "protocol/view.hpp"
#include "server/net/jobs.hpp"
#include "server/net/router.hpp"

namespace windsplat::net {

// Unless it is kept already. Takes as long as it takes; cancelled within about a tenth of a second,
// but while it loads; drawing is charged to the address `payer`. Errors: cancelled; those of
// frame::ReferenceDrawing.
Result<protocol::JobResult> draw_reference(Services& services, const protocol::View& view,
                                           data::Dataset& dataset, const Jobs::Handle& handle,
                                           const std::string& payer);

}  // namespace windsplat::net
