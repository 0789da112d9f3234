// GRIB files: the project's index of messages, then ecCodes, in a separate process.
#include <cstdint>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>

#include "tests/fuzz/support/apart.hpp"
#include "tests/fuzz/support/check.hpp"
#include "tests/fuzz/support/files.hpp"

namespace {

// Valid files, read in this process: ecCodes caches its tables, which take a second to load, for
// all children.
bool keep_tables() {
  for (const char* name : {"regular_ll_pl_grib1", "regular_ll_pl_grib2"}) {
    std::ifstream file("/usr/share/eccodes/samples/" + std::string(name) + ".tmpl",
                       std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(file)),
                            std::istreambuf_iterator<char>());
    if (!bytes.empty()) fuzz::read_dataset(fuzz::files_of(bytes, "g.grib", fuzz::Kept::on_disk));
  }
  return true;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace std::literals;
  const std::string_view input = fuzz::text_of(data, size);
  if (!input.starts_with("GRIB"sv)) return 0;
  [[maybe_unused]] static const bool tables = keep_tables();
  fuzz::apart(
      [input] { fuzz::read_dataset(fuzz::files_of(input, "g.grib", fuzz::Kept::on_disk)); });
  return 0;
}
