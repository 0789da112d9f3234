// Staggered grids of files without metadata: the dimensions of DALES, UCLA-LES, CM1 and Meso-NH,
// whose velocities are linear, so that their means at the centres of cells are known.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <string>
#include <vector>

#include "server/data/model/dataset_info.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

using Values = std::vector<double>;
using testing::ElementsAre;

constexpr std::size_t nx = 5;
constexpr std::size_t ny = 4;
constexpr std::size_t nz = 3;

Values line(std::size_t count, double first, double step) {
  Values out;
  for (std::size_t i = 0; i < count; ++i) out.push_back(first + step * static_cast<double>(i));
  return out;
}

double linear(double x, double y, double z) { return 0.01 * x - 0.02 * y + 0.1 * z + 3; }

// A dimension and its positions.
struct Along {
  int id = -1;
  Values at;
};

Along along(NetcdfMaker& file, const std::string& name, const Values& values,
            const std::string& units = "m") {
  return {file.axis(name, values, units), values};
}

// The linear field times `factor` on z, y, x, the last one fastest.
int put(NetcdfMaker& file, const std::string& name, double factor, const Along& z, const Along& y,
        const Along& x, const std::string& units = "m/s") {
  Values values;
  for (const double height : z.at) {
    for (const double north : y.at) {
      for (const double east : x.at) values.push_back(factor * linear(east, north, height));
    }
  }
  const int variable = file.variable(name, NC_DOUBLE, {z.id, y.id, x.id}, values);
  if (!units.empty()) file.text(variable, "units", units);
  return variable;
}

// The wind (f, 2 f, 3 f) of the linear field f at the centres, where both neighbours of a component
// exist: not at the end of its axis that has one face.
void expect_linear_wind(Source& source, const Values& x, const Values& y, const Values& z,
                        bool last_face_is_missing) {
  ASSERT_NE(source.info().find("wind"), nullptr);
  EXPECT_EQ(source.info().find("wind")->components.size(), 3U);
  const Volume wind = volume_of(source, "wind");
  const std::size_t samples = x.size() * y.size() * z.size();
  ASSERT_EQ(wind.values.size(), 3 * samples);
  const auto is_inside = [&](std::size_t i, std::size_t n) {
    return last_face_is_missing ? i + 1 < n : i > 0;
  };
  std::size_t compared = 0;
  for (std::size_t n = 0; n < samples; ++n) {
    const std::size_t i = n % x.size();
    const std::size_t j = n / x.size() % y.size();
    const std::size_t k = n / x.size() / y.size();
    const double f = linear(x[i], y[j], z[k]);
    const std::vector<bool> inside{is_inside(i, x.size()), is_inside(j, y.size()),
                                   is_inside(k, z.size())};
    for (std::size_t c = 0; c < 3; ++c) {
      if (!inside[c]) continue;
      EXPECT_NEAR(wind.values[c * samples + n], static_cast<double>(c + 1) * f, 1e-5)
          << c << " at " << n;
      ++compared;
    }
  }
  EXPECT_GT(compared, samples);
}

TEST(BareStaggering, DalesHasItsWindAtTheCentersOfCells) {
  const Folder folder;
  const Values x = line(nx, 25, 50);
  const Values y = line(ny, 25, 50);
  const Values z = line(nz, 20, 40);
  {
    NetcdfMaker file(folder / "fielddump.nc");
    const Along zt = along(file, "zt", z);
    const Along zm = along(file, "zm", line(nz, 0, 40));
    const Along xt = along(file, "xt", x);
    const Along xm = along(file, "xm", line(nx, 0, 50));
    const Along yt = along(file, "yt", y);
    const Along ym = along(file, "ym", line(ny, 0, 50));
    put(file, "u", 1, zt, yt, xm);
    put(file, "v", 2, zt, ym, xt);
    put(file, "w", 3, zm, yt, xt);
    put(file, "thl", 1, zt, yt, xt, "K");
  }
  const auto source = opened(folder / "fielddump.nc");
  EXPECT_EQ(source->info().grid.axes[0].coordinates, x);
  expect_linear_wind(*source, x, y, z, true);
}

