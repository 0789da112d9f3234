// VTKHDF files, written here with the HDF5 library.
#include <gmock/gmock.h>
#include <hdf5.h>

#include "tests/unit/data/formats/vtk/test_mesh.hpp"

namespace windsplat::data::vtk_test {
namespace {

using testing::HasSubstr;
using Lengths = std::vector<hsize_t>;

// A file under construction; groups are made as needed.
class HdfMaker {
 public:
  explicit HdfMaker(const std::string& path)
      : id_(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT)) {
    links_ = H5Pcreate(H5P_LINK_CREATE);
    H5Pset_create_intermediate_group(links_, 1);
  }
  ~HdfMaker() {
    H5Pclose(links_);
    EXPECT_GE(H5Fclose(id_), 0);
  }
  HdfMaker(const HdfMaker&) = delete;
  HdfMaker& operator=(const HdfMaker&) = delete;

  [[nodiscard]] hid_t id() const { return id_; }

  void group(const std::string& path, const std::string& type, bool variable = false) const {
    const hid_t group = H5Gcreate2(id_, path.c_str(), links_, H5P_DEFAULT, H5P_DEFAULT);
    ASSERT_GE(group, 0) << path;
    H5Gclose(group);
    if (type.empty()) return;
    const hid_t text = H5Tcopy(H5T_C_S1);
    H5Tset_size(text, variable ? H5T_VARIABLE : type.size());
    const hid_t space = H5Screate(H5S_SCALAR);
    const hid_t attribute = H5Acreate_by_name(id_, path.c_str(), "Type", text, space, H5P_DEFAULT,
                                              H5P_DEFAULT, H5P_DEFAULT);
    const char* value = type.c_str();
    EXPECT_GE(H5Awrite(attribute, text, variable ? static_cast<const void*>(&value) : value), 0);
    H5Aclose(attribute);
    H5Sclose(space);
    H5Tclose(text);
  }

  void attribute(const std::string& path, const char* name, const std::vector<double>& values,
                 hid_t type = H5T_STD_I64LE) const {
    const hsize_t count = values.size();
    const hid_t space = H5Screate_simple(1, &count, nullptr);
    const hid_t made = H5Acreate_by_name(id_, path.c_str(), name, type, space, H5P_DEFAULT,
                                         H5P_DEFAULT, H5P_DEFAULT);
    EXPECT_GE(H5Awrite(made, H5T_NATIVE_DOUBLE, values.data()), 0) << name;
    H5Aclose(made);
    H5Sclose(space);
  }

