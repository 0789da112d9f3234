// Interpolation between neighbours in size.
#include "server/quality/sizes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "server/base/check.hpp"

namespace windsplat::quality {
namespace {

int size_of(const Setting& setting) {
  return sixteenths_per_half_level * setting.half_level + setting.sixteenths;
}

bool is_same_kind(const Setting& a, const Setting& b) {
  return a.method == b.method && a.coarser == b.coarser && a.thinner == b.thinner;
}

// The setting of the list that is the next smaller one of the same kind.
std::optional<std::size_t> next_smaller_of(const Setting& setting) {
  std::optional<std::size_t> next;
  for (std::size_t i = 0; i < settings_count; ++i) {
    if (!is_same_kind(settings[i], setting) || size_of(settings[i]) <= size_of(setting)) continue;
    if (!next || size_of(settings[i]) < size_of(settings[*next])) next = i;
  }
  return next;
}

std::optional<std::size_t> next_smaller(std::size_t setting) {
  static const auto next = [] {
    std::array<std::optional<std::size_t>, settings_count> out;
    for (std::size_t i = 0; i < settings_count; ++i) out[i] = next_smaller_of(settings[i]);
    return out;
  }();
  return next[setting];
}

// The setting itself or the next larger one of the same kind.
std::optional<std::size_t> least_larger(const Setting& setting) {
  std::optional<std::size_t> next;
  for (std::size_t i = 0; i < settings_count; ++i) {
    if (!is_same_kind(settings[i], setting) || size_of(settings[i]) > size_of(setting)) continue;
    if (!next || size_of(settings[i]) > size_of(settings[*next])) next = i;
  }
  return next;
}

double mixed(double a, double b, double share_of_b) {
  return std::exp((1 - share_of_b) * std::log(a) + share_of_b * std::log(b));
}

}  // namespace

int sizes_apart(const Setting& a, const Setting& b) { return std::abs(size_of(a) - size_of(b)); }

std::optional<std::array<std::size_t, 2>> neighbours_of(const Setting& setting) {
  const auto larger = least_larger(setting);
  if (!larger) return std::nullopt;
  if (settings[*larger] == setting) return std::array{*larger, *larger};
  const auto smaller = next_smaller(*larger);
  if (!smaller) return std::nullopt;
  return std::array{*larger, *smaller};
}

namespace {

// What the forecasts between two neighbours follow from.
class Interpolation {
 public:
  template <class At>
  Interpolation(std::size_t larger, std::size_t smaller, const At& at)
      : larger_(larger), smaller_(smaller), whole_(at(larger)), few_(at(smaller)) {
    if (size_of(settings[larger]) > 0) return;
    if (const auto fewer = next_smaller(smaller)) {
      const int apart = sizes_apart(settings[*fewer], settings[smaller]);
      growth_ = std::max(0.0, std::log(at(*fewer).error / few_.error)) / apart;
    }
  }

  [[nodiscard]] Forecast at(const Setting& setting) const {
    const int from = sizes_apart(setting, settings[larger_]);
    const int to = sizes_apart(setting, settings[smaller_]);
    const double share = static_cast<double>(from) / (from + to);
    Forecast out;
    out.ms = mixed(whole_.ms, few_.ms, share);
    out.error = mixed(whole_.error, few_.error, share);
    if (growth_) out.error = std::max(out.error, few_.error * std::exp(-*growth_ * to));
    out.spread = std::max(whole_.spread, few_.spread);
    out.timed = whole_.timed && few_.timed;
    return out;
  }

 private:
  std::size_t larger_, smaller_;
  Forecast whole_, few_;
  std::optional<double>
      growth_;  // of the logarithm of the error in a sixteenth, beyond the full size
};

template <class At>
Forecast between(const Setting& setting, const At& at) {
  const auto neighbours = neighbours_of(setting);
  WINDSPLAT_CHECK(neighbours.has_value());
  const auto& [larger, smaller] = *neighbours;
  return larger == smaller ? at(larger) : Interpolation(larger, smaller, at).at(setting);
}

}  // namespace

Forecast forecast_between(const Setting& setting,
                          const std::function<Forecast(std::size_t setting)>& at) {
  return between(setting, at);
}

Forecast forecast_between(const Setting& setting, const Forecasts& forecasts) {
  return between(setting, [&](std::size_t i) { return forecasts[i]; });
}

PictureSize Sizes::at(const PictureSize& view, const Setting& setting) {
  if (view != view_) sizes_ = {};
  view_ = view;
  const auto index = static_cast<std::size_t>(size_of(setting));
  if (index >= sizes_.size()) return size_at(view, setting);
  std::optional<PictureSize>& known = sizes_[index];
  if (!known) known = size_at(view, setting);
  return *known;
}

std::vector<Option> options_of(const protocol::View& view, const Forecasts& forecasts,
                               const std::optional<Halvings>& halvings, Sizes& sizes,
                               const std::optional<Setting>& always) {
  std::vector<Option> out;
  out.reserve(halvings ? 8 * settings_count : settings_count);
  const PictureSize full{view.image.width, view.image.height};
  const auto add = [&](const Setting& setting, const Forecast& forecast) {
    const PictureSize size = sizes.at(full, setting);
    if (is_allowed(setting, view, size)) out.push_back({setting, forecast, size});
  };
  for (std::size_t i = 0; i < settings_count; ++i) add(settings[i], forecasts[i]);
  for (std::size_t i = 0; halvings && i < settings_count; ++i) {
    const auto smaller = next_smaller(i);
    if (!smaller || !forecasts[i].timed || !forecasts[*smaller].timed) continue;
    const auto level = [&](std::size_t s) {
      return (*halvings)[static_cast<std::size_t>(settings[s].half_level)];
    };
    if (level(i) != level(*smaller)) continue;
    const Interpolation forecast(i, *smaller, [&](std::size_t s) { return forecasts[s]; });
    for (int size = size_of(settings[i]) + 1; size < size_of(settings[*smaller]); ++size) {
      Setting between = settings[i];
      between.half_level = size / sixteenths_per_half_level;
      between.sixteenths = size % sixteenths_per_half_level;
      add(between, forecast.at(between));
    }
  }
  const auto is_that = [&](const Option& option) { return option.setting == *always; };
  if (always && std::none_of(out.begin(), out.end(), is_that)) {
    add(*always, forecast_between(*always, forecasts));
  }
  return out;
}

}  // namespace windsplat::quality