// UCLA-LES stores columns, and its faces lie above the centres.
TEST(BareStaggering, DimensionsInTheOrderOfUclaLesAreRecognised) {
  const Folder folder;
  const Values x = line(nx, -225, 50);
  const Values y = line(ny, -225, 50);
  const Values z = line(nz, -20, 40);
  {
    NetcdfMaker file(folder / "les.nc", 0);
    const Along zt = along(file, "zt", z);
    const Along zm = along(file, "zm", line(nz, 0, 40));
    const Along xt = along(file, "xt", x);
    const Along xm = along(file, "xm", line(nx, -200, 50));
    const Along yt = along(file, "yt", y);
    const Along ym = along(file, "ym", line(ny, -200, 50));
    const auto columns = [&](const std::string& name, double factor, const Along& on_y,
                             const Along& on_x, const Along& on_z) {
      Values values;
      for (const double north : on_y.at) {
        for (const double east : on_x.at) {
          for (const double up : on_z.at) values.push_back(factor * linear(east, north, up));
        }
      }
      file.text(file.variable(name, NC_DOUBLE, {on_y.id, on_x.id, on_z.id}, values), "units",
                "m/s");
    };
    columns("u", 1, yt, xm, zt);
    columns("v", 2, ym, xt, zt);
    columns("w", 3, yt, xt, zm);
  }
  const auto source = opened(folder / "les.nc");
  EXPECT_EQ(source->info().grid.axes[2].coordinates, z);
  expect_linear_wind(*source, x, y, z, false);
}

// CM1 until release 19: the dimension ni, its coordinate xh.
TEST(BareStaggering, DimensionsOfCm1AreLocatedByCoordinatesOfOtherNames) {
  const Folder folder;
  const Values x = line(nx, 0.025, 0.05);
  const Values y = line(ny, 0.025, 0.05);
  const Values z = line(nz, 0.02, 0.04);
  {
    NetcdfMaker file(folder / "cm1out.nc");
    const auto on = [&](const std::string& name, const std::string& coordinate,
                        const Values& values) {
      const int id = file.dimension(name, values.size());
      file.text(file.variable(coordinate, NC_DOUBLE, {id}, values), "units", "km");
      return Along{id, values};
    };
    const Along ni = on("ni", "xh", x);
    const Along nip1 = on("nip1", "xf", line(nx + 1, 0, 0.05));
    const Along nj = on("nj", "yh", y);
    const Along njp1 = on("njp1", "yf", line(ny + 1, 0, 0.05));
    const Along nk = on("nk", "z", z);
    const Along nkp1 = on("nkp1", "zf", line(nz + 1, 0, 0.04));
    put(file, "u", 1, nk, nj, nip1);
    put(file, "v", 2, nk, njp1, ni);
    put(file, "w", 3, nkp1, nj, ni);
    put(file, "th", 1, nk, nj, ni, "K");
  }
  const auto source = opened(folder / "cm1out.nc");
  EXPECT_EQ(source->info().grid.axes[0].coordinates, x);
  EXPECT_EQ(source->info().grid.axes[0].units, "km");
  EXPECT_EQ(source->info().grid.axes[2].coordinates, z);
  EXPECT_TRUE(has_note(source->info(), "'xh' is taken as the coordinate of 'ni'"));
  expect_linear_wind(*source, x, y, z, false);
}

// Positions with missing values or in no order.
TEST(BareStaggering, CoordinatesOfOtherNamesMustBeMonotonic) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "turns.nc");
    const int nj = file.dimension("ny", 2);
    const int ni = file.dimension("nx", 3);
    file.variable("y", NC_DOUBLE, {nj}, {1, 5});
    file.variable("x", NC_DOUBLE, {ni}, {1, 3, 2});
    file.variable("t", NC_DOUBLE, {nj, ni}, {1, 2, 3, 4, 5, 6});
  }
  const auto source = opened(folder / "turns.nc");
  EXPECT_THAT(source->info().grid.axes[0].coordinates, ElementsAre(0, 1, 2));
  EXPECT_THAT(source->info().grid.axes[1].coordinates, ElementsAre(1, 5));
  EXPECT_TRUE(has_note(source->info(), "'x' is not monotonic"));
}

// Meso-NH has dimensions of its own for the points of u and v, of which one has the values of the
// centres. bare: without units, so that only the names of velocities tell.
void write_meso_nh(const std::string& path, bool bare) {
  NetcdfMaker file(path);
  const std::string units = bare ? "" : "m";
  const Values x = line(nx, -25, 50);
  const Values y = line(ny, -25, 50);
  const Along ni = along(file, "ni", x, units);
  const Along nj = along(file, "nj", y, units);
  const Along ni_u = along(file, "ni_u", line(nx, -50, 50), units);
  const Along nj_u = along(file, "nj_u", y, units);
  const Along ni_v = along(file, "ni_v", x, units);
  const Along nj_v = along(file, "nj_v", line(ny, -50, 50), units);
  const Along level = along(file, "level", line(nz, -20, 40), units);
  const Along level_w = along(file, "level_w", line(nz, -40, 40), units);
  const std::string speed = bare ? "" : "m s-1";
  put(file, "UT", 1, level, nj_u, ni_u, speed);
  put(file, "VT", 2, level, nj_v, ni_v, speed);
  put(file, "WT", 3, level_w, nj, ni, speed);
  put(file, "THETA", 1, level, nj, ni, "K");
}

