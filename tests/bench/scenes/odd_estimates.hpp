// Estimated against measured errors of unusual views: odd sizes of pictures, the eye within the
// outermost cells of the data, data of one sample along an axis.
#pragma once

namespace windsplat::bench {

// Prints a line for each setting of each view, then a table of each kind of view. Of data that no
// coefficient was fitted to; errors are those of calibration
// runs. `scenes`: of each kind of data, a multiple of 3.
void list_odd(int scenes);

}  // namespace windsplat::bench
