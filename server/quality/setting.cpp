// Sizes and admissibility of settings.
#include "server/quality/setting.hpp"

#include <algorithm>
#include <cmath>

#include "protocol/limits.hpp"

namespace windsplat::quality {
namespace {

constexpr int edge_min = 64;
constexpr std::size_t first_slab = 18;
static_assert(settings[first_slab] == Setting{protocol::MethodName::slab, 0, 0});

}  // namespace

int edge_at(int edge, int half_level) {
  const int whole = edge >> (half_level / 2);
  const int out = half_level % 2 == 0 ? whole : static_cast<int>(whole * std::sqrt(0.5));
  return std::max(1, out);
}

protocol::View at_setting(protocol::View view, const Setting& setting) {
  if (view.method.name == protocol::MethodName::reference) return view;
  view.method.name = setting.method;
  view.method.slab_thickness /= setting.thinner;
  return view;
}

std::size_t own_setting(const protocol::View& view) {
  return view.method.name == protocol::MethodName::slab ? first_slab : 0;
}

std::optional<std::size_t> index_of(const Setting& setting) {
  const auto at = std::find(settings.begin(), settings.end(), setting);
  if (at == settings.end()) return std::nullopt;
  return static_cast<std::size_t>(at - settings.begin());
}

bool is_allowed(const Setting& setting, const protocol::View& view) {
  if (view.method.name == protocol::MethodName::reference) return false;
  if (setting.method == protocol::MethodName::slab) {
    const bool asked =
        view.method.name == protocol::MethodName::slab || view.quality.max_error.has_value();
    const double thickness = view.method.slab_thickness / setting.thinner;
    if (!asked || thickness < protocol::limits::slab_thickness_min) return false;
  }
  if (setting.coarser > 0 && view.method.detail == protocol::Detail::full) return false;
  const int shorter = std::min(view.image.width, view.image.height);
  return setting.half_level == 0 || edge_at(shorter, setting.half_level) >= edge_min;
}

bool is_finer(const Setting& setting, const protocol::View& view) {
  const bool slab = setting.method == protocol::MethodName::slab;
  return setting.thinner > 1 || (slab && view.method.name == protocol::MethodName::kernel);
}

}  // namespace windsplat::quality
