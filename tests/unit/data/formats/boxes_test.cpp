// Boxes of fields: those of every kind of file are cuts of the whole.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "server/data/model/box.hpp"
#include "server/data/open/open.hpp"
#include "tests/unit/data/formats/plain_maker.hpp"
#include "tests/unit/data/formats/zarr_maker.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

constexpr std::size_t box_samples = 5 * 4 * 6;

void expect_cut_of(const Volume& part, const Volume& whole, const Box& box) {
  const Volume wanted = cut(whole, box);
  ASSERT_EQ(part.dims, wanted.dims);
  ASSERT_EQ(part.components, wanted.components);
  EXPECT_EQ(part.range, wanted.range);
  EXPECT_EQ(part.masked, wanted.masked);
  ASSERT_EQ(part.bytes(), wanted.bytes());
  EXPECT_EQ(std::memcmp(part.component(0), wanted.component(0), part.bytes()), 0) << key_of(box);
}

// Every box of every field that is read by boxes, of which there have to be `fields`.
void expect_boxes(const std::string& path, std::size_t fields, const std::array<int, 3>& chunk,
                  const std::array<int, 3>& chunk_first = {0, 0, 0}) {
  SCOPED_TRACE(path);
  const auto source = open_file(path);
  ASSERT_TRUE(source) << source.error().message;
  const DatasetInfo& info = (*source)->info();
  const auto n = info.grid.dims();
  std::size_t read = 0;
  for (std::size_t f = 0; f < info.fields.size(); ++f) {
    if (!info.fields[f].is_read_by_boxes()) continue;
    SCOPED_TRACE(info.fields[f].name);
    ++read;
    EXPECT_EQ(info.fields[f].box_chunk, chunk);
    EXPECT_EQ(info.fields[f].box_chunk_first, chunk_first);
    const std::size_t step = info.steps.size() - 1;
    const auto whole = (*source)->read(f, step);
    ASSERT_TRUE(whole) << whole.error().message;
    for (int code = 0; code < n[0] * n[1] * n[2]; ++code) {
      const std::array<int, 3> first{code % n[0], code / n[0] % n[1], code / (n[0] * n[1])};
      for (int k = 1; k <= n[2] - first[2]; ++k) {
        for (int j = 1; j <= n[1] - first[1]; ++j) {
          for (int i = 1; i <= n[0] - first[0]; ++i) {
            const Box box{first, {i, j, k}};
            const auto part = (*source)->read_part(f, step, {box});
            ASSERT_TRUE(part) << part.error().message;
            ASSERT_NO_FATAL_FAILURE(expect_cut_of(*part, *whole, box));
          }
        }
      }
    }
  }
  EXPECT_EQ(read, fields);
}

std::vector<double> some_numbers(std::size_t count) {
  std::vector<double> out(count);
  for (std::size_t i = 0; i < count; ++i) {
    out[i] = std::floor(1000 * std::sin(0.37 * static_cast<double>(i)));
  }
  return out;
}

// Two steps of a wind, whose components are masked in different places, and a packed scalar. Levels
// and latitudes are turned: the file has the top and the north first.
struct BoxedFile {
  int mode = NC_NETCDF4;
  std::vector<std::size_t> chunk = {};  // empty: not chunked
  bool x_last = true;

  void write(const std::string& path) const {
    NetcdfMaker file(path, mode);
    const int t = file.axis("time", {0, 6}, "hours since 2001-01-01");
    const int z = file.axis("lev", {100, 200, 300, 500, 850, 1000}, "hPa");
    const int y = file.axis("lat", {50, 40, 30, 20}, "degrees_north");
    const int x = file.axis("lon", {0, 10, 20, 30, 40}, "degrees_east");
    const std::vector<int> order =
        x_last ? std::vector<int>{t, z, y, x} : std::vector<int>{t, x, z, y};
    for (const char* name : {"u", "v", "T"}) {
      std::vector<double> values = some_numbers(2 * box_samples);
      values[box_samples + static_cast<std::size_t>(*name) % 40] = -999;
      const bool is_packed = *name == 'T';
      const int v = file.variable(name, is_packed ? NC_SHORT : NC_FLOAT, order, values);
      file.number(v, "_FillValue", is_packed ? NC_SHORT : NC_FLOAT, {-999});
      file.text(v, "units", is_packed ? "K" : "m s-1");
      if (is_packed) file.number(v, "scale_factor", NC_DOUBLE, {0.01});
      if (chunk.empty()) continue;
      file.chunk(v, chunk);
      file.deflate(v);
    }
  }
};

TEST(Boxes, OfClassicFilesAreCutsOfTheWhole) {
  const Folder folder;
  for (const int mode : {0, NC_64BIT_DATA}) {
    BoxedFile{mode}.write(folder / "a.nc");
    expect_boxes(folder / "a.nc", 4, {1, 1, 1});  // the vector and its components, too
  }
  BoxedFile{0, {}, false}.write(folder / "a.nc");
  expect_boxes(folder / "a.nc", 4, {1, 1, 1});
}

TEST(Boxes, OfChunkedFilesAreCutsOfTheWhole) {
  const Folder folder;
  BoxedFile{NC_NETCDF4, {1, 4, 3, 2}}.write(folder / "b.nc");
  expect_boxes(folder / "b.nc", 4, {2, 3, 4}, {0, 1, 2});
  BoxedFile{NC_NETCDF4, {2, 2, 4, 3}, false}.write(folder / "c.nc");
  expect_boxes(folder / "c.nc", 4, {2, 3, 4}, {0, 1, 2});
}

