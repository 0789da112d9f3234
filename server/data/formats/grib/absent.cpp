// Without ecCodes: GRIB is detected and rejected.
#include "server/data/formats/grib/open.hpp"

namespace windsplat::data::grib {

std::string definitions_folder() { return {}; }

Result<std::unique_ptr<cf::ArrayFile>> open(std::shared_ptr<const InputFile> input) {
  return input->fault("is a GRIB file, and this windsplat was built without GRIB");
}

}  // namespace windsplat::data::grib
