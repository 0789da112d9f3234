// Replies whose text is compressed for clients that accept it.
#pragma once

#include "server/http/exchange.hpp"
#include "server/tasks/task_executor.hpp"

namespace windsplat::transport {

// Passes answers on to `reply`, text compressed if the request accepts gzip. Large texts are
// compressed on a thread of `packing`, since answers may be made on the network thread; they are
// sent as they are while it is busy. `packing` outlives the replies.
http::Reply packed_reply(tasks::TaskExecutor& packing, const http::Request& request,
                         http::Reply reply);

}  // namespace windsplat::transport
