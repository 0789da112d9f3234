// Zarr stores: every member of the folder is a file of the input. The libraries of its codecs
// (zlib, zstd, LZ4, Blosc) are in this process too.
#include <cstdint>
#include <memory>
#include <string_view>

#include "server/data/formats/zarr/store.hpp"
#include "tests/fuzz/support/check.hpp"
#include "tests/fuzz/support/files.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view input = fuzz::text_of(data, size);
  const auto files = fuzz::files_of(input, "s.zarr", fuzz::Kept::folder);
  if (!windsplat::data::zarr::is_store(*files)) return 0;
  fuzz::read_dataset(files);
  return 0;
}
