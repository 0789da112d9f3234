// A netCDF file as a Source. open_file's second half: file -> roles -> grid -> fields -> volumes.
#pragma once

#include <memory>
#include <string>

#include "server/base/error.hpp"
#include "server/data/dataset.hpp"

namespace windsplat::data::netcdf {

// Errors: not_found, bad_data.
Result<std::unique_ptr<Source>> open_source(const std::string& path);

}  // namespace windsplat::data::netcdf
