// Files for the tests of loaders: a small valid one, and two crafted to make HDF5 read another
// file.
#pragma once

#include <gtest/gtest.h>
#include <hdf5.h>

#include <array>
#include <cstddef>
#include <fstream>
#include <string>
#include <vector>

#include "netcdf_maker.hpp"

namespace windsplat::data::test {

// Two steps of a vector u, v and a scalar T with masked samples, on 4 x 3 x 2 samples.
inline void write_wind(const std::string& path, int mode) {
  NetcdfMaker file(path, mode);
  const int t = file.axis("time", {0, 6}, "hours since 2001-01-01");
  const int z = file.axis("lev", {1000, 500}, "hPa");
  const int y = file.axis("lat", {50, 40, 30}, "degrees_north");
  const int x = file.axis("lon", {0, 10, 20, 30}, "degrees_east");
  std::vector<double> values(48);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<double>(i) - 20.25;
  for (const char* name : {"u", "v", "T"}) {
    const int v = file.variable(name, NC_FLOAT, {t, z, y, x}, values);
    file.number(v, "_FillValue", NC_FLOAT, {-15.25});
    file.text(v, "units", *name == 'T' ? "K" : "m s-1");
    if (mode == NC_NETCDF4) file.deflate(v);
    for (double& value : values) value = value * 0.75 + 1;
  }
}

// A scalar of 5 MiB with different samples.
inline void write_large(const std::string& path) {
  NetcdfMaker file(path, 0);
  const int z = file.dimension("z", 20);
  const int y = file.dimension("y", 256);
  const int x = file.dimension("x", 256);
  std::vector<double> values(std::size_t{20} * 256 * 256);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<double>(i);
  file.variable("density", NC_FLOAT, {z, y, x}, values);
}

// Longitudes and latitudes of a regular grid as two 2-D arrays.
inline void write_positions(const std::string& path, std::size_t side) {
  NetcdfMaker file(path);
  const int y = file.dimension("y", side);
  const int x = file.dimension("x", side);
  for (const char* name : {"lat", "lon"}) {
    const bool is_latitude = std::string(name) == "lat";
    std::vector<double> values(side * side);
    for (std::size_t n = 0; n < values.size(); ++n) {
      values[n] = static_cast<double>(is_latitude ? n / side : n % side) / 64;
    }
    const int v = file.variable(name, NC_DOUBLE, {y, x}, std::move(values));
    file.text(v, "units", is_latitude ? "degrees_north" : "degrees_east");
    file.deflate(v);
    file.chunk(v, {side, side});
  }
  file.text(file.variable("u", NC_FLOAT, {y, x}), "coordinates", "lat lon");
}

inline void write_floats(const std::string& path, std::size_t count, float value) {
  const std::vector<float> values(count, value);
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(values.data()),
             static_cast<std::streamsize>(count * sizeof(float)));
}

// An HDF5 file whose dataset "secret" (4 x 4 x 4 floats) has its values in another file.
inline void write_external_storage(const std::string& path, const std::string& other) {
  const std::array<hsize_t, 3> dims{4, 4, 4};
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hid_t space = H5Screate_simple(3, dims.data(), nullptr);
  const hid_t how = H5Pcreate(H5P_DATASET_CREATE);
  EXPECT_GE(H5Pset_external(how, other.c_str(), 0, 64 * sizeof(float)), 0);
  const hid_t set =
      H5Dcreate2(file, "secret", H5T_IEEE_F32LE, space, H5P_DEFAULT, how, H5P_DEFAULT);
  EXPECT_GE(set, 0);
  H5Dclose(set);
  H5Pclose(how);
  H5Sclose(space);
  EXPECT_GE(H5Fclose(file), 0);
}

// An HDF5 file in which "linked" is a dataset of another file.
inline void write_external_link(const std::string& path, const std::string& other,
                                const std::string& name) {
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  EXPECT_GE(
      H5Lcreate_external(other.c_str(), name.c_str(), file, "linked", H5P_DEFAULT, H5P_DEFAULT), 0);
  EXPECT_GE(H5Fclose(file), 0);
}

}  // namespace windsplat::data::test
