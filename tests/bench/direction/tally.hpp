// Right answers by field, and how far their mean and its difference from another may be off.
#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

namespace windsplat::bench {

// What is asked about a picture.
enum class Question { direction, direction_alone, order, contrast };

struct Share {
  double sum = 0;  // of right answers, or of contrasts
  double count = 0;
  void add(double value) {
    sum += value;
    count += 1;
  }
};

// Shares of one mark in one group of pictures, by field.
using Shares = std::map<std::string, Share>;

// A mean over fields, each of equal weight, with the 2.5 and 97.5 % quantiles of the same mean over
// fields drawn at random with repetition. NaN without answers.
struct Estimate {
  double mean = 0, low = 0, high = 0;
};

Estimate mean_of(const Shares& shares);

// mean(one) - mean(other), of the same fields.
Estimate difference_of(const Shares& one, const Shares& other);

}  // namespace windsplat::bench
