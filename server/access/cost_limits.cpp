// Compares the cost with the limits; the error names the dominant setting.
#include "server/access/cost_limits.hpp"

#include <array>
#include <cstdio>
#include <string>

namespace windsplat::access {
namespace {

std::string in_short(double number) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3g", number);
  return text.data();
}

}  // namespace

Result<void> check_cost(const frame::Cost& cost, const Limits& limits) {
  if (limits.pixels > 0 && cost.pixels > limits.pixels) {
    return make_error_at(ErrorKind::too_large, "/image",
                         "has " + std::to_string(cost.pixels) + " pixels; the limit is " +
                             std::to_string(limits.pixels) + " (--max-pixels)");
  }
  if (limits.kernels > 0 && !(cost.kernels <= limits.kernels)) {
    return make_error_at(ErrorKind::invalid, cost.dominant,
                         "dominates the cost of a picture with up to " + in_short(cost.kernels) +
                             " kernels; the limit is " + in_short(limits.kernels) +
                             " (--max-kernels)");
  }
  return {};
}

}  // namespace windsplat::access
