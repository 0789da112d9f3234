// Two files with analytic fields, and a file with their differences: a picture of a difference is
// that of the third file.
#pragma once

#include <gtest/gtest.h>
#include <netcdf.h>

#include <array>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace difference_files {

// Temperature and wind at a place (index of x, y, z) and step, exact in float.
using Fields = std::function<std::array<float, 4>(float x, float y, float z, float step)>;

inline std::array<float, 4> first(float x, float y, float z, float step) {
  return {280 + x - step * z, 4 + step * x, 8 - y, z};
}
inline std::array<float, 4> second(float x, float y, float z, float step) {
  return {281 + x - y * z - step, 4 - y, 8 - step * z, 3};
}
inline Fields minus(const Fields& a, const Fields& b) {
  return [a, b](float x, float y, float z, float step) {
    const auto from = a(x, y, z, step);
    const auto other = b(x, y, z, step);
    return std::array{from[0] - other[0], from[1] - other[1], from[2] - other[2],
                      from[3] - other[3]};
  };
}
inline Fields at_step(const Fields& fields, float step) {
  return [fields, step](float x, float y, float z, float) { return fields(x, y, z, step); };
}

// 12 x 8 x 4 samples and 3 steps; `spacing` of z in metres.
inline void write(const std::string& path, const Fields& fields, double spacing = 500,
                  const char* units = "K") {
  constexpr std::array<std::size_t, 4> lengths{3, 4, 8, 12};
  constexpr std::array<const char*, 4> names{"time", "z", "y", "x"};
  constexpr std::array<const char*, 4> variables{"t", "u", "v", "w"};
  constexpr std::array<const char*, 4> standard{"air_temperature", "eastward_wind",
                                                "northward_wind", "upward_air_velocity"};
  int file = 0;
  ASSERT_EQ(nc_create(path.c_str(), NC_CLOBBER, &file), NC_NOERR);
  std::array<int, 4> dims{};
  std::array<int, 4> axes{};
  const auto text = [file](int variable, const char* name, const std::string& value) {
    ASSERT_EQ(nc_put_att_text(file, variable, name, value.size(), value.c_str()), NC_NOERR);
  };
  for (std::size_t d = 0; d < 4; ++d) {
    ASSERT_EQ(nc_def_dim(file, names.at(d), lengths.at(d), &dims.at(d)), NC_NOERR);
    ASSERT_EQ(nc_def_var(file, names.at(d), NC_DOUBLE, 1, &dims.at(d), &axes.at(d)), NC_NOERR);
    text(axes.at(d), "units", d == 0 ? "hours since 2001-01-01" : "m");
  }
  std::array<int, 4> ids{};
  for (std::size_t v = 0; v < 4; ++v) {
    ASSERT_EQ(nc_def_var(file, variables.at(v), NC_FLOAT, 4, dims.data(), &ids.at(v)), NC_NOERR);
    text(ids.at(v), "units", v == 0 ? units : "m s-1");
    text(ids.at(v), "standard_name", standard.at(v));
  }
  ASSERT_EQ(nc_enddef(file), NC_NOERR);
  for (std::size_t d = 0; d < 4; ++d) {
    std::vector<double> at;
    for (std::size_t n = 0; n < lengths.at(d); ++n) {
      at.push_back((d == 0 ? 1 : d == 1 ? spacing : 1000) * static_cast<double>(n));
    }
    ASSERT_EQ(nc_put_var_double(file, axes.at(d), at.data()), NC_NOERR);
  }
  std::array<std::vector<float>, 4> values;
  for (std::size_t n = 0; n < std::size_t{3} * 4 * 8 * 12; ++n) {
    const auto at = fields(static_cast<float>(n % 12), static_cast<float>(n / 12 % 8),
                           static_cast<float>(n / 96 % 4), static_cast<float>(n / 384));
    for (std::size_t v = 0; v < 4; ++v) values.at(v).push_back(at.at(v));
  }
  for (std::size_t v = 0; v < 4; ++v) {
    ASSERT_EQ(nc_put_var_float(file, ids.at(v), values.at(v).data()), NC_NOERR);
  }
  ASSERT_EQ(nc_close(file), NC_NOERR);
}

// A view whose picture follows from the values alone: no range is a default.
inline const std::string explicit_view = R"({
  "image": {"width": 160, "height": 120}, "step": 2,
  "vector": {"length": 0.3, "magnitudeRange": [0, 30], "minMagnitude": 0.5,
             "color": {"by": "magnitude", "range": [0, 30]}},
  "scalars": [{"field": "t", "color": {"map": "coolwarm", "range": [-20, 20]},
               "extinction": [[-20, 5], [0, 0], [20, 5]]}],
  "surfaces": [{"field": "t", "isovalue": 3, "opacity": 0.6}]})";

}  // namespace difference_files
