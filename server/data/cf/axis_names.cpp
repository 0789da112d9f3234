// Usual names of dimensions and coordinates -> roles.
#include "server/data/cf/axis_names.hpp"

#include <array>
#include <vector>

#include "server/base/ascii.hpp"
#include "server/data/cf/array_file.hpp"

namespace windsplat::data::cf {

std::string_view without_number(std::string_view name) {
  const auto end = name.find_last_not_of("0123456789_");
  return end == std::string_view::npos ? name : name.substr(0, end + 1);
}

Role role_of_name(std::string_view name) {
  constexpr auto x_names = std::to_array<std::string_view>(
      {"lon",        "longitude", "long", "rlon", "x",  "xc",   "xt",      "xu",
       "xi",         "nlon",      "i",    "ni",   "nx", "east", "easting", "west_east",
       "longitudes", "xdim",      "xh",   "xf",   "xm", "nip1", "nxp1"});
  constexpr auto y_names = std::to_array<std::string_view>(
      {"lat",  "latitude", "rlat", "y",  "yc",    "yt",       "yu",          "eta_rho",
       "nlat", "j",        "nj",   "ny", "north", "northing", "south_north", "latitudes",
       "yv",   "ydim",     "yh",   "yf", "ym",    "njp1",     "nyp1"});
  constexpr auto z_names = std::to_array<std::string_view>(
      {"z",        "lev",      "level",      "levels", "plev",     "height",  "heights", "alt",
       "altitude", "depth",    "depths",     "k",      "nk",       "nz",      "zc",      "zt",
       "zlev",     "pressure", "pres",       "press",  "isobaric", "layer",   "layers",  "lay",
       "sigma",    "hybrid",   "bottom_top", "deptht", "depthu",   "depthv",  "depthw",  "st_ocean",
       "vertical", "nlev",     "levelist",   "mlev",   "ilev",     "lv_isbl", "zdim",    "zh",
       "zf",       "zu_3d",    "zw_3d",      "zm",     "nkp1",     "nzp1"});
  constexpr auto time_names = std::to_array<std::string_view>(
      {"time", "t", "times", "nt", "timestep", "time_step", "step", "steps", "date", "frtime",
       "frame", "frames", "ntime", "time_counter", "month", "record"});
  constexpr auto other_names = std::to_array<std::string_view>(
      {"bnds", "bounds", "nv", "nbnd", "nbnds", "vertices", "corners", "nvertex", "member",
       "ensemble", "realization", "number", "strlen", "ncells", "ncol", "bnd", "expver"});
  if (is_one_of(name, x_names)) return Role::x;
  if (is_one_of(name, y_names)) return Role::y;
  if (is_one_of(name, z_names)) return Role::z;
  if (is_one_of(name, time_names)) return Role::time;
  return is_one_of(name, other_names) ? Role::other : Role::unknown;
}

int named_coordinate(const FileContents& contents, int dimension) {
  const Role role = role_of_name(lower(contents.dimensions[at(dimension)].name));
  if (role != Role::x && role != Role::y && role != Role::z) return -1;
  int found = -1;
  for (std::size_t v = 0; v < contents.variables.size(); ++v) {
    const FileVariable& one = contents.variables[v];
    if (!one.numeric || one.dims.size() != 1 || one.dims[0] != dimension) continue;
    const Role own = role_of_name(lower(one.name));
    if (own == Role::unknown) continue;
    if (found >= 0 || own != role) return -1;
    found = static_cast<int>(v);
  }
  return found;
}

}  // namespace windsplat::data::cf
