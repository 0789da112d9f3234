// Groups of netCDF-4 and plain HDF5 files: selected by name, or the first one that has a field.
#include <gtest/gtest.h>
#include <hdf5.h>

#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "server/data/files/files.hpp"
#include "server/data/formats/netcdf/file.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/data/model/volume.hpp"
#include "server/data/open/open.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

int group_in(int parent, const char* name) {
  int group = -1;
  EXPECT_EQ(nc_def_grp(parent, name, &group), NC_NOERR);
  return group;
}

void put(int group, const char* name, const std::vector<int>& dims,
         const std::vector<float>& values) {
  int variable = -1;
  ASSERT_EQ(
      nc_def_var(group, name, NC_FLOAT, static_cast<int>(dims.size()), dims.data(), &variable),
      NC_NOERR);
  ASSERT_EQ(nc_put_att_text(group, variable, "units", 1, "K"), NC_NOERR);
  ASSERT_EQ(nc_put_var_float(group, variable, values.data()), NC_NOERR);
}

// Axes in the root; fields in /a/deep (2 x 3, from 100) and /b (3 x 2 with its own axes, from 200).
void write_groups(const std::string& path, bool root_field) {
  NetcdfMaker file(path);
  const int y = file.axis("lat", {10, 0}, "degrees_north");
  const int x = file.axis("lon", {0, 5, 10}, "degrees_east");
  if (root_field) put(file.id(), "r", {y, x}, {1, 2, 3, 4, 5, 6});
  const int deep = group_in(group_in(file.id(), "a"), "deep");
  put(deep, "f", {y, x}, {100, 101, 102, 103, 104, 105});
  const int b = group_in(file.id(), "b");
  int rows = -1;
  int columns = -1;
  ASSERT_EQ(nc_def_dim(b, "y", 3, &rows), NC_NOERR);
  ASSERT_EQ(nc_def_dim(b, "x", 2, &columns), NC_NOERR);
  put(b, "g", {rows, columns}, {200, 201, 202, 203, 204, 205});
}

TEST(Groups, GroupIsNamedAfterTheFile) {
  const Folder folder;
  write_groups(folder / "g.nc", true);
  for (const char* name : {"g.nc#/a/deep", "g.nc#/a/deep/"}) {
    auto source = open_file(folder / name);
    ASSERT_TRUE(source) << source.error().message;
    const DatasetInfo& info = (*source)->info();
    EXPECT_EQ(info.find("r"), nullptr);  // a field of the root is not in the group
    // The axes are those of the root; latitude is reversed to run north.
    EXPECT_EQ(info.grid.axes[0].coordinates, (std::vector<double>{0, 5, 10}));
    EXPECT_EQ(info.grid.axes[1].coordinates, (std::vector<double>{0, 10}));
    EXPECT_EQ(volume_of(**source, "f").values[0], 103);
    EXPECT_EQ(info.find("f")->units, "K");
  }
  auto root = open_file(folder / "g.nc");
  ASSERT_TRUE(root) << root.error().message;
  EXPECT_NE((*root)->info().find("r"), nullptr);
  EXPECT_NE(reason_of((*root)->info(), "/a/deep"), "");
  auto group = open_file(folder / "g.nc#/b");
  ASSERT_TRUE(group) << group.error().message;
  EXPECT_EQ(volume_of(**group, "g").dims, (std::array<int, 3>{2, 3, 1}));
  EXPECT_NE((*root)->info().digest, (*group)->info().digest);
  auto absent = open_file(folder / "g.nc#/c");
  ASSERT_FALSE(absent);
  EXPECT_EQ(absent.error().kind, ErrorKind::not_found);
  EXPECT_NE(absent.error().message.find("has no group '/c', but '/a', '/b', '/a/deep'"),
            std::string::npos)
      << absent.error().message;
  auto nowhere = open_file(folder / "none.nc#/b");
  ASSERT_FALSE(nowhere);
  EXPECT_EQ(nowhere.error().kind, ErrorKind::not_found);
}