TEST(BareStaggering, MesoNhHasItsWindAtTheCentersOfCells) {
  const Folder folder;
  for (const bool bare : {false, true}) {
    write_meso_nh(folder / "meso.nc", bare);
    const auto source = opened(folder / "meso.nc");
    EXPECT_EQ(source->info().grid.axes[1].name, "nj");
    expect_linear_wind(*source, line(nx, -25, 50), line(ny, -25, 50), line(nz, -20, 40), true);
  }
}

// Two variables on levels of equal numbers are not known to lie at one height, nor are scalars on
// two lists of equal positions known to be of one grid.
TEST(BareStaggering, ScalarsOnEqualCoordinatesStayApart) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "two.nc");
    const Along z = along(file, "zt", line(nz, 0, 1));
    const Along y = along(file, "yt", line(ny, 0, 1));
    const Along x = along(file, "xt", line(nx, 0, 1));
    const Along x_other = along(file, "xc", line(nx, 0, 1));
    put(file, "a", 1, z, y, x, "K");
    put(file, "b", 1, z, y, x, "K");
    put(file, "c", 1, z, y, x_other, "K");
  }
  const auto source = opened(folder / "two.nc");
  EXPECT_NE(source->info().find("a"), nullptr);
  EXPECT_EQ(source->info().find("c"), nullptr);
}

// Bins of sizes, tiles of the ground: numbers of another quantity amid those of levels.
TEST(BareStaggering, ScalarsOfAnotherQuantityAreNotFacesOfLevels) {
  const Folder folder;
  for (const bool are_pressures : {true, false}) {
    {
      NetcdfMaker file(folder / "bins.nc");
      const Along z = are_pressures ? along(file, "plev", {100, 200, 300, 400}, "hPa")
                                    : along(file, "lev", {1, 2, 3, 4}, "");
      const Along y = along(file, "yt", line(ny, 25, 50));
      const Along x = along(file, "xt", line(nx, 25, 50));
      const Along bin = are_pressures ? along(file, "bin", {150, 250, 350}, "")
                                      : along(file, "bin", {1.5, 2.5, 3.5}, "");
      put(file, "u", 1, z, y, x);
      put(file, "v", 2, z, y, x);
      put(file, "spectrum", 1, bin, y, x, "m-3");
    }
    const auto source = opened(folder / "bins.nc");
    EXPECT_NE(source->info().find("wind"), nullptr);
    EXPECT_EQ(source->info().find("spectrum"), nullptr) << are_pressures;
  }
}

// xm in km beside xt in m: of equal numbers at different places, and of the same places.
TEST(BareStaggering, CoordinatesAreComparedInOneUnit) {
  const Folder folder;
  const Values x = line(nx, 25, 50);
  const Values y = line(ny, 25, 50);
  const Values z = line(nz, 20, 40);
  for (const bool are_faces : {true, false}) {
    {
      NetcdfMaker file(folder / "units.nc");
      const Along zt = along(file, "zt", z);
      const Along yt = along(file, "yt", y);
      const Along xt = along(file, "xt", x);
      const double to_km = are_faces ? 0.001 : 1;
      Along xm = along(file, "xm", line(nx, 0, 50 * to_km), "km");
      xm.at = line(nx, 0, 50);
      put(file, "u", 1, zt, yt, xm);
      put(file, "v", 2, zt, yt, xt);
      put(file, "thl", 1, zt, yt, xt, "K");
    }
    const auto source = opened(folder / "units.nc");
    ASSERT_EQ(source->info().find("wind") != nullptr, are_faces);
    if (!are_faces) continue;
    const Volume wind = volume_of(*source, "wind");
    EXPECT_NEAR(wind.values[0], linear(x[0], y[0], z[0]), 1e-5);
  }
}

TEST(BareStaggering, NumbersOfSamplesDoNotTellThatGridsAreTheSame) {
  const Folder folder;
  for (const bool are_counted : {true, false}) {
    {
      NetcdfMaker file(folder / "nests.nc");
      const Values x = line(nx, 1, are_counted ? 1 : 50);
      const Along z = along(file, "zt", line(nz, 20, 40));
      const Along y = along(file, "y", line(ny, 25, 50));
      const Along outer = along(file, "x", x, "");
      const Along inner = along(file, "x_2", x, "");
      put(file, "a", 1, z, y, outer, "K");
      put(file, "b", 1, z, y, outer, "K");
      put(file, "u", 1, z, y, inner);
    }
    const auto source = opened(folder / "nests.nc");
    EXPECT_NE(source->info().find("a"), nullptr);
    EXPECT_EQ(source->info().find("u") == nullptr, are_counted);
  }
}

}  // namespace
}  // namespace windsplat::data::test