TEST(Boxes, OfZarrStoresAreCutsOfTheWhole) {
  const ZarrStore two;
  two.put("f/.zarray",
          R"({"zarr_format":2,"shape":[6,4,5],"chunks":[4,2,3],"dtype":"<f4","compressor":null,)"
          R"("filters":null,"fill_value":"NaN","order":"C"})");
  two.put("f/.zattrs", R"({"_ARRAY_DIMENSIONS":["z","y","x"]})");
  const ZarrStore three("s.zarr", "zarr.json", R"({"zarr_format":3,"node_type":"group"})");
  three.put("f/zarr.json",
            R"({"zarr_format":3,"node_type":"array","shape":[6,4,5],"data_type":"float32",)"
            R"("chunk_grid":{"name":"regular","configuration":{"chunk_shape":[4,2,3]}},)"
            R"("chunk_key_encoding":{"name":"default"},"fill_value":"NaN",)"
            R"("codecs":[{"name":"bytes","configuration":{"endian":"little"}}],)"
            R"("dimension_names":["z","y","x"]})");
  for (int chunk = 0; chunk < 8; ++chunk) {
    if (chunk == 3) continue;  // absent: masked
    const std::string digits[] = {std::to_string(chunk / 4), std::to_string(chunk / 2 % 2),
                                  std::to_string(chunk % 2)};
    std::vector<float> items(24);
    for (std::size_t i = 0; i < items.size(); ++i) {
      items[i] = static_cast<float>(100 * chunk) + static_cast<float>(i);
    }
    two.put("f/" + digits[0] + "." + digits[1] + "." + digits[2], bytes_of_items(items));
    three.put("f/c/" + digits[0] + "/" + digits[1] + "/" + digits[2], bytes_of_items(items));
  }
  expect_boxes(two.path(), 1, {3, 2, 4});
  expect_boxes(three.path(), 1, {3, 2, 4});
}

TEST(Boxes, OfRawFilesAreCutsOfTheWhole) {
  const Folder folder;
  write_file(folder / "a.json",
             R"({"windsplat": "raw", "dims": {"x": 5, "y": 4, "z": 6}, "type": "int16",
                 "endian": "big", "file": "a.raw", "fields": [{"name": "wind",
                 "components": ["u", "v", "w"], "units": "m s-1"}, {"name": "cloud"}]})");
  write_file(folder / "a.raw", packed<std::int16_t>(some_numbers(4 * box_samples), true));
  expect_boxes(folder / "a.json", 5, {1, 1, 1});
}

TEST(Boxes, ThatReachBeyondTheGridAreRefused) {
  const Folder folder;
  BoxedFile{}.write(folder / "a.nc");
  const auto source = open_file(folder / "a.nc");
  ASSERT_TRUE(source) << source.error().message;
  for (std::size_t a = 0; a < 3; ++a) {
    Box box = whole_box((*source)->info().grid.dims());
    ++box.count.at(a);
    const auto part = (*source)->read_part(0, 0, {box});
    ASSERT_FALSE(part);
    EXPECT_EQ(part.error().kind, ErrorKind::invalid);
    EXPECT_EQ(part.error().message, "the box " + key_of(box) + " is beyond the grid");
  }
}

// What is computed from other box_samples is read as a whole, and cut.
TEST(Boxes, OfFieldsThatAreComputedAreCutsOfTheWhole) {
  const Folder folder;
  BoxedFile{}.write(folder / "a.nc");
  const auto source = open_file(folder / "a.nc");
  ASSERT_TRUE(source) << source.error().message;
  const DatasetInfo& info = (*source)->info();
  std::size_t computed = 0;
  for (std::size_t f = 0; f < info.fields.size(); ++f) {
    if (!info.fields[f].derived) continue;
    ++computed;
    EXPECT_FALSE(info.fields[f].is_read_by_boxes()) << info.fields[f].name;
    const auto whole = (*source)->read(f, 0);
    ASSERT_TRUE(whole) << whole.error().message;
    const Box box{{1, 1, 2}, {3, 2, 1}};
    const auto part = (*source)->read_part(f, 0, {box});
    ASSERT_TRUE(part) << part.error().message;
    expect_cut_of(*part, *whole, box);
  }
  EXPECT_GT(computed, 0U);
}

// Rows of the file run north, the grid is curvilinear: components east and north are rotated.
TEST(Boxes, OfRotatedVectorsAreNotReadAlone) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "r.nc");
    const int y = file.dimension("y", 3);
    const int x = file.dimension("x", 4);
    std::vector<double> longitude(12);
    std::vector<double> latitude(12);
    for (std::size_t n = 0; n < 12; ++n) {
      longitude[n] = 10.0 + static_cast<double>(n % 4) - 0.2 * static_cast<double>(n / 4);
      latitude[n] = 50.0 + static_cast<double>(n / 4) + 0.3 * static_cast<double>(n % 4);
    }
    file.text(file.variable("lon", NC_DOUBLE, {y, x}, longitude), "units", "degrees_east");
    file.text(file.variable("lat", NC_DOUBLE, {y, x}, latitude), "units", "degrees_north");
    for (const char* name : {"eastward_wind", "northward_wind"}) {
      const int v = file.variable(name, NC_FLOAT, {y, x}, some_numbers(12));
      file.text(v, "standard_name", name);
      file.text(v, "units", "m s-1");
      file.text(v, "coordinates", "lon lat");
    }
  }
  const auto source = open_file(folder / "r.nc");
  ASSERT_TRUE(source) << source.error().message;
  const FieldInfo* const wind = (*source)->info().first(FieldKind::vector);
  const FieldInfo* const alone = (*source)->info().first(FieldKind::scalar);
  ASSERT_NE(wind, nullptr);
  ASSERT_NE(alone, nullptr);
  EXPECT_FALSE(wind->is_read_by_boxes());
  EXPECT_TRUE(alone->is_read_by_boxes());
}

}  // namespace
}  // namespace windsplat::data::test
