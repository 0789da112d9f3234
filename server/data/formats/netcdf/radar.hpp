// Measurements of radars in polar coordinates, which are not drawn.
#pragma once

#include <string>

#include "server/data/cf/contents.hpp"

namespace windsplat::data::netcdf {

// Why files of these `Conventions` are refused: those of ODIM_H5 have scale and masks in groups
// beside the numbers. Empty for others.
std::string refused_convention(const std::string& conventions);

// Marks variables along rays as unread: those on a dimension of which a coordinate is an azimuth,
// an elevation or a range by its standard name (CfRadial, FM 301).
void leave_out_rays(FileContents& contents);

}  // namespace windsplat::data::netcdf