TEST(Groups, WithoutARootFieldTheFirstGroupByBreadthIsUsed) {
  const Folder folder;
  write_groups(folder / "g.nc", false);
  auto source = open_file(folder / "g.nc");
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ(volume_of(**source, "g").values[0], 200);  // /b comes before /a/deep
  EXPECT_TRUE(has_note((*source)->info(), "the group '/b' is shown"));
}

// Rows run north-east in the root, which also has a surface pressure and a field; winds and levels
// are in a group.
TEST(Groups, PositionsAndSurfacePressureOfParentGroupsApply) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "g.nc");
    const int z = file.dimension("lev", 2);
    const int y = file.dimension("j", 2);
    const int x = file.dimension("i", 3);
    const int lev = file.variable("lev", NC_DOUBLE, {z}, {1, 2});
    file.text(lev, "formula_terms", "ap: A b: B ps: pressure_below");
    file.variable("A", NC_DOUBLE, {z}, {0, 0});
    file.text(file.variable_id("A"), "units", "Pa");
    file.variable("B", NC_DOUBLE, {z}, {1, 0.5});
    const int lat = file.variable("lat", NC_DOUBLE, {y, x}, {0, 1, 2, 1, 2, 3});
    file.text(lat, "units", "degrees_north");
    const int lon = file.variable("lon", NC_DOUBLE, {y, x}, {10, 11, 12, 9, 10, 11});
    file.text(lon, "units", "degrees_east");
    const int ps = file.variable("pressure_below", NC_FLOAT, {y, x}, std::vector<double>(6, 9e4));
    file.text(ps, "units", "Pa");
    file.text(ps, "standard_name", "surface_air_pressure");
    put(file.id(), "other", {z, y, x}, std::vector<float>(12, 7));
    const int met = group_in(file.id(), "met");
    int variable = -1;
    for (const char* name : {"eastward_wind", "northward_wind"}) {
      const char own[2] = {*name == 'e' ? 'u' : 'v', 0};
      const std::array<int, 3> dims{z, y, x};
      ASSERT_EQ(nc_def_var(met, own, NC_FLOAT, 3, dims.data(), &variable), NC_NOERR);
      ASSERT_EQ(nc_put_att_text(met, variable, "standard_name", *name == 'e' ? 13 : 14, name),
                NC_NOERR);
      ASSERT_EQ(nc_put_att_text(met, variable, "units", 5, "m s-1"), NC_NOERR);
      const std::vector<float> values(12, *name == 'e' ? 10.0F : 0.0F);
      ASSERT_EQ(nc_put_var_float(met, variable, values.data()), NC_NOERR);
    }
  }
  auto source = open_file(folder / "g.nc#/met");
  ASSERT_TRUE(source) << source.error().message;
  const DatasetInfo& info = (*source)->info();
  ASSERT_NE(info.grid.columns, nullptr);
  EXPECT_TRUE(has_note(info, "'wind' has components along east and north: rotated"));
  // Rows run north-east, so that half of a wind from due west is along the rows and half against
  // the columns.
  const Volume wind = volume_of(**source, "wind");
  EXPECT_NEAR(wind.component(0)[1], 10 * std::sqrt(0.5), 0.05);
  EXPECT_NEAR(wind.component(1)[1], -10 * std::sqrt(0.5), 0.05);
  EXPECT_EQ(info.grid.axes[2].kind, AxisKind::pressure);
  EXPECT_EQ(info.grid.axes[2].coordinates, (std::vector<double>{90000, 45000}));
  EXPECT_EQ(info.find("other"), nullptr);
}

TEST(Groups, FilesOfASeriesMayBeGroups) {
  const Folder folder;
  write_groups(folder / "g1.nc", true);
  write_groups(folder / "g2.nc", true);
  auto source = open_file(folder / "g*.nc#/a/deep");
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->info().steps.size(), 2U);
  EXPECT_EQ(volume_of(**source, "f", 1).values[0], 103);
}

TEST(Groups, FileWhoseNameContainsTheSeparatorIsThatFile) {
  const Folder folder;
  std::filesystem::create_directory(folder / "odd#");
  write_groups(folder / "odd#/g.nc", true);
  auto source = open_file(folder / "odd#/g.nc");
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ(volume_of(**source, "r").values[0], 4);
}

