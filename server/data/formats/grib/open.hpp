// GRIB 1 and 2 through ecCodes, if windsplat was built with it. InputFile -> arrays.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/files/input_file.hpp"

namespace windsplat::data::grib {

// Whether a file begins with a GRIB message, optionally after a WMO heading.
bool is_grib(const InputFile& input);
// The same for the first bytes of a file.
bool is_grib(std::string_view head);

// The folders of tables that ecCodes reads at run time, separated by ':'. Empty without ecCodes.
std::string definitions_folder();

// Errors: bad_data, including a build without ecCodes.
Result<std::unique_ptr<cf::ArrayFile>> open(std::shared_ptr<const InputFile> input);

}  // namespace windsplat::data::grib
