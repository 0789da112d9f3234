// Limits on decoding, for all formats. A file of a few kB can declare terabytes; what is decoded
// without a request is limited in proportion to the size of the file.
#pragma once

#include <cstddef>
#include <cstdint>

namespace windsplat::data {

// Limit on the size of a decoded chunk of a chunked format (HDF5, Zarr).
constexpr std::size_t chunk_bytes_max = std::size_t{1} << 30;

// Compressors enlarge an incompressible chunk by less than this.
constexpr std::uint64_t stored_chunk_bytes_max(std::uint64_t decoded_bytes) {
  return decoded_bytes + decoded_bytes / 8 + 65536;
}

// Least cost of finding a chunk, as the number of bytes decoded in the same time: 5 us for HDF5, 50
// us for Zarr, whose chunks are files.
constexpr std::size_t hdf5_chunk_cost_bytes = 1024;
constexpr std::size_t zarr_chunk_cost_bytes = 4096;

// Decoded bytes that opening a dataset (its coordinates) may take. Longitudes and latitudes of a
// regular grid, stored as two 2-D arrays, have compression ratios of hundreds: those of 2000 x 2000
// samples take 61 MiB.
constexpr std::uint64_t voluntary_bytes_max(std::uint64_t stored_bytes) {
  return (std::uint64_t{64} << 20) + 16 * stored_bytes;
}

// Private memory of an idle loader.
inline constexpr std::uint64_t loader_bytes_min = std::uint64_t{8} << 20;

// Decoded bytes that `inspect` may spend on value ranges without a request. Enough for all of a
// step with a compression ratio of 64, or for 178 MiB with a ratio of 100.
constexpr std::uint64_t range_bytes_max(std::uint64_t stored_bytes) {
  return (std::uint64_t{64} << 20) + 64 * stored_bytes;
}

// Memory for a volume and its chunks while its range is computed.
constexpr std::uint64_t range_memory_max(std::uint64_t stored_bytes) {
  return (std::uint64_t{128} << 20) + 32 * stored_bytes;
}

// Private memory of a loader that has files of `stored_bytes` bytes open.
constexpr std::uint64_t opening_memory_bytes(std::uint64_t stored_bytes) {
  return (std::uint64_t{144} << 20) + 32 * stored_bytes;
}

// Coordinates of an axis, and time steps: each takes memory even if no data were stored. Files
// opened to find the axes of a store count as stored bytes: a century of hourly steps, 876,600, may
// compress to a few kB.
constexpr std::uint64_t entries_max(std::uint64_t stored_bytes) {
  return (std::uint64_t{1} << 20) + stored_bytes / 4;
}

}  // namespace windsplat::data
