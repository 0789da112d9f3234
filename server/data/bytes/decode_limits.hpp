// Limits on what stored bytes may make a reader decode, for all formats. A file of a few kB can
// declare terabytes; whatever is done without being asked for is bounded by what the file has.
#pragma once

#include <cstddef>
#include <cstdint>

namespace windsplat::data {

// One decoded chunk of a chunked format (HDF5, Zarr).
constexpr std::size_t chunk_bytes_max = std::size_t{1} << 30;

// A chunk that does not compress grows, by less than this with every compressor.
constexpr std::uint64_t stored_chunk_bytes_max(std::uint64_t decoded_bytes) {
  return decoded_bytes + decoded_bytes / 8 + 65536;
}

// What finding one chunk costs at least, in bytes that are decoded in the time: of HDF5 5 us, of
// Zarr, whose chunks are files, 50 us.
constexpr std::size_t hdf5_chunk_cost_bytes = 1024;
constexpr std::size_t zarr_chunk_cost_bytes = 4096;

// Decoded bytes that opening a dataset (its coordinates) may take. Longitudes and latitudes of a
// regular grid, stored as two 2-D arrays, compress hundreds of times: those of 2000 x 2000 samples
// take 61 MiB.
constexpr std::uint64_t voluntary_bytes_max(std::uint64_t stored_bytes) {
  return (std::uint64_t{64} << 20) + 16 * stored_bytes;
}

// Private memory of an idle loader.
inline constexpr std::uint64_t loader_bytes_min = std::uint64_t{8} << 20;

// Decoded bytes that `inspect` may spend on ranges without being asked: a step of a few fields that
// compress 64 times is read whole, and one of 178 MiB that compresses a hundred times.
constexpr std::uint64_t range_bytes_max(std::uint64_t stored_bytes) {
  return (std::uint64_t{64} << 20) + 64 * stored_bytes;
}

// Memory for a volume and the chunks that it is made of, while its range is found.
constexpr std::uint64_t range_memory_max(std::uint64_t stored_bytes) {
  return (std::uint64_t{128} << 20) + 32 * stored_bytes;
}

// Private memory of a loader while it opens files of so many bytes.
constexpr std::uint64_t opening_memory_bytes(std::uint64_t stored_bytes) {
  return (std::uint64_t{144} << 20) + 32 * stored_bytes;
}

// Coordinates of an axis, and time steps: each takes memory even where no data were stored. Of a
// store of many files those count that were opened to find the axes: a century of hourly steps,
// 876,600, may compress to a few kB.
constexpr std::uint64_t entries_max(std::uint64_t stored_bytes) {
  return (std::uint64_t{1} << 20) + stored_bytes / 4;
}

}  // namespace windsplat::data
