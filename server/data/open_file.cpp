// The one door for files: by content, whatever the name.
#include <exception>
#include <new>

#include "server/data/dataset.hpp"
#include "server/data/netcdf_source.hpp"

namespace windsplat::data {

Result<std::unique_ptr<Source>> open_file(const std::string& path) {
  try {
    return netcdf::open_source(path);
  } catch (const std::bad_alloc&) {
    return make_error(ErrorKind::out_of_memory, "no memory to open '" + printable(path) + "'");
  } catch (const std::exception& fault) {
    return make_error(ErrorKind::internal,
                      "opening '" + printable(path) + "' failed: " + printable(fault.what()));
  }
}

}  // namespace windsplat::data
