// Forecast against measured work of what a view adds to lines and clouds: a ground, surfaces, light
// (docs/benchmarks/features.md).
#pragma once

namespace windsplat::bench {

// Prints a line for each dataset, size and part: processor time in ms of the first picture of the
// view (its scene, of resident data, and drawing) with the part and without it, medians of three,
// the kernels that frame::cost_of() counts for both, the triangles of its surfaces, the samples of
// its fields, and the ratio of forecast over measured work that the part adds, a kernel being 6 ns.
// `judged`: datasets, values and planes to which nothing was fitted.
void list_parts(bool judged);

}  // namespace windsplat::bench
