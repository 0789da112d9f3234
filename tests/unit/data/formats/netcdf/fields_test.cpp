// Which variables become fields, which form vectors, and why others are omitted.
#include "server/data/cf/fields/fields.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "server/data/model/dataset_info.hpp"
#include "server/data/open/open.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

FileVariable variable(const std::string& name, const std::string& units = "m/s",
                      const std::string& standard_name = "") {
  FileVariable out;
  out.name = name;
  out.type = "float32";
  out.numeric = true;
  out.dims = {0, 1, 2};
  out.units = units;
  out.standard_name = standard_name;
  return out;
}

struct Found {
  std::string name;
  std::vector<std::string> components;
  bool operator==(const Found&) const = default;
};
std::ostream& operator<<(std::ostream& out, const Found& found) {
  out << found.name << ":";
  for (const std::string& component : found.components) {
    out << ' ' << component;
  }
  return out;
}

// The vectors found among variables on one grid.
std::vector<Found> vectors(const std::vector<FileVariable>& variables,
                           AxisKind vertical = AxisKind::pressure) {
  FileContents contents;
  contents.variables = variables;
  std::vector<int> all;
  for (std::size_t v = 0; v < variables.size(); ++v) {
    all.push_back(static_cast<int>(v));
  }
  std::vector<Found> out;
  std::size_t scalars = 0;
  std::vector<std::string> notes;
  for (const cf::FieldPlan& plan : cf::find_fields(contents, all, vertical, notes)) {
    if (plan.info.kind == FieldKind::vector) {
      out.push_back({plan.info.name, plan.info.components});
    } else {
      ++scalars;
    }
  }
  EXPECT_EQ(scalars, variables.size());  // components can also be shown individually
  return out;
}

using Expected = std::vector<Found>;

TEST(NetcdfFields, WindsByTheirUsualNames) {
  EXPECT_EQ(vectors({variable("u"), variable("v"), variable("w")}),
            (Expected{{"wind", {"u", "v", "w"}}}));
  EXPECT_EQ(vectors({variable("T", "K"), variable("V"), variable("U")}),
            (Expected{{"wind", {"U", "V"}}}));
  EXPECT_EQ(vectors({variable("ua"), variable("va"), variable("wap", "Pa s-1")}),
            (Expected{{"wind", {"ua", "va", "wap"}}}));
  EXPECT_EQ(vectors({variable("uwnd"), variable("vwnd"), variable("omega", "Pascal/s")}),
            (Expected{{"wind", {"uwnd", "vwnd", "omega"}}}));
  EXPECT_EQ(vectors({variable("UGRD"), variable("VGRD"), variable("VVEL", "Pa/s")}),
            (Expected{{"wind", {"UGRD", "VGRD", "VVEL"}}}));
  EXPECT_EQ(vectors({variable("u"), variable("v"), variable("omega", "Pa/s"), variable("w")}),
            (Expected{{"wind", {"u", "v", "w"}}}));
}

TEST(NetcdfFields, WindsByStandardNameWhateverTheirNames) {
  EXPECT_EQ(
      vectors({variable("c", "Pa s-1", "lagrangian_tendency_of_air_pressure"),
               variable("b", "m s-1", "northward_wind"), variable("a", "m s-1", "eastward_wind")}),
      (Expected{{"wind", {"a", "b", "c"}}}));
  EXPECT_EQ(vectors({variable("a", "m s-1", "x_wind"), variable("b", "m s-1", "y_wind"),
                     variable("c", "m s-1", "upward_air_velocity"),
                     variable("d", "Pa s-1", "lagrangian_tendency_of_air_pressure")}),
            (Expected{{"wind", {"a", "b", "c"}}}));
  // Only the horizontal components have the attribute.
  EXPECT_EQ(vectors({variable("ua", "m s-1", "eastward_wind"),
                     variable("va", "m s-1", "northward_wind"), variable("wa")}),
            (Expected{{"wind", {"ua", "va", "wa"}}}));
}

