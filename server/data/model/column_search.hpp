// The nearest columns of many places.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/data/model/dataset_info.hpp"

namespace windsplat::data {

// Finds the column nearest to a place as nearest_sample() does, in a time that grows with the
// logarithm of their number: a k-d tree (J. L. Bentley, Multidimensional Binary Search Trees Used
// for Associative Searching, 1975) of their places on the unit sphere, where the chord grows with
// the great-circle distance. 32 bytes per column. Refers to the columns.
class ColumnSearch {
 public:
  // Incomplete if cancelled.
  ColumnSearch(const Columns& columns, const std::array<int, 3>& dims,
               const CancelToken& cancel = {});

  // Degrees -> the indices along x and y. Errors: those of nearest_sample().
  [[nodiscard]] Result<std::array<int, 2>> nearest(double longitude, double latitude) const;

 private:
  struct Node {
    std::array<double, 3> place{};
    std::size_t column = 0;
  };
  struct Best {
    double square = 0;  // of the chord
    std::size_t column = 0;
  };

  static std::array<double, 3> unit_vector(double longitude, double latitude);
  void sort(std::size_t first, std::size_t last, std::size_t axis, const CancelToken& cancel);
  void seek(const std::array<double, 3>& place, std::size_t first, std::size_t last,
            std::size_t axis, Best& best) const;

  const Columns& columns_;
  std::array<int, 3> dims_;
  std::vector<Node> nodes_;  // the middle one of a range divides it
};

}  // namespace windsplat::data
