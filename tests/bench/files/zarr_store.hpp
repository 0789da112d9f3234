// Zarr stores for benchmarks: written, and read without the project's reader.
#pragma once

#include <blosc.h>
#include <fcntl.h>
#include <unistd.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "server/data/model/source.hpp"
#include "tests/bench/support.hpp"

namespace windsplat::bench {

// Stores of Zarr version 2 in chunks of at most this many samples along each dimension.
inline constexpr std::size_t zarr_chunk = 64;

struct ZarrChunks {
  std::array<std::size_t, 3> dims{};  // z, y, x
  std::array<std::size_t, 3> chunk{};
  explicit ZarrChunks(const std::array<int, 3>& grid) {
    for (std::size_t d = 0; d < 3; ++d) {
      dims.at(d) = static_cast<std::size_t>(grid.at(2 - d));
      chunk.at(d) = std::min(zarr_chunk, dims.at(d));
    }
  }
  [[nodiscard]] std::size_t items() const { return chunk[0] * chunk[1] * chunk[2]; }

  // Calls each(name of the file, first sample along each dimension) for the chunks of a step.
  template <class Each>
  void for_each(std::size_t step, const Each& each) const {
    for (std::size_t z = 0; z < dims[0]; z += chunk[0]) {
      for (std::size_t y = 0; y < dims[1]; y += chunk[1]) {
        for (std::size_t x = 0; x < dims[2]; x += chunk[2]) {
          each(std::to_string(step) + '.' + std::to_string(z / chunk[0]) + '.' +
                   std::to_string(y / chunk[1]) + '.' + std::to_string(x / chunk[2]),
               std::array{z, y, x});
        }
      }
    }
  }
  // Calls row(index in the chunk, index in the volume, count) for the rows of a chunk.
  template <class Row>
  void for_rows(const std::array<std::size_t, 3>& first, const Row& row) const {
    const std::size_t count = std::min(chunk[2], dims[2] - first[2]);
    for (std::size_t z = 0; z < chunk[0] && first[0] + z < dims[0]; ++z) {
      for (std::size_t y = 0; y < chunk[1] && first[1] + y < dims[1]; ++y) {
        row((z * chunk[1] + y) * chunk[2],
            ((first[0] + z) * dims[1] + first[1] + y) * dims[2] + first[2], count);
      }
    }
  }
};

// The variables u, v, w and cloud, compressed by blosc (lz4, level 5, shuffled) or zstd (level 1).
inline void write_zarr(const std::string& folder, data::Source& source, bool by_blosc) {
  namespace fs = std::filesystem;
  const ZarrChunks chunks(source.info().grid.dims());
  fs::remove_all(folder);
  fs::create_directories(folder);
  std::ofstream(folder + "/.zgroup") << R"({"zarr_format": 2})";
  for (const char* name : {"u", "v", "w", "cloud"}) {
    const std::string array = folder + '/' + name;
    fs::create_directories(array);
    const auto list = [](std::size_t first, const std::array<std::size_t, 3>& rest) {
      return '[' + std::to_string(first) + ", " + std::to_string(rest[0]) + ", " +
             std::to_string(rest[1]) + ", " + std::to_string(rest[2]) + ']';
    };
    std::ofstream(array + "/.zarray")
        << R"({"zarr_format": 2, "dtype": "<f4", "fill_value": null, "order": "C", )"
        << R"("filters": null, "shape": )" << list(source.info().steps.size(), chunks.dims)
        << R"(, "chunks": )" << list(1, chunks.chunk) << R"(, "compressor": )"
        << (by_blosc ? R"({"id": "blosc", "cname": "lz4", "clevel": 5, "shuffle": 1})"
                     : R"({"id": "zstd", "level": 1})")
        << '}';
    std::ofstream(array + "/.zattrs") << R"({"_ARRAY_DIMENSIONS": ["time", "z", "y", "x"]})";
    const bool is_cloud = std::string(name) == "cloud";
    for (std::size_t t = 0; t < source.info().steps.size(); ++t) {
      const auto volume = value_or_give_up(source.read(is_cloud ? 1 : 0, t));
      const float* values = volume.component(is_cloud ? 0 : *name - 'u');
      chunks.for_each(t, [&](const std::string& file, const std::array<std::size_t, 3>& first) {
        std::vector<float> raw(chunks.items());
        chunks.for_rows(first, [&](std::size_t in_chunk, std::size_t at, std::size_t count) {
          std::copy_n(values + at, count, raw.data() + in_chunk);
        });
        const std::size_t bytes = raw.size() * sizeof(float);
        std::vector<char> packed(ZSTD_compressBound(bytes) + BLOSC_MAX_OVERHEAD);
        const std::size_t size =
            by_blosc ? static_cast<std::size_t>(blosc_compress_ctx(5, BLOSC_SHUFFLE, sizeof(float),
                                                                   bytes, raw.data(), packed.data(),
                                                                   packed.size(), "lz4", 0, 1))
                     : ZSTD_compress(packed.data(), packed.size(), raw.data(), bytes, 1);
        std::ofstream(array + '/' + file, std::ios::binary)
            .write(packed.data(), static_cast<std::streamsize>(size));
      });
    }
  }
}

// Reads an array at a step into `out` by the compressor's library alone.
inline void read_zarr(const std::string& array, const std::array<int, 3>& dims, std::size_t step,
                      bool by_blosc, float* out) {
  const ZarrChunks chunks(dims);
  std::vector<char> packed;
  std::vector<float> raw(chunks.items());
  const std::size_t bytes = raw.size() * sizeof(float);
  chunks.for_each(step, [&](const std::string& file, const std::array<std::size_t, 3>& first) {
    const std::string path = array + '/' + file;
    packed.resize(std::filesystem::file_size(path));
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    const ssize_t got = ::read(descriptor, packed.data(), packed.size());
    ::close(descriptor);
    if (got != static_cast<ssize_t>(packed.size())) give_up("a chunk cannot be read");
    const bool fine =
        by_blosc
            ? blosc_decompress_ctx(packed.data(), raw.data(), bytes, 1) == static_cast<int>(bytes)
            : ZSTD_decompress(raw.data(), bytes, packed.data(), packed.size()) == bytes;
    if (!fine) give_up("a chunk cannot be decoded");
    chunks.for_rows(first, [&](std::size_t in_chunk, std::size_t at, std::size_t count) {
      std::copy_n(raw.data() + in_chunk, count, out + at);
    });
  });
}

}  // namespace windsplat::bench