TEST(NetcdfFields, AVelocityOfAirOrWaterKeepsItsWord) {
  FileVariable u = variable("urot", "centimeter/s");
  FileVariable v = variable("vrot", "centimeter/s");
  u.long_name = "Zonal Velocity";
  v.long_name = "Meridional Velocity";
  EXPECT_EQ(vectors({u, v}, AxisKind::cartesian), (Expected{{"velocity", {"urot", "vrot"}}}));
  EXPECT_EQ(vectors({u, v}, AxisKind::pressure), (Expected{{"wind", {"urot", "vrot"}}}));
  u.long_name = "zonal wind velocity";
  EXPECT_EQ(vectors({u, v}, AxisKind::cartesian), (Expected{{"wind", {"urot", "vrot"}}}));
}

TEST(NetcdfFields, Currents) {
  EXPECT_EQ(vectors({variable("a", "m s-1", "eastward_sea_water_velocity"),
                     variable("b", "m s-1", "northward_sea_water_velocity"),
                     variable("c", "m s-1", "upward_sea_water_velocity")},
                    AxisKind::depth),
            (Expected{{"current", {"a", "b", "c"}}}));
  EXPECT_EQ(vectors({variable("a", "m s-1", "sea_water_x_velocity"),
                     variable("b", "m s-1", "sea_water_y_velocity")}),
            (Expected{{"current", {"a", "b"}}}));
  EXPECT_EQ(vectors({variable("uo"), variable("vo"), variable("wo")}, AxisKind::depth),
            (Expected{{"current", {"uo", "vo", "wo"}}}));
  EXPECT_EQ(vectors({variable("u", "cm/s"), variable("v", "cm/s")}, AxisKind::depth),
            (Expected{{"current", {"u", "v"}}}));
}

TEST(NetcdfFields, OtherVectorsByTheirStem) {
  EXPECT_EQ(vectors({variable("Ex", "V/m"), variable("Ey", "V/m"), variable("Ez", "V/m"),
                     variable("bx", "T"), variable("by", "T"), variable("bz", "T")}),
            (Expected{{"E", {"Ex", "Ey", "Ez"}}, {"b", {"bx", "by", "bz"}}}));
  EXPECT_EQ(vectors({variable("vx"), variable("vy"), variable("vz")}),
            (Expected{{"v", {"vx", "vy", "vz"}}}));
  EXPECT_EQ(vectors({variable("foo_x", "N"), variable("foo_y", "N")}),
            (Expected{{"foo", {"foo_x", "foo_y"}}}));
  EXPECT_EQ(vectors({variable("a", "kg m-1 s-1", "eastward_water_vapor_flux"),
                     variable("b", "kg m-1 s-1", "northward_water_vapor_flux")}),
            (Expected{{"water_vapor_flux", {"a", "b"}}}));
  EXPECT_EQ(vectors({variable("ustress", "Pa"), variable("vstress", "Pa")}),
            (Expected{{"uvstress", {"ustress", "vstress"}}}));
}

TEST(NetcdfFields, OtherVariablesFormNoVector) {
  EXPECT_EQ(vectors({variable("u"), variable("w")}), Expected{});
  EXPECT_EQ(vectors({variable("u", "m/s"), variable("v", "V")}), Expected{});  // v is a voltage
  EXPECT_EQ(vectors({variable("max", "K"), variable("min", "K")}), Expected{});
  std::vector<FileVariable> elsewhere{variable("u"), variable("v")};
  elsewhere[1].dims = {3, 1, 2};
  EXPECT_EQ(vectors(elsewhere), Expected{});
}

TEST(NetcdfFields, VectorNamesDifferFromVariableNames) {
  EXPECT_EQ(
      vectors({variable("wind"), variable("u"), variable("v"), variable("ua"), variable("va")}),
      (Expected{{"wind_vector", {"u", "v"}}, {"wind_vector_2", {"ua", "va"}}}));
}

