// open_file reads files of write_netcdf bit for bit, and other programs find their CF metadata.
#include "server/data/formats/netcdf/writer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>

#include "server/data/model/dataset_info.hpp"
#include "server/data/model/source.hpp"
#include "server/data/model/volume.hpp"
#include "server/data/open/open.hpp"
#include "server/data/samples/samples.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

// Values including every special float, from a simple formula.
class FakeSource : public Source {
 public:
  explicit FakeSource(DatasetInfo info) : info_(std::move(info)) {}
  [[nodiscard]] const DatasetInfo& info() const override { return info_; }
  Result<Volume> read(std::size_t field, std::size_t step) override {
    if (fails) {
      return make_error(ErrorKind::bad_data, "the source failed");
    }
    Volume volume;
    volume.dims = info_.grid.dims();
    volume.components = static_cast<int>(info_.fields[field].components.size());
    const std::size_t values = volume.samples() * static_cast<std::size_t>(volume.components);
    volume.values = Samples(values);
    for (std::size_t i = 0; i < values; ++i) {
      volume.values[i] =
          std::sin(static_cast<float>(i + 1) * 12.9898F + static_cast<float>(field * 31 + step));
    }
    volume.values[0] = -0.0F;
    volume.values[1] = std::numeric_limits<float>::denorm_min();
    volume.values[2] = std::numeric_limits<float>::quiet_NaN();
    volume.values[3] = std::numeric_limits<float>::max();
    finish_volume(volume);
    return volume;
  }
  bool fails = false;

 private:
  DatasetInfo info_;
};

Axis axis(const std::string& name, AxisKind kind, std::vector<double> coordinates,
          const std::string& units = "") {
  Axis out;
  out.name = name;
  out.kind = kind;
  out.coordinates = std::move(coordinates);
  out.units = units;
  return out;
}

FieldInfo field(const std::string& name, FieldKind kind, std::vector<std::string> components,
                std::vector<std::string> units) {
  FieldInfo out;
  out.name = name;
  out.kind = kind;
  out.components = std::move(components);
  out.units = units[0];
  out.component_units = std::move(units);
  return out;
}

DatasetInfo make_info(std::array<Axis, 3> axes) {
  DatasetInfo info;
  info.title = "A title";
  info.source = "built-in sample";
  info.grid.axes = std::move(axes);
  info.fields = {
      field("wind", FieldKind::vector, {"u", "v", "omega"}, {"m s-1", "m s-1", "Pa s-1"}),
      field("odd name", FieldKind::vector, {"first", "second"}, {"V/m", "V/m"}),
      field("cloud", FieldKind::scalar, {"cloud"}, {"%"})};
  info.fields[2].standard_name = "cloud_area_fraction_in_atmosphere_layer";
  info.fields[2].long_name = "cloudiness";
  info.steps = {{0, ""}, {6, ""}, {12.5, ""}};
  info.time_units = "hours since 2001-02-28 00:00:00";
  info.time_calendar = "noleap";
  return info;
}

void expect_same_bits(Volume& written, Volume& read, const std::string& name) {
  ASSERT_EQ(written.dims, read.dims) << name;
  ASSERT_EQ(written.components, read.components) << name;
  for (std::size_t i = 0; i < written.values.size(); ++i) {
    if (std::isnan(written.values[i])) {
      ASSERT_TRUE(std::isnan(read.values[i])) << name << ' ' << i;
    } else {
      ASSERT_EQ(std::bit_cast<std::uint32_t>(written.values[i]),
                std::bit_cast<std::uint32_t>(read.values[i]))
          << name << ' ' << i;
    }
  }
  EXPECT_EQ(written.range, read.range);
  EXPECT_EQ(written.masked, read.masked);
}

void round_trip(Source& source) {
  const Folder folder;
  auto done = write_netcdf(source, folder / "out.nc");
  ASSERT_TRUE(done) << done.error().message;
  auto back = open_file(folder / "out.nc");
  ASSERT_TRUE(back) << back.error().message;
  const DatasetInfo& before = source.info();
  const DatasetInfo& after = (*back)->info();
  EXPECT_EQ(after.title, before.title);
  EXPECT_EQ(after.format, "netCDF-4");
  for (std::size_t a = 0; a < 3; ++a) {
    EXPECT_EQ(after.grid.axes[a].name, before.grid.axes[a].name);
    EXPECT_EQ(after.grid.axes[a].kind, before.grid.axes[a].kind) << a;
    EXPECT_EQ(after.grid.axes[a].coordinates, before.grid.axes[a].coordinates) << a;
  }
  ASSERT_EQ(after.steps.size(), before.steps.size());
  for (std::size_t f = 0; f < before.fields.size(); ++f) {
    const FieldInfo* found = after.find(before.fields[f].name);
    ASSERT_NE(found, nullptr) << before.fields[f].name;
    EXPECT_EQ(found->kind, before.fields[f].kind);
    EXPECT_EQ(found->components, before.fields[f].components);
    EXPECT_EQ(found->component_units, before.fields[f].component_units);
    EXPECT_EQ(found->long_name.empty(), false);
    for (std::size_t step = 0; step < before.steps.size(); ++step) {
      auto written = source.read(f, step);
      auto read = (*back)->read(static_cast<std::size_t>(found - after.fields.data()), step);
      ASSERT_TRUE(written);
      ASSERT_TRUE(read) << read.error().message;
      expect_same_bits(*written, *read, found->name);
    }
  }
}

