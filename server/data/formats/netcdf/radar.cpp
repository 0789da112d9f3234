#include "server/data/formats/netcdf/radar.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include "server/base/ascii.hpp"
#include "server/data/cf/array_file.hpp"

namespace windsplat::data::netcdf {

std::string refused_convention(const std::string& conventions) {
  if (!lower(conventions).starts_with("odim_h5")) return {};
  return "has radar data of the convention " + in_quotes(conventions) +
         ", in polar coordinates and with scales in groups, which is not supported: convert it to "
         "a grid in netCDF";
}

void leave_out_rays(FileContents& contents) {
  constexpr auto polar = std::to_array<std::string_view>(
      {"ray_azimuth_angle", "ray_elevation_angle", "projection_range_coordinate",
       "sensor_to_target_azimuth_angle", "sensor_to_target_elevation_angle"});
  std::vector<std::string> along(contents.dimensions.size());  // names of those coordinates
  for (const FileVariable& variable : contents.variables) {
    if (variable.dims.size() != 1 || !is_one_of(variable.standard_name, polar)) continue;
    along.at(cf::at(variable.dims[0])) = variable.name;
  }
  for (FileVariable& variable : contents.variables) {
    if (!variable.numeric || variable.dims.size() < 2) continue;
    for (const int d : variable.dims) {
      if (along.at(cf::at(d)).empty()) continue;
      variable.numeric = false;
      variable.unread = "it lies along the rays of a radar (" + in_quotes(along.at(cf::at(d))) +
                        "): polar coordinates are not supported";
    }
  }
}

}  // namespace windsplat::data::netcdf
