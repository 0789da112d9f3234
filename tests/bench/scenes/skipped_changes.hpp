// What the tolerances of default views leave out of generated fields: reported bound and change
// against the difference of two pictures (bench_left_out --trials).
#pragma once

#include <string>
#include <vector>

#include "tests/bench/text_table.hpp"

namespace windsplat::bench {

// A row for each trial field and reduction, by which the numbers of samples along each axis are
// divided: ranges over two azimuths, with and without a cloud, and both methods. `height`: of the
// pictures, pixels. `only`: the name of one field; empty: all.
Table skipped_changes(int height, const std::string& only, const std::vector<int>& reductions);

}  // namespace windsplat::bench
