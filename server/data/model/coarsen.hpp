// Reduces a volume, or a box of one, to a coarser level: two values or means of scalars, drawn
// samples or mean magnitudes of vectors.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "server/data/model/volume.hpp"

namespace windsplat::data {

// What represents a group of samples. two_values: the means of the samples below the mean of the
// group and of the others, each with its share of the group; a function of the value that is linear
// over each half keeps its mean. drawn: one of the samples, each with the same probability, which
// keeps magnitudes and directions, and in expectation any sum over the samples (stochastic
// simplification: Cook, Halstead, Planck, Ryu, SIGGRAPH 2007). The draw is among the places of a
// whole group, also where the last group of an axis has fewer samples: a sample has the same
// probability in every group. With a stride, the draw is among the samples of strided kernels. mean
// and mean_magnitude: of the samples that are not masked, for programs that know no other levels.
enum class Reduction { two_values, drawn, mean, mean_magnitude };

// The sample of the n-th strided kernel along an axis: the middle one (the lower of two) of
// `stride` samples, at the end of the axis of the remaining ones. n stride < samples.
inline int strided_sample(int n, int stride, int samples) {
  const int first = n * stride;
  const int last = (first + stride < samples ? first + stride : samples) - 1;
  return first + (last - first) / 2;
}

// The number of places among which one is drawn along an axis: a group of 2^halvings samples has at
// most as many strided kernels that are whole.
inline int drawn_places(int halvings, int stride) {
  return ((1 << halvings) + stride - 1) / stride;
}

// halvings[a] = h: 2^h samples along axis a become one; the last group may be smaller.
// widths[a]: cell widths along an axis of the data, in any unit, since only ratios matter; only two
// values and means of an axis that is halved need them.
// first, data_dims: of a volume that is a box of the data: the index of its first sample, a
// multiple of 2^halvings, and the dimensions of the data. The box ends at such a multiple or with
// the data, and is reduced to the bits of the same box of the whole. data_dims 0: the whole.
struct Coarsening {
  std::array<int, 3> halvings{0, 0, 0};
  std::array<std::vector<double>, 3> widths;
  Reduction reduction = Reduction::two_values;
  int stride = 1;  // of kernels, in samples; drawn only. 2^halvings: the middle of each kernel
  std::array<int, 3> first{0, 0, 0};
  std::array<int, 3> data_dims{0, 0, 0};
};

// Number of samples along an axis after `halvings` halvings.
int halved(int samples, int halvings);

// two_values: of a scalar; the samples are weighted by the volumes of their cells, so that
// integrals over space are preserved. O(samples), two passes over the source. The range is that of
// the source.
//
// mean: of a scalar, weighted likewise; mean_magnitude: of a vector, a scalar. Masked where all
// samples of the group are. O(samples), one pass.
//
// drawn: a sample of each group with all its components, masked if that sample is, if the place
// drawn lies beyond the last sample, or if the group has no sample of a strided kernel there. The
// draw depends on the position of the group alone, so that all fields of a level draw the same
// samples.
Volume coarsen(const Volume& fine, const Coarsening& how);

// What coarsen() draws of data of those dimensions, or of a box of them that begins at a multiple
// of the stride of `how`, from the samples of the strided kernels in it alone (strided_sample()).
Volume draw(const Volume& strided, const Coarsening& how, const std::array<int, 3>& data_dims);

// Components of the reduction of a field with `components`.
int reduced_components(int components, Reduction reduction);

// Cache key of a coarser volume: equal keys have equal reductions and weights. Contains the
// normalised weights, rounded as in coarsen(), so it does not depend on the unit of the widths. Of
// the whole: without the box.
std::string key_of(const Coarsening& how);

}  // namespace windsplat::data
