// Well-known text, or the EPSG code, of a coordinate reference system -> the attributes of a grid
// mapping.
#pragma once

#include <optional>
#include <string>

#include "server/base/error.hpp"
#include "server/data/cf/grid/projection.hpp"

namespace windsplat::data::cf {

// text: WKT 1 or 2 (ISO 19162), as in the attributes crs_wkt (CF 5.6) and spatial_ref (GDAL).
// Known are the conversions that appendix F of CF has by the names of EPSG, and the pseudo-Mercator
// of web maps; datum shifts are left out. Errors: bad_data with the reason as a predicate.
Result<GridMapping> mapping_of_wkt(const std::string& text);

// The number of "EPSG:3857", "urn:ogc:def:crs:EPSG::3857" or "3857"; nullopt for other texts.
std::optional<int> epsg_code_of(const std::string& text);

// The same as mapping_of_wkt() for a system of the EPSG dataset, from PROJ's database. Errors:
// bad_data with the reason as a predicate, including a database that is not installed.
Result<GridMapping> mapping_of_epsg(int code);

// The absolute folder of PROJ's database proj.db: the first of those of PROJ_DATA and PROJ_LIB, the
// user's and /usr/share/proj that has one; empty if there is none.
std::string projection_database_folder();

}  // namespace windsplat::data::cf
