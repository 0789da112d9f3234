// A view that rests -> what each setting costs and errs for it, in the tables.
#pragma once

#include <cstdint>

#include "protocol/view.hpp"
#include "server/base/cancel.hpp"
#include "server/work/backend.hpp"

namespace windsplat::net {

// First the averages of its data that coarser settings show, from a thread that may wait for them;
// then every setting is drawn, while the renderer has nothing else to do. Nothing happens where the
// tables know the view's style from about there, the picture is small, or `unwanted` is raised.
// What others wish for is not evicted for it.
void submit_calibration(Backend& backend, std::uint64_t owner, const protocol::View& view,
                        const CancelToken& unwanted);

}  // namespace windsplat::net
