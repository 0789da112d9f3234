// Runs work in a separate process: for libraries that are known to crash on corrupt files, which
// the program therefore reads in a confined process.
#pragma once

#include <functional>

namespace fuzz {

// Runs `work` in a child, whose coverage counts in this process. A crash in project code ends this
// process; a crash whose innermost frames are in a library is only counted and reported at the end,
// as is a child that exceeds the time limit.
void apart(const std::function<void()>& work, unsigned seconds = 5);

}  // namespace fuzz
