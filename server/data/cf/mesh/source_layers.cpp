#include "server/data/cf/mesh/source_layers.hpp"

#include <algorithm>

#include "server/data/cf/packing.hpp"

namespace windsplat::data::cf {

Result<void> SourceLayers::load(const LayerPlan& plan, const std::vector<std::size_t>& start,
                                const std::vector<std::size_t>& count) {
  if (variable_ == plan.variable && start_ == start && count_ == count) return {};
  variable_ = -1;
  std::size_t values = 1;
  for (const std::size_t n : count) values *= n;
  slab_.resize(values);
  const Packing packing = packing_of(file_, plan.variable);
  const auto mask = float_mask(packing);
  if (mask && file_.contents().variables.at(at(plan.variable)).type == "float32") {
    if (auto done = file_.read(plan.variable, start, count, slab_.data()); !done) return done;
    apply(*mask, slab_.data(), values);
  } else {
    std::vector<double> stored(values);
    if (auto done = file_.read(plan.variable, start, count, stored.data()); !done) return done;
    std::transform(stored.begin(), stored.end(), slab_.begin(),
                   [&](double value) { return unpack(packing, value); });
  }
  variable_ = plan.variable;
  start_ = start;
  count_ = count;
  return {};
}

Result<const float*> SourceLayers::read(const LayerPlan& plan,
                                        const std::vector<std::size_t>& index) {
  const FileContents& contents = file_.contents();
  const std::vector<int>& dims = contents.variables.at(at(plan.variable)).dims;
  const std::size_t length = contents.dimensions.at(at(dims[plan.list])).length;
  std::vector<std::size_t> start(index);
  start.insert(start.begin() + static_cast<std::ptrdiff_t>(plan.list), 0);
  std::vector<std::size_t> count(dims.size(), 1);
  count[plan.list] = length;
  if (plan.list + 1 == dims.size()) {
    if (auto done = load(plan, start, count); !done) return done.error();
    return slab_.data();
  }
  const std::size_t layers = contents.dimensions.at(at(dims.back())).length;
  const std::size_t most = std::clamp<std::size_t>(slab_values / length, 1, layers);
  const std::size_t wanted = start.back();
  start.back() = wanted / most * most;
  count.back() = std::min(most, layers - start.back());
  if (auto done = load(plan, start, count); !done) return done.error();
  layer_.resize(length);
  const float* from = slab_.data() + (wanted - start.back());
  for (std::size_t n = 0; n < length; ++n) layer_[n] = from[n * count.back()];
  return layer_.data();
}

void SourceLayers::forget() {
  variable_ = -1;
  slab_ = {};
  layer_ = {};
}

}  // namespace windsplat::data::cf
