// The metadata of a store: files -> arrays, dimensions, attributes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/contents.hpp"
#include "server/data/files/files.hpp"
#include "server/data/formats/zarr/levels/names.hpp"
#include "server/data/formats/zarr/metadata.hpp"

namespace windsplat::data::zarr {

// Evenly spaced positions, of an axis of an image.
struct Line {
  double first = 0;
  double spacing = 1;
  [[nodiscard]] double at(std::size_t index) const {
    return first + spacing * static_cast<double>(index);
  }
};

struct Array {
  std::string path;  // below the store, empty or ending in '/'
  std::string name;
  Json attributes;
  ArrayMetadata metadata;
  std::vector<std::string> dimensions;
  bool named_dimensions = false;   // whether the array itself names them
  std::optional<Line> line;        // instead of stored values
  std::uint64_t absent_files = 0;  // absent chunks or shards, if all were looked at

  [[nodiscard]] bool is_coordinate() const {
    return dimensions.size() == 1 && dimensions[0] == name;
  }
  // The default fill_value of Zarr is 0; only xarray uses it for missing values.
  [[nodiscard]] bool is_fill_a_number() const {
    return metadata.fill_value && *metadata.fill_value == 0 && !named_dimensions;
  }
};

struct StoreContents {
  int version = 2;
  std::string name;
  // Derived from the metadata and the files of all chunks, or 4096 evenly distributed ones if there
  // are more; of a store with levels whose attribute says what it contains, from the metadata.
  std::string identity;
  std::vector<Array> arrays;  // parallel to the variables
  FileContents file;
  std::optional<LevelNames> levels;
  std::vector<Array> level_arrays;  // all that `levels` names, by path as their name
};

// Errors: bad_data.
Result<StoreContents> scan_store(Files& files);

// An attribute, trimmed; empty if absent or not a string.
std::string text_in(const Json& attributes, std::string_view key);

}  // namespace windsplat::data::zarr