TEST(Groups, FormatsWithoutGroupsRefuseAGroupName) {
  const Folder folder;
  write_bytes(folder / "v.vtk",
              "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 2 1\n"
              "ORIGIN 0 0 0\nSPACING 1 1 1\nPOINT_DATA 4\nSCALARS s float 1\n"
              "LOOKUP_TABLE default\n1 2 3 4\n");
  write_bytes(folder / "n.nrrd",
              "NRRD0004\ntype: uint8\ndimension: 2\nsizes: 2 2\nencoding: raw\n\nabcd");
  for (const char* name : {"v.vtk", "n.nrrd"}) {
    EXPECT_TRUE(open_file(folder / name)) << name;
    const auto source = open_file(folder / (std::string(name) + "#/b"));
    ASSERT_FALSE(source) << name;
    EXPECT_EQ(source.error().kind, ErrorKind::not_found);
    EXPECT_NE(source.error().message.find("without groups: '#/b'"), std::string::npos);
  }
}

// As written by h5py or a simulation: no netCDF conventions, no dimension scales.
TEST(Groups, PlainHdf5) {
  const Folder folder;
  {
    const netcdf::LibraryLock lock;
    const hid_t file =
        H5Fcreate((folder / "p.h5").c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    const hid_t run = H5Gcreate2(file, "run", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    const hid_t step = H5Gcreate2(run, "step_1", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    const std::array<hsize_t, 3> dims{2, 3, 4};
    const hid_t space = H5Screate_simple(3, dims.data(), nullptr);
    std::vector<float> values;
    for (int i = 0; i < 24; ++i) values.push_back(static_cast<float>(i) + 0.5F);
    for (const char* name : {"Bx", "By", "Bz"}) {
      const hid_t set =
          H5Dcreate2(step, name, H5T_NATIVE_FLOAT, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
      EXPECT_GE(H5Dwrite(set, H5T_NATIVE_FLOAT, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
      H5Dclose(set);
      for (float& value : values) value += 100;
    }
    H5Sclose(space);
    H5Gclose(step);
    H5Gclose(run);
    H5Fclose(file);
  }
  for (const char* name : {"p.h5", "p.h5#/run/step_1"}) {
    auto source = open_file(folder / name);
    ASSERT_TRUE(source) << source.error().message;
    const FieldInfo* vector = (*source)->info().first(FieldKind::vector);
    ASSERT_NE(vector, nullptr);
    EXPECT_EQ(vector->components, (std::vector<std::string>{"Bx", "By", "Bz"}));
    const Volume field = volume_of(**source, vector->name);
    EXPECT_EQ(field.dims, (std::array<int, 3>{4, 3, 2}));
    EXPECT_EQ(field.component(0)[23], 23.5F);
    EXPECT_EQ(field.component(2)[1], 201.5F);
  }
}

// Arrays [x][y][z] or [x][y][z][t] without metadata. The value has the digits component, x, y, z,
// t.
void write_like_meep(const std::string& path, const std::vector<const char*>& names,
                     const std::vector<hsize_t>& dims) {
  const netcdf::LibraryLock lock;
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  std::vector<hsize_t> most = dims;
  const hid_t layout = H5Pcreate(H5P_DATASET_CREATE);
  if (dims.size() == 4) {
    most.back() = H5S_UNLIMITED;
    EXPECT_GE(H5Pset_chunk(layout, 4, dims.data()), 0);
  }
  const hid_t space = H5Screate_simple(static_cast<int>(dims.size()), dims.data(), most.data());
  for (std::size_t c = 0; c < names.size(); ++c) {
    std::vector<double> values(1, static_cast<double>(c));
    for (const hsize_t length : dims) {
      std::vector<double> longer;
      for (const double value : values) {
        for (hsize_t i = 0; i < length; ++i) longer.push_back(value * 10 + static_cast<double>(i));
      }
      values = std::move(longer);
    }
    const hid_t set =
        H5Dcreate2(file, names[c], H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, layout, H5P_DEFAULT);
    EXPECT_GE(H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
    H5Dclose(set);
  }
  H5Sclose(space);
  H5Pclose(layout);
  H5Fclose(file);
}

TEST(Groups, MeepArraysVaryFastestAlongX) {
  const Folder folder;
  write_like_meep(folder / "e.h5", {"ex", "ey", "ez"}, {2, 3, 4});
  auto source = open_file(folder / "e.h5");
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_TRUE(has_note((*source)->info(), "meep"));
  Volume field = volume_of(**source, "e");
  ASSERT_EQ(field.dims, (std::array<int, 3>{2, 3, 4}));
  EXPECT_EQ(field.component(0)[1], 100);                     // x fastest in the volume
  EXPECT_EQ(field.component(1)[1 + 2 * (2 + 3 * 3)], 1123);  // x 1, y 2, z 3
  write_like_meep(folder / "t.h5", {"hx", "hy", "hz"}, {2, 3, 4, 5});
  source = open_file(folder / "t.h5");
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->info().steps.size(), 5U);
  field = volume_of(**source, "h", 4);
  ASSERT_EQ(field.dims, (std::array<int, 3>{2, 3, 4}));
  EXPECT_EQ(field.component(2)[1 + 2 * (2 + 3 * 3)], 21234);
  // One unknown name: the axis order is unknown, and the last index is x as elsewhere.
  write_like_meep(folder / "o.h5", {"ex", "ey", "ez", "rho"}, {2, 3, 4});
  source = open_file(folder / "o.h5");
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_FALSE(has_note((*source)->info(), "meep"));
  EXPECT_EQ(volume_of(**source, "e").dims, (std::array<int, 3>{4, 3, 2}));
}

// Arrays of plain HDF5 that hold 0, 1, 2, ...
void write_bare(const std::string& path,
                const std::vector<std::pair<const char*, std::vector<hsize_t>>>& arrays) {
  const netcdf::LibraryLock lock;
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  for (const auto& [name, dims] : arrays) {
    std::size_t count = 1;
    for (const hsize_t length : dims) count *= length;
    const std::vector<double> values = counting(count);
    const hid_t space = H5Screate_simple(static_cast<int>(dims.size()), dims.data(), nullptr);
    const hid_t set =
        H5Dcreate2(file, name, H5T_NATIVE_FLOAT, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    EXPECT_GE(H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
    H5Dclose(set);
    H5Sclose(space);
  }
  H5Fclose(file);
}

TEST(Groups, FirstOfFourUnnamedDimensionsIsTime) {
  const Folder folder;
  // As many rows as steps: the library treats both as one dimension.
  write_bare(folder / "b.h5", {{"q", {6, 2, 3, 5}}, {"p", {6, 2, 3, 5}}, {"still", {2, 6, 5}}});
  auto source = open_file(folder / "b.h5");
  ASSERT_TRUE(source) << source.error().message;
  const DatasetInfo& info = (*source)->info();
  EXPECT_EQ(info.steps.size(), 6U);
  EXPECT_TRUE(has_note(info, "of 'p' and others with four, the first is interpreted as time"));
  EXPECT_NE(info.find("p"), nullptr);
  const Volume field = volume_of(**source, "q", 4);
  EXPECT_EQ(field.dims, (std::array<int, 3>{5, 3, 2}));
  EXPECT_EQ(field.values[0], 120);
  EXPECT_EQ(field.values[29], 149);
  EXPECT_NE(reason_of(info, "still"), "");
}

TEST(Groups, PossibleComponentsAreNotTreatedAsSteps) {
  const Folder folder;
  write_bare(folder / "c.h5", {{"short", {7}}, {"v", {4, 5, 6, 3}}});
  auto source = open_file(folder / "c.h5");
  ASSERT_FALSE(source);
  EXPECT_NE(source.error().message.find(
                "'v' is of 4 x 5 x 6 x 3, it has more than three spatial dimensions"),
            std::string::npos)
      << source.error().message;
  write_bare(folder / "d.h5", {{"w", {2, 4, 5, 6, 7}}});
  source = open_file(folder / "d.h5");
  ASSERT_FALSE(source);
  EXPECT_NE(source.error().message.find("'w' is of 2 x 4 x 5 x 6 x 7"), std::string::npos);
}

}  // namespace
}  // namespace windsplat::data::test