TEST(NetcdfFields, VectorInfoReplacesThatOfItsComponents) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "w.nc");
    const int z = file.axis("lev", {1000, 500}, "hPa");
    const int y = file.axis("lat", {0, 1}, "degrees_north");
    const int x = file.axis("lon", {0, 1, 2}, "degrees_east");
    const int u = file.variable("u", NC_FLOAT, {z, y, x}, counting(12));
    const int v = file.variable("v", NC_FLOAT, {y, z, x}, counting(12, 100));
    const int w = file.variable("omega", NC_SHORT, {z, y, x}, counting(12, -6));
    file.text(u, "units", "m/s");
    file.text(v, "units", "m/s");
    file.text(w, "units", "Pa/s");
    file.number(w, "scale_factor", NC_DOUBLE, {0.25});
    file.number(u, "_FillValue", NC_FLOAT, {3});
  }
  auto source = open_file(folder / "w.nc");
  ASSERT_TRUE(source) << source.error().message;
  const DatasetInfo& info = (*source)->info();
  ASSERT_EQ(info.fields.size(), 14U);  // wind, its three components, and derived fields
  EXPECT_EQ(info.fields[4].name, "standard_height");
  EXPECT_EQ(info.fields[5].name, "wind_m");
  EXPECT_EQ(info.fields[6].name, "wind_horizontal_speed");
  EXPECT_EQ(info.fields[13].name, "wind_m_helicity");
  const FieldInfo& wind = info.fields[0];
  EXPECT_EQ(wind.name, "wind");
  EXPECT_EQ(wind.kind, FieldKind::vector);
  EXPECT_EQ(wind.components, (std::vector<std::string>{"u", "v", "omega"}));
  EXPECT_EQ(wind.component_units, (std::vector<std::string>{"m/s", "m/s", "Pa/s"}));
  EXPECT_EQ(wind.units, "m/s");
  EXPECT_EQ(info.find("omega")->dtype, "int16 packed");
  auto volume = (*source)->read(0, 0);
  ASSERT_TRUE(volume) << volume.error().message;
  ASSERT_EQ(volume->components, 3);
  // In the file, u and omega are ordered z, y, x; v is ordered y, z, x. z 1, y 0, x 2 is number 8
  // of the former and 5 of the latter.
  const std::size_t i = 2 + 3 * (0 + 2 * 1);
  EXPECT_EQ(volume->component(0)[i], 8.0F);
  EXPECT_EQ(volume->component(1)[i], 105.0F);
  EXPECT_EQ(volume->component(2)[i], 0.25F * 2);
  // Where u is missing (z 0, y 1, x 0), the whole vector is masked, but not v alone.
  EXPECT_EQ(volume->masked, 1);
  EXPECT_TRUE(std::isnan(volume->component(1)[3]));
  auto alone = (*source)->read(static_cast<std::size_t>(info.find("v") - info.fields.data()), 0);
  ASSERT_TRUE(alone);
  EXPECT_EQ(alone->masked, 0);
}

// A wind of constant components in the given units beside lon, lat and heights or pressures.
Result<std::unique_ptr<Source>> wind_in(const std::string& path,
                                        const std::array<std::string, 3>& units,
                                        const std::string& level_units = "m") {
  {
    NetcdfMaker file(path);
    const int z = file.axis("lev", {1000, 500}, level_units);
    const int y = file.axis("lat", {0, 1}, "degrees_north");
    const int x = file.axis("lon", {0, 1, 2}, "degrees_east");
    const std::array<const char*, 3> names{"u", "v", "w"};
    const std::array<double, 3> values{36, 72, 50};
    for (std::size_t c = 0; c < 3; ++c) {
      const int v =
          file.variable(names.at(c), NC_FLOAT, {z, y, x}, std::vector<double>(12, values.at(c)));
      if (!units.at(c).empty()) file.text(v, "units", units.at(c));
    }
  }
  return open_file(path);
}

TEST(NetcdfFields, ComponentsAreConvertedToOneUnit) {
  const Folder folder;
  struct Case {
    std::array<std::string, 3> units;
    std::string shown;
    std::array<double, 3> values;
  };
  const double knot = 1852.0 / 3600;
  for (const Case& one :
       std::vector<Case>{{{"knots", "knots", "cm/s"}, "knots", {36, 72, 0.5 / knot}},
                         {{"m s-1", "m/s", "m day-1"}, "m s-1", {36, 72, 50.0 / 86400}},
                         {{"m s**-1", "km/h", "m.s-1"}, "m s**-1", {36, 20, 50}},
                         {{"mV m-1", "V/m", "V.m^-1"}, "mV m-1", {36, 72e3, 50e3}},
                         {{"m/s", "m/s", ""}, "m/s", {36, 72, 50}}}) {
    const auto source = wind_in(folder / "w.nc", one.units);
    ASSERT_TRUE(source) << source.error().message;
    const FieldInfo& wind = (*source)->info().fields.front();
    ASSERT_EQ(wind.components.size(), 3U) << one.shown;
    EXPECT_EQ(wind.units, one.shown);
    EXPECT_EQ(wind.component_units[1], one.shown);
    const auto volume = (*source)->read(0, 0);
    ASSERT_TRUE(volume) << volume.error().message;
    for (int c = 0; c < 3; ++c) {
      const double wanted = one.values.at(static_cast<std::size_t>(c));
      EXPECT_NEAR(volume->component(c)[5], wanted, 1e-6 * wanted) << one.shown << c;
    }
    // A component by itself has the unit of the file.
    const FieldInfo* w = (*source)->info().find("w");
    ASSERT_NE(w, nullptr);
    EXPECT_EQ(w->units, one.units[2]);
  }
}

