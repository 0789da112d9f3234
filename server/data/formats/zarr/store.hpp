// A folder that is a Zarr v2 store. Files -> metadata -> FileContents; chunks -> blocks of numbers.
#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/bytes/decode_limits.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/files/files.hpp"
#include "server/data/formats/zarr/metadata.hpp"

namespace windsplat::data::zarr {

// Whether a folder is a Zarr store of any version.
bool is_store(Files& files);

// Conventions of xarray: `_ARRAY_DIMENSIONS` names the dimensions, and fill_value is _FillValue.
// https://zarr-specs.readthedocs.io/en/latest/v2/v2.0.html
class Store final : public cf::ArrayFile {
 public:
  // Errors: bad_data, also for version 3.
  static Result<std::unique_ptr<Store>> open(std::shared_ptr<Files> files);

  [[nodiscard]] const FileContents& contents() const override { return contents_; }
  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] std::string format() const override { return "Zarr v2"; }
  // The identity covers the metadata and all chunks, or 4096 evenly distributed ones if there are
  // more.
  [[nodiscard]] std::string identity() const override { return identity_; }

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
  struct Array {
    std::string path;  // below the store, empty or ending in '/'
    std::string name;
    Json attributes;
    ArrayMetadata metadata;
    std::vector<std::string> dimensions;
    bool named_dimensions = false;  // whether _ARRAY_DIMENSIONS is present
  };
  // A decoded chunk; without bytes if absent.
  struct Chunk {
    std::uint64_t number = 0;
    std::vector<unsigned char> bytes;
  };

  explicit Store(std::shared_ptr<Files> files);
  Result<void> find_arrays();
  Result<void> find_consolidated();
  Result<void> find_below_root();
  Result<Json> read_json(const std::string& path);
  Result<Json> read_attributes(const std::string& path);
  Result<void> add_array(const std::string& name, const std::string& path, const Json& json,
                         Json attributes);
  void forget_all() const;
  void name_dimensions(Array& array) const;
  void describe_all();
  [[nodiscard]] Result<void> check_any_field() const;
  void describe(const Array& array, bool coordinate);
  void identify();
  [[nodiscard]] bool is_fill_a_number(const Array& array) const;
  [[nodiscard]] const Array& array_of(int variable) const;

  template <class Out>
  Result<void> read_block(int variable, const std::vector<std::size_t>& start,
                          const std::vector<std::size_t>& count, Out* out) const;
  Result<const Chunk*> chunk_at(int variable, const std::vector<std::size_t>& place,
                                std::size_t kept_bytes_max) const;
  Result<std::vector<unsigned char>> load(const Array& array, const std::string& path) const;

  std::shared_ptr<Files> files_;
  std::string name_;
  std::string identity_;
  Json attributes_;
  std::vector<Array> found_;   // in the order of their names
  std::vector<Array> arrays_;  // parallel to the variables
  FileContents contents_;

  mutable std::mutex mutex_;  // guards the cached chunks
  mutable int kept_variable_ = -1;
  mutable std::size_t kept_bytes_ = 0;
  mutable std::list<Chunk> kept_;  // most recently used first
  mutable std::unordered_map<std::uint64_t, std::list<Chunk>::iterator> kept_by_number_;
};

}  // namespace windsplat::data::zarr
