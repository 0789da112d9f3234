#include "server/data/open/content.hpp"

#include <string>

#include "server/base/ascii.hpp"
#include "server/data/formats/dx/file.hpp"
#include "server/data/formats/grads/file.hpp"
#include "server/data/formats/grib/open.hpp"
#include "server/data/formats/list/document.hpp"
#include "server/data/formats/nrrd/file.hpp"
#include "server/data/formats/raw/file.hpp"
#include "server/data/formats/vtk/source.hpp"

namespace windsplat::data {

std::string_view format_of_head(std::string_view head) {
  if (head.starts_with("\x89HDF")) return "netCDF-4 or HDF5";
  if (head.starts_with("CDF")) return "netCDF";
  if (grib::is_grib(head)) return "GRIB";
  if (vtk::is_vtk(head)) return "VTK";
  if (list::looks_like(head)) return "list of files";
  if (nrrd::looks_like(head)) return "NRRD";
  if (grads::looks_like(head)) return "GrADS";
  if (raw::looks_like(head)) return "raw";
  if (dx::looks_like(head)) return "OpenDX";
  return {};
}

std::string_view format_of_file(std::string_view head, std::string_view name) {
  const std::string small = lower(name);
  if (small.ends_with(".foam") || small.ends_with(".openfoam")) return "OpenFOAM";
  if ((small.ends_with(".case") || small.ends_with(".encas")) &&
      lower(head).find("ensight") != std::string::npos) {
    return "EnSight";
  }
  return format_of_head(head);
}

}  // namespace windsplat::data
