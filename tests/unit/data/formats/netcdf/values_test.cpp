// Values of generated files: packing, masks, types, formats, blocks larger than a read.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>

#include "server/data/model/volume.hpp"
#include "server/data/open/open.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// A file with one row of values in a variable "f", whose attributes `describe` sets.
template <class Describe>
Volume read_row(nc_type type, const std::vector<double>& values, const Describe& describe,
                std::string* dtype = nullptr, int mode = NC_NETCDF4) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "row.nc", mode);
    const int y = file.axis("y", {0}, "m");
    const int x = file.axis("x", counting(values.size()), "m");
    describe(file, file.variable("f", type, {y, x}, values));
  }
  auto source = open_file(folder / "row.nc");
  EXPECT_TRUE(source) << source.error().message;
  if (!source) {
    return {};
  }
  if (dtype != nullptr) {
    *dtype = (*source)->info().fields.at(0).dtype;
  }
  auto volume = (*source)->read(0, 0);
  EXPECT_TRUE(volume) << volume.error().message;
  return volume ? std::move(*volume) : Volume();
}

void expect_values(const Volume& volume, const std::vector<double>& expected) {
  ASSERT_EQ(volume.values.size(), expected.size());
  std::int64_t masked = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    if (std::isnan(expected[i])) {
      EXPECT_TRUE(std::isnan(volume.values[i])) << i << ": " << volume.values[i];
      ++masked;
    } else {
      EXPECT_EQ(volume.values[i], static_cast<float>(expected[i])) << i;
    }
  }
  EXPECT_EQ(volume.masked, masked);
}

TEST(NetcdfValues, PackedShortsAreUnpackedAndTheirFillIsMasked) {
  std::string dtype;
  const Volume volume = read_row(
      NC_SHORT, {-32768, 0, 100, -32767, 32767},
      [](NetcdfMaker& file, int f) {
        file.number(f, "scale_factor", NC_DOUBLE, {0.5});
        file.number(f, "add_offset", NC_DOUBLE, {273});
        file.number(f, "_FillValue", NC_SHORT, {-32768});
        file.number(f, "missing_value", NC_SHORT, {-32767});
      },
      &dtype);
  expect_values(volume, {kNan, 273, 323, kNan, 16656.5});
  EXPECT_EQ(dtype, "int16 packed");
  EXPECT_EQ(volume.range, (std::array<float, 2>{273, 16656.5}));
}

TEST(NetcdfValues, ValidRangeIsInStoredNumbers) {
  // Packed by CF: 0..100 bounds the stored shorts, which unpack to 0..10.
  const Volume packed = read_row(NC_SHORT, {-1, 0, 50, 100, 101}, [](NetcdfMaker& file, int f) {
    file.number(f, "scale_factor", NC_FLOAT, {0.1});
    file.number(f, "valid_range", NC_SHORT, {0, 100});
  });
  const auto tenth = static_cast<double>(0.1F);
  expect_values(packed, {kNan, 0, 50 * tenth, 100 * tenth, kNan});
  // Fractional limits of packed integers can only refer to unpacked values.
  const Volume unpacked = read_row(NC_SHORT, {-1, 0, 50, 100, 101}, [](NetcdfMaker& file, int f) {
    file.number(f, "scale_factor", NC_DOUBLE, {0.5});
    file.number(f, "valid_range", NC_DOUBLE, {0, 25});
  });
  expect_values(unpacked, {kNan, 0, 25, kNan, kNan});
  const Volume one_sided = read_row(NC_DOUBLE, {-2, -1, 5}, [](NetcdfMaker& file, int f) {
    file.number(f, "valid_min", NC_DOUBLE, {-1});
  });
  expect_values(one_sided, {kNan, -1, 5});
  const Volume other_side = read_row(NC_FLOAT, {-2, 0.3F, 0.4F}, [](NetcdfMaker& file, int f) {
    file.number(f, "valid_max", NC_DOUBLE, {0.3});  // wider than the type of the packed data
  });
  expect_values(other_side, {-2, 0.3F, kNan});
}

TEST(NetcdfValues, TheValidRangeIsReported) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "v.nc");
    const int y = file.axis("y", {0, 1}, "m");
    const int x = file.axis("x", {0, 1}, "m");
    const auto add = [&](const char* name, nc_type type) {
      return file.variable(name, type, {y, x}, {5, 6, 7, 8});
    };
    add("all", NC_FLOAT);
    const int packed = add("packed", NC_SHORT);
    file.number(packed, "scale_factor", NC_DOUBLE, {-0.5});
    file.number(packed, "add_offset", NC_DOUBLE, {10});
    file.number(packed, "valid_range", NC_SHORT, {0, 100});
    file.number(add("low", NC_FLOAT), "valid_min", NC_FLOAT, {0.3});
    file.number(add("high", NC_FLOAT), "valid_max", NC_FLOAT, {7.5});
  }
  auto source = open_file(folder / "v.nc");
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->info().notes,
            (std::vector<std::string>{
                "values outside the valid range of the file are masked: 'packed' (-40 to "
                "10), 'low' (from 0.3), 'high' (up to 7.5)"}));
}

