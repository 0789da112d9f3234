// Data types as NumPy writes them, "<f4": in .zarray, and in the filters of numcodecs.
#pragma once

#include <optional>

#include "server/data/formats/zarr/metadata.hpp"

namespace windsplat::data::zarr {

struct StoredDtype {
  Dtype type;
  bool big_endian = false;
};

// nullopt for types other than plain numbers.
std::optional<StoredDtype> parse_dtype(const Json* json);

}  // namespace windsplat::data::zarr
