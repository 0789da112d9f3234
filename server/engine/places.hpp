// The kernel positions of a brick of a curved lattice.
#pragma once

#include <cstdint>

#include "server/engine/kernels/frame_data.hpp"

namespace windsplat::engine {

// Calls visit(position), 3 world coordinates, for each until it returns false. Returns whether all
// returned true.
template <class Visit>
bool all_places(const kernels::Pass& pass, const kernels::Brick& brick, const Visit& visit) {
  const auto offset = [&](int a, int visited) {
    return pass.step[a] * pass.axis[a].sample[pass.axis[a].visit[visited]];
  };
  for (int v = 0; v < brick.v_count; ++v) {
    for (int u = 0; u < brick.u_count; ++u) {
      const std::int64_t sample = offset(pass.major, brick.sheet) +
                                  offset(pass.v, brick.v_first + v) +
                                  offset(pass.u, brick.u_first + u);
      if (!visit(pass.places + 3 * sample)) return false;
    }
  }
  return true;
}

}  // namespace windsplat::engine