TEST(NetcdfWriter, RoundTripOverTheGlobe) {
  FakeSource source(
      make_info({axis("lon", AxisKind::longitude, {0, 90, 180.5, 270}, "degrees_east"),
                 axis("lat", AxisKind::latitude, {-89, 0, 60}, "degrees_north"),
                 axis("plev", AxisKind::pressure, {1000, 500, 20}, "hPa")}));
  round_trip(source);
}

TEST(NetcdfWriter, RoundTripOfEveryKindOfVerticalAxis) {
  for (const auto& [kind, falls] :
       std::vector<std::pair<AxisKind, bool>>{{AxisKind::height, false},
                                              {AxisKind::depth, true},
                                              {AxisKind::level, false},
                                              {AxisKind::level, true},
                                              {AxisKind::pressure, true}}) {
    std::vector<double> up{1, 2.5, 7};
    if (falls) {
      std::reverse(up.begin(), up.end());
    }
    FakeSource source(
        make_info({axis("a", AxisKind::longitude, {0, 90}),
                   axis("b", AxisKind::latitude, {-89, 0, 60}), axis("c", kind, up)}));
    round_trip(source);
  }
}

TEST(NetcdfWriter, RoundTripOfCartesianBoxesAndSingleSamples) {
  FakeSource box(make_info({axis("x", AxisKind::cartesian, {-1, 0, 1}, "m"),
                            axis("y", AxisKind::cartesian, {-1, 1}, "m"),
                            axis("z", AxisKind::cartesian, {0, 0.1, 0.2}, "m")}));
  round_trip(box);
  FakeSource unnamed(
      make_info({axis("p", AxisKind::cartesian, {-1, 0, 1, 5}), axis("q", AxisKind::cartesian, {7}),
                 axis("r", AxisKind::cartesian, {3})}));
  round_trip(unnamed);
  DatasetInfo still =
      make_info({axis("x", AxisKind::cartesian, {0, 1}), axis("y", AxisKind::cartesian, {0, 1}),
                 axis("z", AxisKind::cartesian, {0, 1})});
  still.steps = {{0, "0"}};
  still.time_units.clear();
  FakeSource timeless(still);
  round_trip(timeless);
}

TEST(NetcdfWriter, RoundTripOfTheBuiltInSamples) {
  for (const std::string& name : sample_names()) {
    auto sample = open_sample(name, {12, 10, 7}, 2);
    ASSERT_TRUE(sample) << sample.error().message;
    round_trip(**sample);
  }
}

// A wind of 18 MiB, of whose 24 levels 16 are read at once.
TEST(NetcdfWriter, RoundTripOfFieldsReadByBoxes) {
  auto sample = open_sample("tornado", {256, 256, 24}, 1);
  ASSERT_TRUE(sample) << sample.error().message;
  round_trip(**sample);
}

TEST(NetcdfWriter, StepsKeepTheirDates) {
  FakeSource source(
      make_info({axis("lon", AxisKind::longitude, {0, 90}),
                 axis("lat", AxisKind::latitude, {0, 60}), axis("lev", AxisKind::level, {1, 2})}));
  const Folder folder;
  ASSERT_TRUE(write_netcdf(source, folder / "out.nc"));
  auto back = open_file(folder / "out.nc");
  ASSERT_TRUE(back);
  EXPECT_EQ((*back)->info().steps[2].text, "2001-02-28T12:30:00Z");
  EXPECT_EQ((*back)->info().steps[2].value, 12.5);
  EXPECT_EQ((*back)->info().time_calendar, "noleap");
}

std::string attribute(int ncid, const char* variable, const char* name) {
  int id = NC_GLOBAL;
  if (variable != nullptr) {
    EXPECT_EQ(nc_inq_varid(ncid, variable, &id), NC_NOERR) << variable;
  }
  std::size_t length = 0;
  if (nc_inq_attlen(ncid, id, name, &length) != NC_NOERR) {
    return "(absent)";
  }
  std::string text(length, '\0');
  EXPECT_EQ(nc_get_att_text(ncid, id, name, text.data()), NC_NOERR);
  return text;
}

