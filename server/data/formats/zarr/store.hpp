// A folder that is a Zarr v2 store. Chunks -> blocks of numbers.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/bytes/decode_limits.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/files/files.hpp"
#include "server/data/formats/zarr/chunk_cache.hpp"
#include "server/data/formats/zarr/scan.hpp"

namespace windsplat::data::zarr {

// Whether a folder is a Zarr store of any version.
bool is_store(Files& files);

// Conventions of xarray: `_ARRAY_DIMENSIONS` names the dimensions, and fill_value is _FillValue.
// https://zarr-specs.readthedocs.io/en/latest/v2/v2.0.html
class Store final : public cf::ArrayFile {
 public:
  // Errors: bad_data, including version 3.
  static Result<std::unique_ptr<Store>> open(std::shared_ptr<Files> files);

  [[nodiscard]] const FileContents& contents() const override { return contents_.file; }
  [[nodiscard]] const std::string& name() const override { return contents_.name; }
  [[nodiscard]] std::string format() const override { return "Zarr v2"; }
  [[nodiscard]] std::string identity() const override { return contents_.identity; }

  [[nodiscard]] cf::Numbers numbers(int variable, const char* attribute) const override;
  [[nodiscard]] std::string text_of(int variable, const char* attribute) const override;
  [[nodiscard]] std::vector<std::size_t> chunk(int variable) const override;
  [[nodiscard]] std::size_t chunk_cost_bytes(int /*variable*/) const override {
    return zarr_chunk_cost_bytes;
  }
  void forget_chunks(int variable) const override;

  Result<void> read(int variable, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count, double* out) const override;
  Result<void> read(int variable, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count, float* out) const override;

 private:
  Store(std::shared_ptr<Files> files, StoreContents contents)
      : files_(std::move(files)), contents_(std::move(contents)) {}

  [[nodiscard]] const Array& array_of(int variable) const;
  template <class Out>
  Result<void> read_block(int variable, const std::vector<std::size_t>& start,
                          const std::vector<std::size_t>& count, Out* out) const;
  Result<const ChunkBytes*> chunk_at(int variable, const std::vector<std::size_t>& place,
                                     std::size_t kept_bytes_max) const;
  Result<ChunkBytes> load(const Array& array, const std::string& path) const;

  std::shared_ptr<Files> files_;
  StoreContents contents_;
  mutable std::mutex mutex_;  // guards the cached chunks
  mutable ChunkCache kept_;
};

}  // namespace windsplat::data::zarr