TEST(NetcdfFields, BesideARateOfPressureVelocitiesAreInMetresPerSecond) {
  const Folder folder;
  const auto source = wind_in(folder / "w.nc", {"km/h", "km/h", "hPa/s"}, "hPa");
  ASSERT_TRUE(source) << source.error().message;
  const DatasetInfo& info = (*source)->info();
  for (const char* name : {"wind", "wind_m"}) {
    const FieldInfo* wind = info.find(name);
    ASSERT_NE(wind, nullptr);
    EXPECT_EQ(wind->component_units[0], "m s-1");
    EXPECT_EQ(wind->component_units[2], std::string(name) == "wind" ? "hPa/s" : "m s-1");
    const auto volume = (*source)->read(static_cast<std::size_t>(wind - info.fields.data()), 0);
    ASSERT_TRUE(volume) << volume.error().message;
    EXPECT_FLOAT_EQ(volume->component(0)[5], 10);
    EXPECT_FLOAT_EQ(volume->component(1)[5], 20);
  }
}

TEST(NetcdfFields, ComponentsOfOtherQuantitiesAreNotJoined) {
  const Folder folder;
  for (const auto& [units, count] : std::map<std::array<std::string, 3>, std::size_t>{
           {{"m/s", "m/s", "s-1"}, 2}, {{"V/m", "V/m", "T"}, 2}, {{"m/s", "K", "m/s"}, 1}}) {
    const auto source = wind_in(folder / "w.nc", units);
    ASSERT_TRUE(source) << source.error().message;
    const DatasetInfo& info = (*source)->info();
    EXPECT_EQ(info.fields.front().components.size(), count) << units[2];
    const std::string other = count == 2 ? "'w' (" + units[2] : "'v' (" + units[1];
    const std::string wanted = other + ") is no component of a vector with 'u' (" + units[0] +
                               "): its unit cannot be converted to that";
    EXPECT_EQ(std::count(info.notes.begin(), info.notes.end(), wanted), 1) << units[2];
  }
}

// Factors beyond the largest number have no ratio; notes do not repeat units of any length.
TEST(NetcdfFields, ComponentsOfUnitsWithoutAFiniteRatioAreNotJoined) {
  const Folder folder;
  std::string unit;
  for (int n = 0; n < 60; ++n) unit += "km9 ";
  const auto source = wind_in(folder / "w.nc", {unit + "m1", unit + "m", "s-1"});
  ASSERT_TRUE(source) << source.error().message;
  const DatasetInfo& info = (*source)->info();
  EXPECT_EQ(info.fields.front().components.size(), 1U);
  const auto joined = std::find_if(info.notes.begin(), info.notes.end(), [](const auto& note) {
    return note.find("'v' (km9 km9") != std::string::npos;
  });
  ASSERT_NE(joined, info.notes.end());
  EXPECT_LT(joined->size(), 250U);
}

TEST(NetcdfFields, VelocitiesThatTwoFilesHaveAreNotNotedAsAbsent) {
  const Folder folder;
  for (const char* name : {"a.nc", "b.nc"}) {
    const auto source = wind_in(folder / name, {"m/s", "m/s", "m/s"});
    ASSERT_TRUE(source) << source.error().message;
  }
  const auto joined = open_file(folder / "{a,b}.nc");
  ASSERT_TRUE(joined) << joined.error().message;
  const DatasetInfo& info = (*joined)->info();
  EXPECT_EQ(info.fields.front().components.size(), 3U);
  EXPECT_EQ(std::count_if(
                info.left_out.begin(), info.left_out.end(),
                [](const LeftOut& left) { return left.reason.starts_with("in several files"); }),
            3);
  for (const std::string& note : info.notes) {
    EXPECT_EQ(note.find("components of a velocity are not shown"), std::string::npos) << note;
  }
}