TEST(NetcdfWriter, FollowsCfConventions) {
  FakeSource source(make_info({axis("lon", AxisKind::longitude, {0, 90}),
                               axis("lat", AxisKind::latitude, {0, 60}),
                               axis("plev", AxisKind::pressure, {1000, 500}, "hPa")}));
  const Folder folder;
  ASSERT_TRUE(write_netcdf(source, folder / "out.nc"));
  int ncid = -1;
  ASSERT_EQ(nc_open((folder / "out.nc").c_str(), NC_NOWRITE, &ncid), NC_NOERR);
  EXPECT_EQ(attribute(ncid, nullptr, "Conventions"), "CF-1.8");
  EXPECT_EQ(attribute(ncid, "lon", "axis"), "X");
  EXPECT_EQ(attribute(ncid, "lon", "standard_name"), "longitude");
  EXPECT_EQ(attribute(ncid, "lon", "units"), "degrees_east");
  EXPECT_EQ(attribute(ncid, "lat", "units"), "degrees_north");
  EXPECT_EQ(attribute(ncid, "plev", "axis"), "Z");
  EXPECT_EQ(attribute(ncid, "plev", "standard_name"), "air_pressure");
  EXPECT_EQ(attribute(ncid, "plev", "positive"), "down");
  EXPECT_EQ(attribute(ncid, "time", "units"), "hours since 2001-02-28 00:00:00");
  EXPECT_EQ(attribute(ncid, "time", "calendar"), "noleap");
  EXPECT_EQ(attribute(ncid, "u", "standard_name"), "eastward_wind");
  EXPECT_EQ(attribute(ncid, "v", "standard_name"), "northward_wind");
  EXPECT_EQ(attribute(ncid, "omega", "standard_name"), "lagrangian_tendency_of_air_pressure");
  EXPECT_EQ(attribute(ncid, "omega", "units"), "Pa s-1");
  EXPECT_EQ(attribute(ncid, "cloud", "long_name"), "cloudiness");
  int u = -1;
  int deflate = 0;
  int level = 0;
  ASSERT_EQ(nc_inq_varid(ncid, "u", &u), NC_NOERR);
  ASSERT_EQ(nc_inq_var_deflate(ncid, u, nullptr, &deflate, &level), NC_NOERR);
  EXPECT_EQ(deflate, 1);
  // The masked sample has the declared fill value.
  float fill = 0;
  float value = 0;
  const std::array<std::size_t, 4> third{0, 0, 1, 0};
  ASSERT_EQ(nc_get_att_float(ncid, u, "_FillValue", &fill), NC_NOERR);
  ASSERT_EQ(nc_get_var1_float(ncid, u, third.data(), &value), NC_NOERR);
  EXPECT_EQ(value, fill);
  nc_close(ncid);
}

TEST(NetcdfWriter, LinkTargetIsWrittenEvenIfMissing) {
  FakeSource source(
      make_info({axis("x", AxisKind::cartesian, {0, 1}), axis("y", AxisKind::cartesian, {0, 1}),
                 axis("z", AxisKind::cartesian, {0, 1})}));
  const Folder folder;
  std::filesystem::create_symlink("target.nc", folder / "link.nc");
  for (int n = 0; n < 2; ++n) {
    ASSERT_TRUE(write_netcdf(source, folder / "link.nc"));
    EXPECT_TRUE(std::filesystem::is_symlink(folder / "link.nc"));
    EXPECT_TRUE(open_file(folder / "target.nc"));
  }
  std::filesystem::create_symlink("loop.nc", folder / "loop.nc");
  EXPECT_FALSE(write_netcdf(source, folder / "loop.nc"));
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "loop.nc"));
}

TEST(NetcdfWriter, FailureKeepsTheOldFileAndLeavesNoPart) {
  FakeSource source(
      make_info({axis("x", AxisKind::cartesian, {0, 1}), axis("y", AxisKind::cartesian, {0, 1}),
                 axis("z", AxisKind::cartesian, {0, 1})}));
  const Folder folder;
  write_bytes(folder / "out.nc", "old");
  source.fails = true;
  auto done = write_netcdf(source, folder / "out.nc");
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().message, "the source failed");
  EXPECT_EQ(bytes_of(folder / "out.nc"), "old");
  EXPECT_FALSE(std::filesystem::exists(folder / "out.nc.part"));
  source.fails = false;
  EXPECT_FALSE(write_netcdf(source, folder / "no/such/folder/out.nc"));
  EXPECT_FALSE(write_netcdf(source, "http://127.0.0.1:9/out.nc"));
  ASSERT_TRUE(write_netcdf(source, folder / "out.nc"));
  EXPECT_TRUE(open_file(folder / "out.nc"));
}

}  // namespace
}  // namespace windsplat::data::test
