// Sizes and admissibility of settings.
#include "server/quality/setting.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "protocol/limits.hpp"
#include "protocol/view/shown.hpp"

namespace windsplat::quality {
namespace {

constexpr int edge_min = 64;
constexpr std::size_t first_slab = 18;
static_assert(settings[first_slab] == Setting{protocol::MethodName::slab, 0, 0});

}  // namespace

PictureSize size_at(const PictureSize& view, const Setting& setting) {
  const int smaller = sixteenths_per_half_level * setting.half_level + setting.sixteenths;
  if (smaller == 0) return view;
  constexpr int rows_aside = 8;
  constexpr double most_aside = 0.015;  // of the height
  constexpr double weight = 20;         // of a difference in proportions against one in size
  const double proportions = static_cast<double>(view.width) / view.height;
  const double rows = std::max(1.0, view.height * std::exp2(-smaller / 16.0));
  const double aside =
      rows < rows_aside ? 0 : std::clamp(most_aside * rows, 1.0, static_cast<double>(rows_aside));
  const int last = std::min(view.height, static_cast<int>(std::ceil(rows + aside)));
  PictureSize best;
  double least = std::numeric_limits<double>::infinity();
  for (int height = std::max(1, static_cast<int>(rows - aside)); height <= last; ++height) {
    const int width = std::max(1, static_cast<int>(std::lround(height * proportions)));
    const double moved = std::abs(width / (height * proportions) - 1);
    const double fault = weight * moved + std::abs(height / rows - 1);
    if (fault >= least) continue;
    least = fault;
    best = {std::min(width, view.width), height};
  }
  return best;
}

PictureSize size_at(const protocol::View& view, const Setting& setting) {
  return size_at(PictureSize{view.image.width, view.image.height}, setting);
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
  return is_allowed(setting, view, size_at(view, setting));
}

bool is_allowed(const Setting& setting, const protocol::View& view, const PictureSize& size) {
  if (view.method.name == protocol::MethodName::reference) return false;
  if (setting.method == protocol::MethodName::slab) {
    const bool asked =
        view.method.name == protocol::MethodName::slab || view.quality.max_error.has_value();
    const double thickness = view.method.slab_thickness / setting.thinner;
    if (!asked || thickness < protocol::limits::slab_thickness_min) return false;
  }
  if (setting.coarser > 0 && protocol::is_drawn_in_full(view)) return false;
  if (setting.half_level == 0 && setting.sixteenths == 0) return true;
  return std::min(size.width, size.height) >= edge_min;
}

bool is_finer(const Setting& setting, const protocol::View& view) {
  const bool slab = setting.method == protocol::MethodName::slab;
  return setting.thinner > 1 || (slab && view.method.name == protocol::MethodName::kernel);
}

}  // namespace windsplat::quality