TEST(NetcdfValues, FillMissingNanAndInfinityAreMasked) {
  const auto describe = [](NetcdfMaker& file, int f) {
    file.number(f, "missing_value", NC_DOUBLE, {-1e10, 1e30});  // wider than the type of a float
                                                                // variable
  };
  expect_values(read_row(NC_FLOAT, {1, NC_FILL_FLOAT, kNan, -1e10, 1e30, 2}, describe),
                {1, kNan, kNan, kNan, kNan, 2});
  expect_values(read_row(NC_DOUBLE, {1, INFINITY, -INFINITY, -1e10, 2}, describe),
                {1, kNan, kNan, kNan, 2});
  expect_values(
      read_row(NC_FLOAT, {1, -999, NC_FILL_FLOAT},
               [](NetcdfMaker& file, int f) { file.number(f, "_FillValue", NC_FLOAT, {-999}); }),
      {1, kNan, static_cast<double>(NC_FILL_FLOAT)});
}

TEST(NetcdfValues, UnwrittenSamplesAreMasked) {
  for (const nc_type type : {NC_SHORT, NC_INT, NC_FLOAT, NC_DOUBLE}) {
    const Folder folder;
    {
      NetcdfMaker file(folder / "u.nc", 0);
      const int y = file.axis("y", {0, 1}, "m");
      const int x = file.axis("x", {0, 1}, "m");
      file.variable("f", type, {y, x}, {5, 6});  // the second row is never written
    }
    auto source = open_file(folder / "u.nc");
    ASSERT_TRUE(source) << source.error().message;
    auto volume = (*source)->read(0, 0);
    ASSERT_TRUE(volume);
    expect_values(*volume, {5, 6, kNan, kNan});
  }
}

TEST(NetcdfValues, DoublesBeyondFloatAreMaskedAndTinyOnesKept) {
  const auto plain = [](NetcdfMaker&, int) {};
  expect_values(read_row(NC_DOUBLE, {1e39, -1e300, 3.4e38, 1e-40, -0.0}, plain),
                {kNan, kNan, 3.4e38, 1e-40, 0});
  const Volume zero = read_row(NC_FLOAT, {-0.0}, plain);
  EXPECT_TRUE(std::signbit(zero.values[0]));
}

TEST(NetcdfValues, EveryNumberType) {
  struct Case {
    nc_type type;
    const char* name;
    double low;
    double high;
  };
  const std::vector<Case> cases{{NC_BYTE, "int8", -128, 127},
                                {NC_UBYTE, "uint8", 0, 255},
                                {NC_SHORT, "int16", -32768, 32767},
                                {NC_USHORT, "uint16", 0, 65534},
                                {NC_INT, "int32", -2147483648.0, 16777216},
                                {NC_UINT, "uint32", 0, 4294967040.0},
                                {NC_INT64, "int64", -9007199254740992.0, 1099511627776.0},
                                {NC_UINT64, "uint64", 0, 1099511627776.0},
                                {NC_FLOAT, "float32", -1e30F, 1e30F},
                                {NC_DOUBLE, "float64", -1e30, 1e30}};
  for (const Case& number : cases) {
    std::string dtype;
    const Volume volume = read_row(
        number.type, {number.low, number.high}, [](NetcdfMaker&, int) {}, &dtype);
    expect_values(volume, {number.low, number.high});
    EXPECT_EQ(dtype, number.name);
  }
}

TEST(NetcdfValues, SignedBytesMarkedUnsigned) {
  const Volume volume = read_row(NC_BYTE, {0, 127, -128, -1}, [](NetcdfMaker& file, int f) {
    file.text(f, "_Unsigned", "true");
    file.number(f, "_FillValue", NC_BYTE, {-1});
    file.number(f, "scale_factor", NC_DOUBLE, {2});
  });
  expect_values(volume, {0, 254, 256, kNan});
}

// Stored -1 is 65535, and limits are stored in the same way.
TEST(NetcdfValues, SignedShortsMarkedUnsigned) {
  const std::vector<double> stored{0, 1, 32767, -32768, -3, -2, -1};
  const auto described = [&](double low, double high) {
    return read_row(NC_SHORT, stored, [=](NetcdfMaker& file, int f) {
      file.text(f, "_Unsigned", "true");
      file.number(f, "_FillValue", NC_SHORT, {-1});
      file.number(f, "valid_range", NC_SHORT, {low, high});
    });
  };
  expect_values(described(1, -3), {kNan, 1, 32767, 32768, 65533, kNan, kNan});
  expect_values(described(-32768, -2), {kNan, kNan, kNan, 32768, 65533, 65534, kNan});
}

