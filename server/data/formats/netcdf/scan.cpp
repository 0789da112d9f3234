// Groups, dimensions, variables and attributes of a file, through the netCDF C library.
#include <netcdf.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "server/base/ascii.hpp"
#include "server/data/cf/grid/axes.hpp"
#include "server/data/cf/grid/cell_lists.hpp"
#include "server/data/cf/grid/grid.hpp"
#include "server/data/cf/grid/vertical.hpp"
#include "server/data/formats/netcdf/bare.hpp"
#include "server/data/formats/netcdf/dates.hpp"
#include "server/data/formats/netcdf/file.hpp"
#include "server/data/formats/netcdf/meep.hpp"
#include "server/data/formats/netcdf/radar.hpp"

namespace windsplat::data::netcdf {

namespace {

constexpr std::size_t text_max = 4096;      // bytes of a text attribute; the rest is dropped
constexpr std::size_t numbers_max = 65536;  // values of a numeric attribute
constexpr int variables_max = 8192;
constexpr std::size_t groups_max = 1024;
constexpr int depth_max = 64;  // limit on groups within groups

struct TypeName {
  nc_type type;
  const char* name;
};
constexpr auto number_types = std::to_array<TypeName>({{NC_BYTE, "int8"},
                                                       {NC_UBYTE, "uint8"},
                                                       {NC_SHORT, "int16"},
                                                       {NC_USHORT, "uint16"},
                                                       {NC_INT, "int32"},
                                                       {NC_UINT, "uint32"},
                                                       {NC_INT64, "int64"},
                                                       {NC_UINT64, "uint64"},
                                                       {NC_FLOAT, "float32"},
                                                       {NC_DOUBLE, "float64"}});

const char* number_type_name(nc_type type) {
  const auto* at = std::find_if(number_types.begin(), number_types.end(),
                                [type](const TypeName& known) { return known.type == type; });
  return at == number_types.end() ? nullptr : at->name;
}

// Unlimited dimensions of a group and those above it.
bool unlimited_above(int group, std::vector<int>& out) {
  for (int at = group, depth = 0; depth < depth_max; ++depth) {
    int count = 0;
    if (nc_inq_unlimdims(at, &count, nullptr) != NC_NOERR || count < 0) return false;
    std::vector<int> ids(static_cast<std::size_t>(count));
    if (nc_inq_unlimdims(at, &count, ids.data()) != NC_NOERR) return false;
    out.insert(out.end(), ids.begin(), ids.end());
    if (nc_inq_grp_parent(at, &at) != NC_NOERR) return true;
  }
  return false;
}

// Paths of the groups below one, breadth first, at most groups_max.
std::vector<std::string> groups_below(int root, const std::string& root_path) {
  struct Group {
    int id;
    std::string path;
  };
  std::vector<Group> found{{root, root_path}};
  for (std::size_t at = 0; at < found.size() && found.size() < groups_max; ++at) {
    int count = 0;
    if (nc_inq_grps(found[at].id, &count, nullptr) != NC_NOERR || count <= 0) continue;
    std::vector<int> ids(static_cast<std::size_t>(count));
    if (nc_inq_grps(found[at].id, &count, ids.data()) != NC_NOERR) continue;
    for (const int id : ids) {
      std::array<char, NC_MAX_NAME + 1> name{};
      if (nc_inq_grpname(id, name.data()) != NC_NOERR) continue;
      found.push_back({id, found[at].path + '/' + name.data()});
    }
  }
  std::vector<std::string> paths;
  for (std::size_t n = 1; n < found.size() && n <= groups_max; ++n) paths.push_back(found[n].path);
  return paths;
}

// "but '/a', '/b'": lists the groups present where the requested one is absent.
std::string there_is(const std::vector<std::string>& groups) {
  constexpr std::size_t listed_max = 20;
  if (groups.empty()) return "nor any other";
  std::string out = "but ";
  for (std::size_t n = 0; n < std::min(groups.size(), listed_max); ++n) {
    if (n > 0) out += ", ";
    out += in_quotes(groups[n]);
  }
  if (groups.size() > listed_max)
    out += " and " + std::to_string(groups.size() - listed_max) + " more";
  return out;
}

}  // namespace

std::string File::text(const Place& variable, const char* attribute) {
  nc_type type = NC_NAT;
  std::size_t length = 0;
  if (nc_inq_att(variable.group, variable.id, attribute, &type, &length) != NC_NOERR ||
      length == 0 || length > numbers_max) {
    return {};
  }
  std::string out;
  if (type == NC_CHAR) {
    out.resize(length);
    if (nc_get_att_text(variable.group, variable.id, attribute, out.data()) != NC_NOERR) {
      return {};
    }
  } else if (type == NC_STRING) {
    std::vector<char*> strings(length, nullptr);
    if (nc_get_att_string(variable.group, variable.id, attribute, strings.data()) != NC_NOERR) {
      return {};
    }
    if (strings[0] != nullptr) {
      out = strings[0];
    }
    nc_free_string(length, strings.data());
  }
  out = out.substr(0, out.find('\0'));
  return std::string(trim(out)).substr(0, text_max);
}

cf::Numbers File::numbers(int variable, const char* attribute) const {
  const LibraryLock lock;
  const auto [group, id] = place_of(variable);
  nc_type type = NC_NAT;
  std::size_t length = 0;
  cf::Numbers out;
  if (nc_inq_att(group, id, attribute, &type, &length) != NC_NOERR ||
      number_type_name(type) == nullptr || length > numbers_max) {
    return out;
  }
  out.floating = type == NC_FLOAT || type == NC_DOUBLE;
  out.values.resize(length);
  if (nc_get_att_double(group, id, attribute, out.values.data()) != NC_NOERR) {
    out.values.clear();
  }
  return out;
}

std::string File::text_of(int variable, const char* attribute) const {
  const LibraryLock lock;
  return text(place_of(variable), attribute);
}

Result<void> File::scan(const std::string& group) {
  const LibraryLock lock;
  if (const std::string why = refused_convention(text({ncid_, NC_GLOBAL}, "Conventions"));
      !why.empty()) {
    return fault(why);
  }
  const std::vector<std::string> groups = groups_below(ncid_, "");
  if (auto done = choose_group(group, groups); !done) return done;
  std::copy_if(groups.begin(), groups.end(), std::back_inserter(contents_.groups),
               [this](const std::string& path) { return path != group_; });
  return {};
}

Result<void> File::choose_group(const std::string& wanted, const std::vector<std::string>& groups) {
  if (!wanted.empty()) {
    std::string path = wanted.front() == '/' ? wanted : '/' + wanted;
    while (!path.empty() && path.back() == '/') path.pop_back();
    if (!path.empty() && std::find(groups.begin(), groups.end(), path) == groups.end()) {
      return make_error(ErrorKind::not_found, in_quotes(input_->name()) + " has no group " +
                                                  in_quotes(path) + ", " + there_is(groups));
    }
    return scan_group(path);
  }
  if (auto done = scan_group(""); !done || has_field()) return done;
  for (const std::string& path : groups) {
    if (auto done = scan_group(path); !done) return done;
    if (has_field()) {
      contents_.notes.push_back("the group " + in_quotes(path) +
                                " is shown, the first one that has a field");
      return {};
    }
  }
  return scan_group("");  // reports why no field was found
}

bool File::has_field() const {
  return static_cast<bool>(cf::choose_grid(contents_, cf::classify_dimensions(contents_)));
}

Result<void> File::scan_group(const std::string& path) {
  contents_ = {};
  places_.clear();
  paths_.clear();
  dimension_ids_.clear();
  group_ = path;
  int group = ncid_;
  if (!path.empty() && nc_inq_grp_full_ncid(ncid_, path.c_str(), &group) != NC_NOERR) {
    return fault("is damaged: the group " + in_quotes(path) + " cannot be read");
  }
  contents_.title = text({group, NC_GLOBAL}, "title");
  if (contents_.title.empty()) contents_.title = text({ncid_, NC_GLOBAL}, "title");
  if (auto fine = scan_dimensions(group); !fine) {
    return fine;
  }
  int at = group;
  for (int depth = 0; depth < depth_max; ++depth) {
    if (auto fine = scan_variables(at, depth > 0); !fine) {
      return fine;
    }
    if (nc_inq_grp_parent(at, &at) != NC_NOERR) break;
  }
  find_dates();
  leave_out_rays(contents_);
  if (!classic_) {
    name_axes_of_meep(contents_);
    name_steps_of_bare_arrays(contents_);
  }
  if (const std::string uuid = cf::known_grid_uuid(text({ncid_, NC_GLOBAL}, "uuidOfHGrid"));
      !uuid.empty()) {
    const std::vector<bool> lists = cf::find_cell_lists(contents_);
    for (std::size_t d = 0; d < lists.size(); ++d) {
      if (lists[d]) contents_.dimensions[d].grid_uuid = uuid;
    }
  }
  return {};
}

Result<void> File::scan_dimensions(int group) {
  int count = 0;
  if (nc_inq_dimids(group, &count, nullptr, 1) != NC_NOERR || count < 0) {
    return fault("is damaged: its dimensions cannot be listed");
  }
  dimension_ids_.resize(static_cast<std::size_t>(count));
  std::vector<int> unlimited;
  if (nc_inq_dimids(group, &count, dimension_ids_.data(), 1) != NC_NOERR ||
      !unlimited_above(group, unlimited)) {
    return fault("is damaged: its dimensions cannot be listed");
  }
  for (const int id : dimension_ids_) {
    std::array<char, NC_MAX_NAME + 1> name{};
    FileDimension dimension;
    if (nc_inq_dim(group, id, name.data(), &dimension.length) != NC_NOERR) {
      return fault("is damaged: a dimension cannot be read");
    }
    dimension.name = name.data();
    // Older versions of the library leave no mark except dimension scales.
    netcdf4_ = netcdf4_ || !is_bare(dimension);
    dimension.unlimited = std::find(unlimited.begin(), unlimited.end(), id) != unlimited.end();
    contents_.dimensions.push_back(std::move(dimension));
  }
  set_spacing_of_wrf(group);
  return {};
}

// WRF gives the lengths of its cells in the plane of the map as DX and DY of the file.
void File::set_spacing_of_wrf(int group) {
  for (const auto& [name, attribute] :
       {std::pair("west_east", "DX"), std::pair("south_north", "DY")}) {
    const int dimension = cf::dimension_named(contents_, name);
    double metres = 0;
    nc_type type = NC_NAT;
    std::size_t length = 0;
    if (dimension < 0 || nc_inq_att(group, NC_GLOBAL, attribute, &type, &length) != NC_NOERR ||
        length != 1 || number_type_name(type) == nullptr ||
        nc_get_att_double(group, NC_GLOBAL, attribute, &metres) != NC_NOERR) {
      continue;
    }
    constexpr double metres_max = 1e7;
    if (metres > 0 && metres <= metres_max) {
      contents_.dimensions[static_cast<std::size_t>(dimension)].spacing_m = metres;
    }
  }
}

// Only characters: strings (NC_STRING) are not read.
void File::find_dates() {
  dates_ = -1;
  const int found = text_of_dates(contents_);
  nc_type type = NC_NAT;
  if (found < 0) return;
  const Place place = place_of(found);
  if (nc_inq_vartype(place.group, place.id, &type) != NC_NOERR || type != NC_CHAR) return;
  std::string named = contents_.variables[cf::at(found)].calendar;
  const bool is_own = !named.empty();
  if (!is_own) named = text({place.group, NC_GLOBAL}, "config_calendar_type");
  if (!is_own && named.empty()) named = text({ncid_, NC_GLOBAL}, "config_calendar_type");
  const std::string calendar = calendar_of_dates(named);
  if (calendar.empty()) {
    contents_.variables[cf::at(found)].unread =
        std::string("the calendar of its dates, ") +
        (is_own ? "its attribute 'calendar'" : "the attribute 'config_calendar_type'") + ' ' +
        in_quotes(named) + ", is unknown: steps are numbered";
    return;
  }
  use_dates(contents_, found, calendar);
  dates_ = found;
}

Result<void> File::scan_variables(int group, bool above) {
  int count = 0;
  if (nc_inq_nvars(group, &count) != NC_NOERR || count < 0 || count > variables_max) {
    return fault("is damaged or has more than " + std::to_string(variables_max) + " variables");
  }
  for (int id = 0; id < count; ++id) {
    if (auto fine = scan_variable({group, id}, above); !fine) return fine;
  }
  return {};
}

Result<void> File::scan_variable(const Place& place, bool above) {
  std::array<char, NC_MAX_NAME + 1> name{};
  nc_type type = NC_NAT;
  int rank = 0;
  std::array<int, NC_MAX_VAR_DIMS> dims{};
  if (nc_inq_var(place.group, place.id, name.data(), &type, &rank, dims.data(), nullptr) !=
      NC_NOERR) {
    return fault("is damaged: a variable cannot be read");
  }
  FileVariable variable;
  variable.name = name.data();
  const char* number = number_type_name(type);
  variable.numeric = number != nullptr;
  variable.type = number != nullptr                      ? number
                  : type == NC_CHAR || type == NC_STRING ? "text"
                                                         : "compound";
  for (int d = 0; d < rank; ++d) {
    const auto at = std::find(dimension_ids_.begin(), dimension_ids_.end(),
                              dims.at(static_cast<std::size_t>(d)));
    if (at == dimension_ids_.end()) {
      return fault("is damaged: a variable's dimension does not exist");
    }
    variable.dims.push_back(static_cast<int>(at - dimension_ids_.begin()));
  }
  variable.standard_name = text(place, "standard_name");
  variable.long_name = text(place, "long_name");
  variable.units = text(place, "units");
  // From parent groups only coordinates are used.
  if (above && rank > 1 &&
      (!(cf::is_position(variable) || cf::is_surface_pressure(variable)) ||
       cf::variable_named(contents_, variable.name) >= 0)) {
    return {};
  }
  variable.axis = text(place, "axis");
  variable.positive = text(place, "positive");
  variable.calendar = text(place, "calendar");
  variable.coordinates = text(place, "coordinates");
  variable.bounds = text(place, "bounds");
  if (variable.bounds.empty()) {
    variable.bounds = text(place, "climatology");
  }
  variable.grid_mapping = text(place, "grid_mapping");
  variable.cf_role = text(place, "cf_role");
  variable.mesh = text(place, "mesh");
  variable.vector_mark = text(place, "windsplat_vector");
  variable.is_unsigned = lower(text(place, "_Unsigned")) == "true";
  int attribute = 0;
  variable.packed = nc_inq_attid(place.group, place.id, "scale_factor", &attribute) == NC_NOERR ||
                    nc_inq_attid(place.group, place.id, "add_offset", &attribute) == NC_NOERR;
  look_at_storage(place, variable);
  contents_.variables.push_back(std::move(variable));
  places_.push_back(place);
  return {};
}

void File::look_at_storage(const Place& place, FileVariable& variable) {
  std::string path;
  if (!classic_) {
    std::size_t length = 0;
    if (nc_inq_grpname_full(place.group, &length, nullptr) == NC_NOERR) {
      path.resize(length);
      nc_inq_grpname_full(place.group, nullptr, path.data());
    }
    if (path == "/") path.clear();
    // A variable with the name of a dimension that is not its coordinate has a different name in
    // HDF5.
    const std::string other = path + "/_nc4_non_coord_" + variable.name;
    path += '/' + variable.name;
    if (storage_.count(other) > 0) path = other;
    const auto found = storage_.find(path);
    variable.unread =
        found == storage_.end() ? "where its data are stored is not known" : found->second.problem;
    variable.numeric = variable.numeric && variable.unread.empty();
  }
  paths_.push_back(std::move(path));
}

}  // namespace windsplat::data::netcdf
