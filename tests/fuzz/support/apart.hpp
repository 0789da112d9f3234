// A piece of work in a process of its own: for libraries that are known to crash on spoiled files,
// which the program reads in a confined process for that reason.
#pragma once

#include <functional>

namespace fuzz {

// Runs `work` in a child; what it covered counts here. A child that ends by a fault of ours ends
// this process; one whose innermost frames are a library's is counted, told at the end of the run,
// and nothing else. So is one that takes longer than the seconds.
void apart(const std::function<void()>& work, unsigned seconds = 5);

}  // namespace fuzz
