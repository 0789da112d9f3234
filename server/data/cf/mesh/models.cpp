#include "server/data/cf/mesh/models.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <string_view>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/cf/coordinates.hpp"
#include "server/data/cf/units.hpp"

namespace windsplat::data::cf {

namespace {

struct KnownName {
  std::string_view convention;
  std::string_view name;
  const char* standard_name;
};
constexpr auto mesh_names = std::to_array<KnownName>({
    {"MPAS", "uReconstructZonal", "eastward_wind"},
    {"MPAS", "uReconstructMeridional", "northward_wind"},
    {"MPAS", "w", "upward_air_velocity"},
    {"MPAS", "zgrid", "altitude"},
    {"MPAS", "velocityZonal", "eastward_sea_water_velocity"},
    {"MPAS", "velocityMeridional", "northward_sea_water_velocity"},
    {"MPAS", "vertVelocityTop", "upward_sea_water_velocity"},
    {"FVCOM", "u", "eastward_sea_water_velocity"},
    {"FVCOM", "v", "northward_sea_water_velocity"},
    {"FVCOM", "ww", "upward_sea_water_velocity"},
    {"CF bounds", "z_mc", "altitude"},
});

// Positions, sizes and numbers of cells, edges and vertices (MPAS mesh specification, version 1.0)
// and positions of FVCOM, which have no units by which they could be recognised.
constexpr auto mpas_descriptions = std::to_array<std::string_view>(
    {"latcell",       "loncell",        "xcell",        "ycell",         "zcell",
     "latedge",       "lonedge",        "xedge",        "yedge",         "zedge",
     "latvertex",     "lonvertex",      "xvertex",      "yvertex",       "zvertex",
     "areacell",      "areatriangle",   "meshdensity",  "dcedge",        "dvedge",
     "angleedge",     "nedgesoncell",   "nedgesonedge", "indextocellid", "kiteareasonvertex",
     "indextoedgeid", "indextovertexid"});
constexpr auto fvcom_descriptions =
    std::to_array<std::string_view>({"lon", "lat", "lonc", "latc", "x", "y", "xc", "yc"});

int on_dimensions(const FileContents& contents, const char* name, const std::vector<int>& dims) {
  const int v = variable_named(contents, name);
  return v >= 0 && contents.variables[at(v)].numeric && contents.variables[at(v)].dims == dims ? v
                                                                                               : -1;
}

// Means over the columns of a table of levels and columns, NaN where all are missing.
std::vector<double> row_means(const std::vector<double>& values, std::size_t rows) {
  std::vector<double> out;
  const std::size_t columns = values.size() / rows;
  for (std::size_t k = 0; k < rows; ++k) {
    double sum = 0;
    std::size_t count = 0;
    for (std::size_t n = k * columns; n < (k + 1) * columns; ++n) {
      if (std::isnan(values[n])) continue;
      sum += values[n];
      ++count;
    }
    out.push_back(sum / static_cast<double>(count));
  }
  return out;
}

using FoundLevels = Result<std::vector<MeshLevels>>;

FoundLevels fvcom_levels(const ArrayFile& file, const SigmaHeights& heights) {
  const FileVariable& sigma = file.contents().variables.at(at(heights.sigma));
  auto values = unpacked_values(file, heights.sigma);
  if (!values) return values.error();
  MeshLevels out;
  out.dimension = sigma.dims[0];
  out.variable.standard_name = "ocean_sigma_coordinate";
  out.variable.long_name = "mean sigma of the layers";
  out.variable.positive = "up";
  out.variable.units = "1";
  out.values = row_means(*values, file.contents().dimensions.at(at(out.dimension)).length);
  return std::vector{std::move(out)};
}

FoundLevels mpas_levels(const ArrayFile& file) {
  const FileContents& contents = file.contents();
  const int levels = dimension_named(contents, "nVertLevels");
  const bool in_water = variable_named(contents, "layerThickness") >= 0 ||
                        variable_named(contents, "velocityZonal") >= 0 ||
                        variable_named(contents, "refBottomDepth") >= 0;
  if (levels < 0 || !in_water) return std::vector<MeshLevels>();
  MeshLevels out;
  out.dimension = levels;
  out.variable.positive = "down";
  out.variable.units = "level";
  const std::size_t count = contents.dimensions.at(at(levels)).length;
  const int bottoms = on_dimensions(contents, "refBottomDepth", {levels});
  if (bottoms >= 0) {
    auto depths = unpacked_values(file, bottoms);
    if (!depths) return depths.error();
    out.variable.units = "m";
    out.variable.standard_name = "depth";
    double above = 0;
    for (const double bottom : *depths) {
      out.values.push_back((above + bottom) / 2);
      above = bottom;
    }
    return std::vector{std::move(out)};
  }
  for (std::size_t k = 0; k < count; ++k) out.values.push_back(static_cast<double>(k));
  return std::vector{std::move(out)};
}

}  // namespace

bool describes_mesh_of(std::string_view convention, const std::string& name) {
  if (convention == "MPAS") return is_one_of(lower(name), mpas_descriptions);
  return convention == "FVCOM" && is_one_of(lower(name), fvcom_descriptions);
}

void name_mesh_variables(FileContents& contents, const std::string& convention) {
  for (FileVariable& variable : contents.variables) {
    for (const KnownName& known : mesh_names) {
      if (known.convention != convention || known.name != variable.name) continue;
      const bool is_fvcom = known.convention == "FVCOM";  // writes "Northward_sea_water_velocity"
      if (variable.standard_name.empty() || is_fvcom) variable.standard_name = known.standard_name;
      if (variable.units == "m s^{-1}") variable.units = "m s-1";
    }
  }
}

SigmaHeights sigma_heights_of(const FileContents& contents, const Topology& topology) {
  const int levels = dimension_named(contents, "siglay");
  if (topology.convention != "FVCOM" || levels < 0) return {};
  SigmaHeights out;
  out.sigma = on_dimensions(contents, "siglay", {levels, topology.nodes});
  out.depth = on_dimensions(contents, "h", {topology.nodes});
  const int surface = variable_named(contents, "zeta");
  const bool usable = surface >= 0 && contents.variables[at(surface)].numeric &&
                      contents.variables[at(surface)].dims.size() == 2 &&
                      contents.variables[at(surface)].dims[1] == topology.nodes;
  if (out.sigma < 0 || out.depth < 0 || !usable) return {};
  out.surface = surface;
  return out;
}

FoundLevels levels_of_mesh(const ArrayFile& file, const Topology& topology) {
  const SigmaHeights heights = sigma_heights_of(file.contents(), topology);
  if (heights.sigma >= 0) return fvcom_levels(file, heights);
  if (topology.convention == "MPAS") return mpas_levels(file);
  return std::vector<MeshLevels>();
}

}  // namespace windsplat::data::cf