  void set(const std::string& path, const Lengths& dims, const std::vector<double>& values,
           hid_t type = H5T_IEEE_F64LE, const Lengths& chunk = {}) const {
    const hid_t space = H5Screate_simple(static_cast<int>(dims.size()), dims.data(), nullptr);
    const hid_t plan = H5Pcreate(H5P_DATASET_CREATE);
    if (!chunk.empty()) {
      H5Pset_chunk(plan, static_cast<int>(chunk.size()), chunk.data());
      H5Pset_deflate(plan, 4);
    }
    const hid_t made = H5Dcreate2(id_, path.c_str(), type, space, links_, plan, H5P_DEFAULT);
    ASSERT_GE(made, 0) << path;
    if (!values.empty()) {
      EXPECT_GE(H5Dwrite(made, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
    }
    H5Dclose(made);
    H5Pclose(plan);
    H5Sclose(space);
  }

 private:
  hid_t id_;
  hid_t links_;
};

class VtkHdf : public testing::Test {
 protected:
  VtkFolder folder_;
  std::string path_ = folder_.path("a.vtkhdf");
};

Place place_at(int i, int j, int k) { return {1 + 0.5 * (i - 1), 2 + 2.0 * j, -1 + 0.25 * k}; }

// The values of linear() on 4 x 3 x 5 points, i fastest, times `factor`.
std::vector<double> image_values(double factor = 1) {
  std::vector<double> out;
  for (int k = 0; k < 5; ++k) {
    for (int j = 0; j < 3; ++j) {
      for (int i = 0; i < 4; ++i) out.push_back(factor * linear(place_at(i + 1, j, k)));
    }
  }
  return out;
}

void describe_image(const HdfMaker& file, const std::string& group) {
  file.attribute(group, "WholeExtent", {1, 4, 0, 2, 0, 4});
  file.attribute(group, "Origin", {0.5, 2, -1}, H5T_IEEE_F64LE);
  file.attribute(group, "Spacing", {0.5, 2, 0.25}, H5T_IEEE_F64LE);
  file.attribute(group, "Direction", {1, 0, 0, 0, 1, 0, 0, 0, 1}, H5T_IEEE_F64LE);
}

TEST_F(VtkHdf, ImagesHaveTheirPlaceOrderAndVectors) {
  for (const bool variable : {false, true}) {
    {
      const HdfMaker file(path_);
      file.group("/VTKHDF", "ImageData", variable);
      file.attribute("/VTKHDF", "Version", {2, 0});
      describe_image(file, "/VTKHDF");
      file.set("/VTKHDF/PointData/a", {5, 3, 4}, image_values(), H5T_IEEE_F64BE, {2, 3, 3});
      std::vector<double> wind;
      for (const double value : image_values()) wind.insert(wind.end(), {value, -value, 7});
      file.set("/VTKHDF/PointData/wind", {5, 3, 4, 3}, wind, H5T_IEEE_F32LE);
      file.set("/VTKHDF/CellData/c", {4, 2, 3}, std::vector<double>(24, 1));
      file.set("/VTKHDF/PointData/odd", {5, 3}, std::vector<double>(15, 1));
    }
    const auto source = opened(path_);
    ASSERT_TRUE(source);
    const DatasetInfo& info = source->info();
    EXPECT_EQ(info.format, "VTKHDF image data");
    EXPECT_EQ(info.grid.dims(), (std::array<int, 3>{4, 3, 5}));
    EXPECT_EQ(info.grid.axes[0].coordinates, (std::vector<double>{1, 1.5, 2, 2.5}));
    EXPECT_EQ(info.grid.axes[2].coordinates.front(), -1);
    EXPECT_LT(compare(*source, linear).worst, 1e-6);
    const Volume wind = volume_of(*source, "wind");
    EXPECT_EQ(wind.values[7], -wind.values[7 + 60]);
    EXPECT_EQ(wind.values[7 + 120], 7);
    EXPECT_THAT(reason_of(info, "c"), HasSubstr("at cells"));
    EXPECT_THAT(reason_of(info, "odd"), HasSubstr("dimensions other than those of the image"));
  }
}

TEST_F(VtkHdf, PlacesOfAnotherLengthAreRefused) {
  for (const auto& [name, values] : std::map<std::string, std::vector<double>>{
           {"Origin", {0.5, 2}}, {"Spacing", {0.5}}, {"Direction", {1, 0, 0}}}) {
    {
      const HdfMaker file(path_);
      file.group("/VTKHDF", "ImageData");
      file.attribute("/VTKHDF", "WholeExtent", {1, 4, 0, 2, 0, 4});
      file.attribute("/VTKHDF", name.c_str(), values, H5T_IEEE_F64LE);
      file.set("/VTKHDF/PointData/a", {5, 3, 4}, image_values());
    }
    const std::string count = name == "Direction" ? "9" : "3";
    EXPECT_THAT(refusal(path_), HasSubstr("has no " + count + " numbers in its " + name));
  }
}

TEST_F(VtkHdf, StepsOfImagesHaveTimesAndOffsets) {
  {
    const HdfMaker file(path_);
    file.group("/VTKHDF", "ImageData");
    describe_image(file, "/VTKHDF");
    std::vector<double> all;
    for (const double factor : {1.0, 2.0, 3.0}) {
      for (const double value : image_values(factor)) all.push_back(value);
    }
    file.set("/VTKHDF/PointData/a", {3, 5, 3, 4}, all, H5T_IEEE_F32LE, {1, 5, 3, 4});
    // Stored in the opposite order, which the offsets say.
    file.set("/VTKHDF/PointData/b", {3, 5, 3, 4}, all);
    file.group("/VTKHDF/Steps", "");
    file.attribute("/VTKHDF/Steps", "NSteps", {3});
    file.set("/VTKHDF/Steps/Values", {3}, {0.5, 1.5, 4});
    file.set("/VTKHDF/Steps/PointDataOffsets/b", {3}, {2, 1, 0}, H5T_STD_I64LE);
  }
  const auto source = opened(path_);
  ASSERT_TRUE(source);
  ASSERT_EQ(source->info().steps.size(), 3U);
  EXPECT_EQ(source->info().steps[2].value, 4);
  const auto values = image_values();
  EXPECT_EQ(volume_of(*source, "a", 2).values[9], static_cast<float>(3 * values[9]));
  EXPECT_EQ(volume_of(*source, "b", 2).values[9], static_cast<float>(values[9]));
}

TEST_F(VtkHdf, DamagedFilesOfASeriesAreLeftOut) {
  constexpr int damaged = 6;
  for (int step = 1; step <= damaged + 2; ++step) {
    const HdfMaker file(folder_.path("s" + std::to_string(step) + ".vtkhdf"));
    file.group("/VTKHDF", "ImageData");
    describe_image(file, "/VTKHDF");
    file.set("/VTKHDF/PointData/a", {5, 3, 4}, image_values(step));
  }
  for (int step = 1; step <= damaged; ++step) {
    std::filesystem::resize_file(folder_.path("s" + std::to_string(step) + ".vtkhdf"), 600);
  }
  const auto source = opened(folder_.path("s*.vtkhdf"));
  ASSERT_TRUE(source);
  EXPECT_THAT(source->info().format, HasSubstr("VTK"));
  ASSERT_EQ(source->info().steps.size(), 2U);
  EXPECT_EQ(volume_of(*source, "a", 1).values[9], static_cast<float>(8 * image_values()[9]));
  const std::string notes = all_notes(source->info());
  EXPECT_THAT(notes, HasSubstr("6 of 8 files cannot be read"));
  EXPECT_THAT(notes, HasSubstr("'s1.vtkhdf'"));
  EXPECT_THAT(notes, HasSubstr("is an HDF5 file that is damaged"));
}

TEST_F(VtkHdf, TooManyStepsAreRefused) {
  {
    const HdfMaker file(path_);
    file.group("/VTKHDF", "ImageData");
    describe_image(file, "/VTKHDF");
    file.set("/VTKHDF/PointData/a", {5, 3, 4}, image_values());
    file.group("/VTKHDF/Steps", "");
    file.attribute("/VTKHDF/Steps", "NSteps", {20001});
  }
  EXPECT_THAT(refusal(path_), HasSubstr("has a number of steps outside 1 to 20000"));
}

TEST_F(VtkHdf, ACollectionDoesNotNameAFileOfSeveralSteps) {
  const std::string collection = folder_.write(
      "all.pvd",
      "<VTKFile type=\"Collection\"><Collection><DataSet timestep=\"0\" file=\"a.vtkhdf\"/>"
      "</Collection></VTKFile>");
  for (const hsize_t steps : {1U, 2U}) {
    {
      const HdfMaker file(path_);
      file.group("/VTKHDF", "ImageData");
      describe_image(file, "/VTKHDF");
      file.set("/VTKHDF/PointData/a", {steps, 5, 3, 4}, std::vector<double>(60 * steps, 1));
      file.group("/VTKHDF/Steps", "");
      file.attribute("/VTKHDF/Steps", "NSteps", {static_cast<double>(steps)});
      file.set("/VTKHDF/Steps/Values", {steps}, std::vector<double>(steps, 3));
    }
    if (steps == 1) {
      EXPECT_EQ(refusal(collection), "");
    } else {
      EXPECT_THAT(refusal(collection), HasSubstr("'a.vtkhdf' has 2 steps; open it by itself"));
    }
  }
}

struct MeshLists {
  std::vector<double> points, connectivity, offsets, types, a, counts, cells, indices;

  void add(const TestMesh& mesh, const Function& f) {
    points.insert(points.end(), mesh.points.begin(), mesh.points.end());
    connectivity.insert(connectivity.end(), mesh.connectivity.begin(), mesh.connectivity.end());
    offsets.push_back(0);
    offsets.insert(offsets.end(), mesh.offsets.begin(), mesh.offsets.end());
    types.insert(types.end(), mesh.types.begin(), mesh.types.end());
    const auto values = at_points(mesh, f);
    a.insert(a.end(), values.begin(), values.end());
    counts.push_back(static_cast<double>(mesh.points.size() / 3));
    cells.push_back(static_cast<double>(mesh.types.size()));
    indices.push_back(static_cast<double>(mesh.connectivity.size()));
  }
  void write(const HdfMaker& file, const std::string& group) const {
    const auto set = [&](const char* name, const std::vector<double>& values, hid_t type) {
      file.set(group + name, {values.size()}, values, type);
    };
    file.set(group + "/Points", {points.size() / 3, 3}, points, H5T_IEEE_F64LE, {7, 3});
    set("/Connectivity", connectivity, H5T_STD_I64LE);
    set("/Offsets", offsets, H5T_STD_I64LE);
    set("/Types", types, H5T_STD_U8LE);
    set("/NumberOfPoints", counts, H5T_STD_I64LE);
    set("/NumberOfCells", cells, H5T_STD_I64LE);
    set("/NumberOfConnectivityIds", indices, H5T_STD_I64LE);
    file.set(group + "/PointData/a", {a.size()}, a, H5T_IEEE_F64LE, {11});
  }
};

TestMesh cube_at(double x, bool tetrahedra = false) {
  return boxes(
      3,
      [x](const Place& p) {
        return Place{p[0] + x, p[1], p[2]};
      },
      tetrahedra ? as_tetrahedra : as_hexahedron);
}

TEST_F(VtkHdf, PartsOfMeshesAreOneMesh) {
  {
    const HdfMaker file(path_);
    file.group("/VTKHDF", "UnstructuredGrid");
    MeshLists lists;
    lists.add(cube_at(0), linear);
    lists.add(TestMesh{}, linear);
    lists.add(cube_at(1, true), linear);
    lists.write(file, "/VTKHDF");
  }
  const auto source = opened(path_);
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().format, "VTKHDF unstructured grid");
  EXPECT_THAT(all_notes(source->info()), HasSubstr("resampled from 128 points and 189 cells"));
  const Outcome got = compare(*source, linear);
  EXPECT_LT(got.worst, 1e-5);
  EXPECT_NEAR(got.inside, 1, 1e-9);
  EXPECT_EQ(source->info().grid.axes[0].coordinates.back(), 2);
}

// Two steps with the same mesh, stored once and used twice; then the second with its own copy.
// Without NumberOfParts, both have equally many parts.
TEST_F(VtkHdf, StepsOfMeshesFollowTheirOffsets) {
  for (const auto& [copied, is_numbered] :
       {std::pair(false, true), {true, true}, {false, false}, {true, false}}) {
    {
      const HdfMaker file(path_);
      file.group("/VTKHDF", "UnstructuredGrid");
      MeshLists lists;
      lists.add(cube_at(0), linear);
      lists.add(cube_at(1), linear);
      if (copied) {
        lists.add(cube_at(0), [](const Place& p) { return 5 * p[0]; });
        lists.add(cube_at(1), [](const Place& p) { return 5 * p[0]; });
      } else {
        for (const double x : {0.0, 1.0}) {
          const auto more = at_points(cube_at(x), [](const Place& p) { return 5 * p[0]; });
          lists.a.insert(lists.a.end(), more.begin(), more.end());
        }
      }
      lists.write(file, "/VTKHDF");
      file.group("/VTKHDF/Steps", "");
      file.attribute("/VTKHDF/Steps", "NSteps", {2});
      const double own = copied ? 1 : 0;
      const auto offsets = [&](const char* name, double second) {
        file.set(std::string("/VTKHDF/Steps/") + name, {2}, {0, second}, H5T_STD_I64LE);
      };
      file.set("/VTKHDF/Steps/Values", {2}, {1, 2});
      if (is_numbered) file.set("/VTKHDF/Steps/NumberOfParts", {2}, {2, 2}, H5T_STD_I64LE);
      offsets("PartOffsets", 2 * own);
      offsets("PointOffsets", 128 * own);
      file.set("/VTKHDF/Steps/CellOffsets", {2, 1}, {0, 54 * own}, H5T_STD_I64LE);
      file.set("/VTKHDF/Steps/ConnectivityIdOffsets", {2, 1}, {0, 432 * own}, H5T_STD_I64LE);
      offsets("PointDataOffsets/a", 128);
    }
    const auto source = opened(path_);
    ASSERT_TRUE(source);
    ASSERT_EQ(source->info().steps.size(), 2U);
    EXPECT_EQ(source->info().steps[1].value, 2);
    EXPECT_THAT(all_notes(source->info()), HasSubstr("resampled from 128 points"));
    EXPECT_LT(compare(*source, linear).worst, 1e-5);
    const Volume second = volume_of(*source, "a", 1);
    EXPECT_NEAR(second.range[1], 10, 1e-5);
    EXPECT_NEAR(second.range[0], 0, 1e-5);
  }
}

TEST_F(VtkHdf, BlocksAreUnitedInTheOrderOfTheirIndex) {
  {
    const HdfMaker file(path_);
    file.group("/VTKHDF", "PartitionedDataSetCollection");
    file.group("/VTKHDF/first", "UnstructuredGrid");
    file.attribute("/VTKHDF/first", "Index", {1});
    file.group("/VTKHDF/second", "UnstructuredGrid");
    file.attribute("/VTKHDF/second", "Index", {0});
    file.group("/VTKHDF/skin", "PolyData");
    file.set("/VTKHDF/skin/Points", {1, 3}, {0, 0, 0});
    file.group("/VTKHDF/Assembly/all", "");
    H5Lcreate_soft("/VTKHDF/first", file.id(), "/VTKHDF/Assembly/all/first", H5P_DEFAULT,
                   H5P_DEFAULT);
    MeshLists first;
    first.add(cube_at(0), linear);
    first.write(file, "/VTKHDF/first");
    MeshLists second;
    second.add(cube_at(1), linear);
    second.write(file, "/VTKHDF/second");
  }
  const auto source = opened(path_);
  ASSERT_TRUE(source);
  EXPECT_THAT(all_notes(source->info()), HasSubstr("one mesh: 'second', 'first'"));
  EXPECT_THAT(all_notes(source->info()), HasSubstr("'skin (PolyData)'"));
  EXPECT_LT(compare(*source, linear).worst, 1e-5);
  const auto one = opened(path_ + "#/second");
  ASSERT_TRUE(one);
  EXPECT_EQ(one->info().grid.axes[0].coordinates.front(), 1);
  EXPECT_THAT(refusal(path_ + "#/third"), HasSubstr("its blocks: 'second', 'first', 'skin'"));
}

TEST_F(VtkHdf, BrokenFilesAreErrors) {
  const auto mesh = [&](const std::function<void(MeshLists&)>& spoil) {
    {
      const HdfMaker file(path_);
      file.group("/VTKHDF", "UnstructuredGrid");
      MeshLists lists;
      lists.add(cube_at(0), linear);
      spoil(lists);
      lists.write(file, "/VTKHDF");
    }
    return refusal(path_);
  };
  EXPECT_EQ(mesh([](MeshLists&) {}), "");
  EXPECT_THAT(mesh([](MeshLists& m) { m.connectivity[3] = 64; }), HasSubstr("point 64"));
  EXPECT_THAT(mesh([](MeshLists& m) { m.offsets[0] = 1; }), HasSubstr("do not begin with 0"));
  EXPECT_THAT(mesh([](MeshLists& m) { m.counts[0] = 65; }),
              HasSubstr("'/VTKHDF/Points' has 64 items along its dimension 0, but 0 + 65"));
  EXPECT_THAT(mesh([](MeshLists& m) { m.cells[0] = 1e18; }), HasSubstr("no valid number"));
  EXPECT_THAT(mesh([](MeshLists& m) { m.counts[0] = -1; }), HasSubstr("no valid number"));
  const auto typed = [&](const std::string& type) {
    {
      const HdfMaker file(path_);
      file.group("/VTKHDF", type);
      file.set("/VTKHDF/Points", {1, 3}, {0, 0, 0});
    }
    return refusal(path_);
  };
  EXPECT_THAT(typed("OverlappingAMR"), HasSubstr("VTKHDF data of the type 'OverlappingAMR'"));
  EXPECT_THAT(typed(""), HasSubstr("of the type ''"));
  for (const double version : {1, 2, 3, 9}) {
    {
      const HdfMaker file(path_);
      file.group("/VTKHDF", "ImageData");
      file.attribute("/VTKHDF", "Version", {version, 0});
      describe_image(file, "/VTKHDF");
      file.set("/VTKHDF/PointData/a", {5, 3, 4}, image_values());
    }
    const std::string why = version < 3 ? "" : "a version of VTKHDF other than 1 and 2";
    const std::string found = refusal(path_);
    EXPECT_THAT(found, HasSubstr(why)) << version;
    EXPECT_EQ(found.empty(), why.empty()) << found;
  }
  // An image of 2^31 samples, of which none is stored.
  {
    const HdfMaker file(path_);
    file.group("/VTKHDF", "ImageData");
    file.attribute("/VTKHDF", "WholeExtent", {0, 2047, 0, 1023, 0, 1023});
    file.set("/VTKHDF/PointData/a", {1024, 1024, 2048}, {}, H5T_IEEE_F32LE, {64, 64, 64});
  }
  EXPECT_THAT(refusal(path_), HasSubstr("no array whose tuples match"));
}

// Chunks that were never written are masked, not zero.
TEST_F(VtkHdf, UnwrittenChunksAreMasked) {
  {
    const HdfMaker file(path_);
    file.group("/VTKHDF", "ImageData");
    file.attribute("/VTKHDF", "WholeExtent", {0, 3, 0, 2, 0, 4});
    file.set("/VTKHDF/PointData/a", {5, 3, 4}, image_values());
    file.set("/VTKHDF/PointData/b", {5, 3, 4}, {}, H5T_IEEE_F32LE, {1, 3, 4});
    const hid_t set = H5Dopen2(file.id(), "/VTKHDF/PointData/b", H5P_DEFAULT);
    const Lengths start{2, 0, 0};
    const Lengths count{1, 3, 4};
    const hid_t space = H5Dget_space(set);
    const hid_t memory = H5Screate_simple(3, count.data(), nullptr);
    H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr);
    const std::vector<float> sevens(12, 7);
    EXPECT_GE(H5Dwrite(set, H5T_NATIVE_FLOAT, memory, space, H5P_DEFAULT, sevens.data()), 0);
    H5Sclose(memory);
    H5Sclose(space);
    H5Dclose(set);
  }
  const auto source = opened(path_);
  ASSERT_TRUE(source);
  const Volume volume = volume_of(*source, "b");
  for (std::size_t n = 0; n < 60; ++n) {
    EXPECT_EQ(std::isnan(volume.values[n]), n / 12 != 2) << n;
  }
  EXPECT_EQ(volume.values[30], 7);
}

}  // namespace
}  // namespace windsplat::data::vtk_test
