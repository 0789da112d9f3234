// GrADS descriptors and the files that they name.
#include <cstdint>
#include <string_view>

#include "server/data/formats/grads/file.hpp"
#include "tests/fuzz/support/check.hpp"
#include "tests/fuzz/support/files.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view input = fuzz::text_of(data, size);
  // Other readers have their own targets, and libraries are not loaded into this process.
  if (!windsplat::data::grads::looks_like(fuzz::first_file(input).substr(0, 4096))) return 0;
  fuzz::read_dataset(fuzz::files_of(input, "g.ctl"));
  return 0;
}
