// The error of a picture that is drawn from a coarser level of the data than would suffice, from
// the pictures of the next two coarser levels (docs/design/quality-control.md, Detail that is not
// drawn).
#pragma once

#include <array>

namespace windsplat::quality {

// Of pictures of a level and the next two coarser ones, n, n + 1, n + 2: means over all values of
// linear premultiplied RGBA.
struct LevelDifferences {
  double near = 0;     // of the squares of picture n + 1 less picture n
  double far = 0;      // of the squares of picture n + 2 less picture n + 1
  double product = 0;  // of both differences
};

struct DetailError {
  double error = 0;   // RMSE relative to a picture of full detail, linear premultiplied RGBA
  double growth = 1;  // that of the error from each level to the next coarser one
  std::array<int, 3> halvings{0, 0, 0};  // of the axes of the level
};

// finer: number of levels below n. The ratio of the two differences and their correlation, as means
// over the picture, are taken to be those of the differences of all finer levels too. This is exact
// for errors of any one order in the width of the cells, and for lines that are drawn by chance.
DetailError detail_error(const LevelDifferences& differences, int finer);

// Of a picture of the same view at another level, by halvings of the axes.
double error_at(const DetailError& known, const std::array<int, 3>& halvings);

}  // namespace windsplat::quality
