// HDF5 and netCDF-4 files through the C libraries, in a separate process.
#include <cstdint>
#include <string_view>

#include "tests/fuzz/support/apart.hpp"
#include "tests/fuzz/support/check.hpp"
#include "tests/fuzz/support/files.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace std::literals;
  const std::string_view input = fuzz::text_of(data, size);
  if (!input.starts_with("\x89HDF\r\n\x1a\n"sv)) return 0;
  fuzz::apart([input] { fuzz::read_dataset(fuzz::files_of(input, "x.nc", fuzz::Kept::on_disk)); });
  return 0;
}
