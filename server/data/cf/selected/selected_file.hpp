// One entry of each dimension besides space and time: members of an ensemble, reference times,
// spectral bands. ArrayFile -> ArrayFile.
#pragma once

#include <memory>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/files/selection.hpp"

namespace windsplat::data::cf {

// The name of the choice of a variable whose grid is shown: "?field=pr".
inline constexpr const char* field_choice = "field";

// The file itself if nothing is to be chosen. Otherwise a file with the same variables in the same
// order, without the dimensions that `selection` names and without those of
// find_extra_dimensions(), of which the first entry is taken and noted. A dimension that it does
// not have is left to check_selection(). Lead times become the time axis, with the valid times if
// the file has them or they follow from a reference time (with_valid_times()). Errors: not_found if
// a dimension has no such entry, bad_data.
Result<std::unique_ptr<ArrayFile>> selected(std::unique_ptr<ArrayFile> file,
                                            const Selection& selection);

// Errors: not_found if the contents that selected() returned, or of several files joined, had no
// dimension of a name in the selection.
Result<void> check_selection(const FileContents& contents, const Selection& selection);

// How two files that become one dataset differ if they show different entries of a dimension;
// empty if they do not. Reference times of forecasts may differ.
std::string differing_entry(const FileContents& first, const FileContents& other);

}  // namespace windsplat::data::cf
