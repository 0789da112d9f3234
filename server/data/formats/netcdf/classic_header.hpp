// The size that a classic netCDF file must have according to its header. The library reads zeros
// beyond the end of a truncated file, so the reader checks the size first.
#pragma once

#include <cstdint>
#include <functional>

#include "server/base/error.hpp"

namespace windsplat::data::netcdf {

// Copies `count` bytes at `offset` into `out`; false if the file does not hold them all.
using ReadBytes = std::function<bool(std::uint64_t offset, std::size_t count, unsigned char* out)>;

// Parses the header of a file of `file_bytes` bytes (CDF-1, CDF-2 and CDF-5, "NetCDF Classic Format
// Specification"; big-endian) and returns the end of its last value, without padding. Errors:
// bad_data if the header is malformed or exceeds the file.
Result<std::uint64_t> classic_bytes_expected(const ReadBytes& read, std::uint64_t file_bytes);

}  // namespace windsplat::data::netcdf
