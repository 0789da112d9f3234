// XML files of VTK: image data, rectilinear and structured grids, unstructured meshes, their
// parallel headers, blocks, collections.
#include <cstdint>
#include <string_view>

#include "server/data/formats/vtk/source.hpp"
#include "tests/fuzz/support/check.hpp"
#include "tests/fuzz/support/files.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view input = fuzz::text_of(data, size);
  const std::string_view head = fuzz::first_file(input).substr(0, 4096);
  if (!windsplat::data::vtk::is_vtk(head) || head.starts_with('#')) return 0;
  fuzz::read_dataset(fuzz::files_of(input, "f.pvd"));
  return 0;
}
