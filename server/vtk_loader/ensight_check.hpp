// What VTK does not check in files of EnSight: at the end of a text file it repeats the last line,
// and it takes no notice of undefined values.
#pragma once

#include <cstdint>

#include "server/base/error.hpp"
#include "server/data/files/input_file.hpp"

namespace windsplat::vtk_loader {

// Scans a geometry or variable file. numbers_min: how many lines of a text file must begin with a
// number; 0 for a binary file. Errors: bad_data, if there are fewer, or if values are marked
// "undef" or "partial".
Result<void> check_ensight(const data::InputFile& file, std::uint64_t numbers_min);

}  // namespace windsplat::vtk_loader