TEST(NetcdfFields, LargestGridIsUsedAndTheRestIsExplained) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "many.nc");
    const int t = file.axis("time", {0, 1}, "days since 2001-01-01");
    const int z = file.axis("lev", {1000, 500, 100}, "hPa");
    const int soil = file.axis("depth", {0.1, 1}, "m");
    const int y = file.axis("lat", {0, 1, 2}, "degrees_north");
    const int x = file.axis("lon", {0, 1, 2, 3}, "degrees_east");
    const int pair = file.dimension("bnds", 2);
    const int letters = file.dimension("letters", 4);
    const int members = file.dimension("member", 3);
    const int none = file.dimension("obs", NC_UNLIMITED);
    file.variable("cloud", NC_FLOAT, {t, z, y, x}, counting(72));
    file.variable("orography", NC_FLOAT, {z, y, x}, counting(36));  // the same at all times
    file.variable("ps", NC_FLOAT, {t, y, x}, counting(24));
    file.variable("moisture", NC_FLOAT, {t, soil, y, x}, counting(48));
    file.variable("lat_bnds", NC_DOUBLE, {y, pair}, counting(6));
    file.text(file.variable_id("lat"), "bounds", "lat_bnds");
    file.variable("label", NC_CHAR, {y, letters});
    file.variable("hyam", NC_DOUBLE, {z}, {1, 2, 3});
    file.variable("spread", NC_FLOAT, {members, z, y, x}, counting(108));
    file.variable("empty", NC_FLOAT, {none, y, x});
    int group = 0;
    ASSERT_EQ(nc_def_grp(file.id(), "inner", &group), NC_NOERR);
  }
  auto source = open_file(folder / "many.nc");
  ASSERT_TRUE(source) << source.error().message;
  const DatasetInfo& info = (*source)->info();
  ASSERT_EQ(info.fields.size(), 4U);
  EXPECT_EQ(info.fields[0].name, "cloud");
  EXPECT_EQ(info.fields[1].name, "orography");
  EXPECT_EQ(info.fields[2].name, "spread");  // its first member
  EXPECT_TRUE(info.fields[3].derived);       // standard_height
  std::map<std::string, std::string> reasons;
  for (const LeftOut& left : info.left_out) {
    reasons[left.name] = left.reason;
  }
  EXPECT_EQ(reasons["ps"], "on another grid (lat 3, lon 4)");
  EXPECT_EQ(reasons["moisture"], "on another grid (depth 2, lat 3, lon 4)");
  EXPECT_EQ(reasons["lat_bnds"], "bounds of a coordinate");
  EXPECT_EQ(reasons.count("lat"), 0U) << "the fields have coordinates";
  EXPECT_EQ(reasons["label"], "text, not numbers");
  EXPECT_EQ(reasons["hyam"], "fewer than two spatial dimensions");
  EXPECT_EQ(reasons.count("spread"), 0U);
  EXPECT_EQ(reasons["empty"], "its dimension 'obs' has length 0");
  EXPECT_EQ(reasons["/inner"], "group: to open it, append '#' and its name to the file's");
  EXPECT_EQ(reasons.count("cloud"), 0U);
  // Fields that do not depend on time are equal at all steps.
  auto first = (*source)->read(1, 0);
  auto second = (*source)->read(1, 1);
  ASSERT_TRUE(first);
  ASSERT_TRUE(second);
  EXPECT_EQ(first->values, second->values);
}

// UVEL and VVEL of POP, uvel and vvel of CICE: vvel is also a usual name of vertical velocities.
TEST(HorizontalVelocities, VvelIsNotItsOwnVerticalComponent) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "ice.nc");
    const int y = file.axis("y", {0, 1, 2}, "m");
    const int x = file.axis("x", {0, 1}, "m");
    for (const char* name : {"uvel", "vvel"}) {
      file.text(file.variable(name, NC_FLOAT, {y, x}, counting(6)), "units", "m s-1");
    }
  }
  const auto source = opened(folder / "ice.nc");
  ASSERT_NE(source, nullptr);
  const FieldInfo* wind = source->info().find("wind");
  ASSERT_NE(wind, nullptr);
  EXPECT_EQ(wind->components, (std::vector<std::string>{"uvel", "vvel"}));
}

}  // namespace
}  // namespace windsplat::data::test
