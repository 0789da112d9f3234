// A source -> a CF netCDF-4 file that open_file() reads back.
#pragma once

#include <string>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/data/model/source.hpp"

namespace windsplat::data {

// Writes every field and step of a source as CF netCDF-4 that open_file reads back. Nothing is left
// behind where it fails or is cancelled. Errors: cancelled; those of reading and writing.
// Until it is whole the file has the name netcdf_part(path).
std::string netcdf_part(const std::string& path);
Result<void> write_netcdf(Source& source, const std::string& path, const CancelToken& cancel = {});

}  // namespace windsplat::data
