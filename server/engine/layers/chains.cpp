#include "server/engine/layers/chains.hpp"

#include <algorithm>

namespace windsplat::engine {

void clear(AxisArrays& axis) {
  axis.position.clear();
  axis.camera.clear();
  axis.from_eye.clear();
  axis.world.clear();
  axis.cell.clear();
  axis.inverse_cell.clear();
  axis.sample.clear();
  axis.field_index.clear();
  axis.group.clear();
  axis.visit.clear();
  axis.bricks.clear();
}

void chain_lines(const trace::Segments& from, kernels::LineStyle& to) {
  to.chains = {from.q.data(),
               from.magnitudes.data(),
               {from.tangents[0].data(), from.tangents[1].data(), from.tangents[2].data()},
               from.phases.data(),
               from.turns.empty() ? nullptr : from.turns.data(),
               from.colors.data(),
               from.samples.data()};
  // No vertex of a segment is farther from the other than half of this.
  to.length = static_cast<float>(2 * std::max(from.longest, static_cast<double>(to.length)));
  to.half_span = 1e9F;
  std::fill(std::begin(to.half_box), std::end(to.half_box), to.half_span);
  for (const float*& component : to.velocity) component = nullptr;
  to.rate_x = to.rate_z = nullptr;
  to.merged = 0;
  for (float& shift : to.shift) shift = 0;
}

void place_chains(const trace::Segments& segments, PassPlan& pass) {
  kernels::Pass& to = pass.kernel;
  to.major = 2;
  to.u = 0;
  to.v = 1;
  for (int a = 0; a < 3; ++a) {
    AxisArrays& axis = pass.axis[a];
    clear(axis);
    for (int i = 0; i < segments.dims[a]; ++i) {
      axis.position.push_back(0);
      axis.camera.insert(axis.camera.end(), {0, 0, 0});
      axis.from_eye.push_back(0);
      axis.world.push_back(0);
      axis.cell.push_back(1);
      axis.inverse_cell.push_back(1);
      axis.sample.push_back(i);
      axis.group.push_back(1);
      axis.visit.push_back(i);
    }
    for (int first = 0; first < segments.dims[a]; first += kernels::brick_side) {
      axis.bricks.push_back({first, std::min(kernels::brick_side, segments.dims[a] - first)});
    }
    to.cell_max[a] = 1;
    pass.edge_max[a] = 0;
  }
  to.places = segments.places.front().data();
}

}  // namespace windsplat::engine
