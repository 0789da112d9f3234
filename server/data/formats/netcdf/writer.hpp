// A source -> a CF netCDF-4 file that open_file() reads back.
#pragma once

#include <functional>
#include <string>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/data/model/source.hpp"

namespace windsplat::data {

// Writes every field and step of a source as CF netCDF-4. The file is named netcdf_part(path) until
// it is complete, and removed on failure or cancellation. Calls progress(part that is written, 0 to
// 1) before each field. Errors: cancelled; those of reading and
// writing.
std::string netcdf_part(const std::string& path);
Result<void> write_netcdf(Source& source, const std::string& path, const CancelToken& cancel = {},
                          const std::function<void(double)>& progress = {});

}  // namespace windsplat::data
