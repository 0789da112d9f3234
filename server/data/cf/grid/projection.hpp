// Map projections of files: attributes of a grid mapping (CF 1.11, appendix F) -> parameters of
// PROJ.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"

namespace windsplat::data::cf {

// The attributes of a grid mapping variable.
struct GridMapping {
  std::map<std::string, std::vector<double>> numbers;
  std::map<std::string, std::string> texts;  // grid_mapping_name, ...
};

// Those of appendix F that a variable has.
GridMapping grid_mapping_at(const ArrayFile& file, int variable);

struct Projection {
  std::string name;  // grid_mapping_name
  std::string
      definition;         // text for PROJ; every parameter is a number, so that no database is read
  double radius_m = 0;    // the semi-major axis
  double origin_x_m = 0;  // false easting and northing
  double origin_y_m = 0;
  double central_longitude = 0;  // degrees east of Greenwich
  // x and y are degrees about a rotated pole; otherwise metres.
  bool in_degrees = false;
  // Geostationary: metres for a radian of the viewing angle; 0: angles have no meaning.
  double metres_per_radian = 0;
  bool may_repeat = false;  // x may run around the globe more than once
  bool verified = false;    // the inverse is defined beyond the map: compare with the forward one
  std::vector<std::string> notes;  // assumptions, for users
};

// Whether a grid mapping has longitudes and latitudes as axes, or axes parallel to theirs.
bool is_along_east(const std::string& grid_mapping_name);

// Degrees by which longitudes of the file differ from those of Greenwich. 0 if the attribute is
// absent or no longitude.
double prime_meridian(const GridMapping& mapping);

// Every projection of appendix F except latitude_longitude. Errors: bad_data with the reason as a
// predicate: an unknown name, an attribute that is absent or has no possible value.
Result<Projection> projection_of(const GridMapping& mapping);

}  // namespace windsplat::data::cf