TEST(NetcdfValues, EveryFormatHoldsTheSameValues) {
  struct Case {
    int mode;
    const char* format;
    std::string magic;
  };
  const std::vector<Case> cases{{0, "netCDF classic", std::string("CDF\x01", 4)},
                                {NC_64BIT_OFFSET, "netCDF classic", std::string("CDF\x02", 4)},
                                {NC_64BIT_DATA, "netCDF classic", std::string("CDF\x05", 4)},
                                {NC_NETCDF4 | NC_CLASSIC_MODEL, "netCDF-4", "\x89HDF"},
                                {NC_NETCDF4, "netCDF-4", "\x89HDF"}};
  for (const Case& format : cases) {
    const Folder folder;
    const std::string path = folder / "whatever.bin";  // the content decides, not the name
    {
      NetcdfMaker file(path, format.mode);
      const int t = file.dimension("time", NC_UNLIMITED);
      file.text(file.variable("time", NC_INT, {t}, {0, 1}), "units", "days since 2001-01-01");
      const int y = file.axis("lat", {0, 1, 2}, "degrees_north");
      const int x = file.axis("lon", {0, 1, 2, 3, 4}, "degrees_east");
      file.variable("f", NC_SHORT, {t, y, x}, counting(30));
      file.variable("g", NC_DOUBLE, {t, y, x}, counting(30, 100));
    }
    ASSERT_EQ(bytes_of(path).substr(0, 4), format.magic);
    auto source = open_file(path);
    ASSERT_TRUE(source) << source.error().message;
    EXPECT_EQ((*source)->info().format, format.format);
    EXPECT_EQ((*source)->info().id, "whatever");
    ASSERT_EQ((*source)->info().steps.size(), 2U);
    auto volume = (*source)->read(0, 1);
    ASSERT_TRUE(volume);
    expect_values(*volume, counting(15, 15));
    volume = (*source)->read(1, 0);
    ASSERT_TRUE(volume);
    expect_values(*volume, counting(15, 100));
  }
}

// Without chunks a read is smaller: 13 x 150 x 200 doubles take several, split between levels. With
// chunks, the library's cache for a field is released between reads, and the field is read
// repeatedly.
TEST(NetcdfValues, BlocksAndStepsReadAgainAreTheSame) {
  const Folder folder;
  const std::array<std::size_t, 4> lengths{2, 13, 150, 200};
  const std::size_t samples = lengths[1] * lengths[2] * lengths[3];
  for (const std::vector<std::size_t>& chunk :
       {std::vector<std::size_t>{}, {1, 5, 60, 200}, {2, 13, 50, 50}}) {
    const auto path = folder / ("again" + std::to_string(chunk.empty() ? 0 : chunk[0]) + ".nc");
    {
      NetcdfMaker file(path);
      const int t = file.axis("time", counting(lengths[0]), "hours since 2000-01-01");
      const int z = file.axis("lev", counting(lengths[1], 1), "m");
      const int y = file.axis("lat", counting(lengths[2], -75), "degrees_north");
      const int x = file.axis("lon", counting(lengths[3]), "degrees_east");
      const int f = file.variable("f", NC_INT, {t, z, y, x}, counting(2 * samples));
      if (!chunk.empty()) {
        file.chunk(f, chunk);
        file.deflate(f);
      }
    }
    auto source = open_file(path);
    ASSERT_TRUE(source) << source.error().message;
    for (const std::size_t step : {0U, 1U, 0U, 0U}) {
      const auto volume = (*source)->read(0, step);
      ASSERT_TRUE(volume) << volume.error().message;
      expect_values(*volume, counting(samples, static_cast<double>(step * samples)));
    }
  }
}

TEST(NetcdfValues, VolumeReadInManyBlocksIsComplete) {
  // 40 x 300 x 500 doubles take more than one read; chunks do not divide the levels.
  const Folder folder;
  const std::array<std::size_t, 3> lengths{40, 300, 500};
  {
    NetcdfMaker file(folder / "big.nc");
    const int z = file.axis("lev", counting(lengths[0], 1), "hPa");
    const int y = file.axis("lat", counting(lengths[1], -75), "degrees_north");
    const int x = file.axis("lon", counting(lengths[2]), "degrees_east");
    const int f =
        file.variable("f", NC_INT, {z, y, x}, counting(lengths[0] * lengths[1] * lengths[2]));
    file.chunk(f, {7, 100, 500});
    file.deflate(f);
  }
  auto source = open_file(folder / "big.nc");
  ASSERT_TRUE(source) << source.error().message;
  auto volume = (*source)->read(0, 0);
  ASSERT_TRUE(volume) << volume.error().message;
  // Pressure rises with the index in the file, so the last level of the file is the first of the
  // volume.
  std::size_t i = 0;
  for (std::size_t z = 0; z < lengths[0]; ++z) {
    const std::size_t level = (lengths[0] - 1 - z) * lengths[1] * lengths[2];
    for (std::size_t n = 0; n < lengths[1] * lengths[2]; ++n, ++i) {
      ASSERT_EQ(volume->values[i], static_cast<float>(level + n)) << i;
    }
  }
}

}  // namespace
}  // namespace windsplat::data::test
