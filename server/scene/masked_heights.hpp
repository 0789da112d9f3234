// Heights of a layer with masked columns -> a height for every column.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace windsplat::scene {

// Replaces masked values (NaN) of a layer `width` samples wide: those beside others by the mean of
// these, then those beside the replaced ones, and so on. Cells at the edge of a mask thus keep
// their slope along the mask, and are level towards it. period: columns after which those of a row
// repeat around a globe, at most `width`; 0: they do not.
inline void extend_over_mask(std::vector<double>& layer, std::size_t width,
                             std::size_t period = 0) {
  const auto around = [&](std::size_t n, const auto& visit) {
    const std::size_t row = n - n % width;
    if (n > row) {
      visit(n - 1);
    } else if (period > 1) {
      visit(row + period - 1);
    }
    if (n + 1 < row + width) {
      visit(n + 1);
    } else if (period > 1) {
      visit(row + width - period);
    }
    if (n >= width) visit(n - width);
    if (n + width < layer.size()) visit(n + width);
  };
  const auto is_known = [&layer](std::size_t n) { return std::isfinite(layer[n]); };
  const auto is_next = [&](std::size_t n) {
    bool next = false;
    if (!is_known(n)) around(n, [&](std::size_t m) { next = next || is_known(m); });
    return next;
  };
  std::vector<std::size_t> wave;
  for (std::size_t n = 0; n < layer.size(); ++n) {
    if (is_next(n)) wave.push_back(n);
  }
  while (!wave.empty()) {
    std::vector<double> means;
    means.reserve(wave.size());
    for (const std::size_t n : wave) {
      double sum = 0;
      int count = 0;
      around(n, [&](std::size_t m) {
        if (!is_known(m)) return;
        sum += layer[m];
        ++count;
      });
      means.push_back(sum / count);
    }
    for (std::size_t i = 0; i < wave.size(); ++i) layer[wave[i]] = means[i];
    std::vector<std::size_t> beyond;
    for (const std::size_t n : wave) {
      around(n, [&](std::size_t m) {
        if (!is_known(m)) beyond.push_back(m);
      });
    }
    std::sort(beyond.begin(), beyond.end());
    beyond.erase(std::unique(beyond.begin(), beyond.end()), beyond.end());
    wave = std::move(beyond);
  }
}

}  // namespace windsplat::scene
