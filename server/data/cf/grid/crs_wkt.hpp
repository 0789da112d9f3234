// Well-known text of a coordinate reference system -> the attributes of a grid mapping.
#pragma once

#include <string>

#include "server/base/error.hpp"
#include "server/data/cf/grid/projection.hpp"

namespace windsplat::data::cf {

// text: WKT 1 or 2 (ISO 19162), as in the attributes crs_wkt (CF 5.6) and spatial_ref (GDAL).
// Known are the conversions that appendix F of CF has by the names of EPSG, and the pseudo-Mercator
// of web maps; datum shifts are left out. Errors: bad_data with the reason as a predicate.
Result<GridMapping> mapping_of_wkt(const std::string& text);

}  // namespace windsplat::data::cf
