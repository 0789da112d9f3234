// Estimated cost of views before data are read, and refusals by the limits.
#include "server/frame/cost.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "server/access/cost_limits.hpp"
#include "server/data/resident/store.hpp"
#include "server/data/samples/samples.hpp"

namespace windsplat::access {
namespace {

// Lines of 100 x 80 x 60 samples and one medium.
class CostTest : public testing::Test {
 protected:
  CostTest() : store_(std::uint64_t{1} << 30U) {
    dataset_ = store_.add("tornado:100x80x60").value();
    view_.dataset = dataset_->info().id;
    view_.vector.field = {protocol::FieldChoice::Kind::named, "wind"};
    view_.vector.magnitude_range = protocol::Range{0, 1};
    view_.vector.min_magnitude = 0;
    view_.vector.color.range = protocol::Range{0, 1};
    view_.vector.stride = 1;
    view_.vector.length = 0.1;
    view_.scalars.emplace();
    view_.method.name = protocol::MethodName::kernel;
    view_.method.detail = protocol::Detail::full;
  }

  frame::Cost cost(const protocol::View& view) {
    const auto outline = scene::outline(view, *dataset_);
    EXPECT_TRUE(outline) << (outline ? "" : outline.error().message);
    return frame::cost_of(outline.value(), *dataset_);
  }

  protocol::ScalarView medium() {
    protocol::ScalarView scalar;
    for (const auto& field : dataset_->info().fields) {
      if (field.kind == data::FieldKind::scalar) scalar.field = field.name;
    }
    scalar.color.range = protocol::Range{0, 1};
    scalar.extinction.emplace(1, std::array<double, 2>{0, 1});
    return scalar;
  }

  data::Store store_;
  std::shared_ptr<data::Dataset> dataset_;
  protocol::View view_;
};

constexpr double samples = 100 * 80 * 60;
constexpr double pixels = 1280 * 720;

TEST_F(CostTest, CountsEveryKernelPositionAndSample) {
  EXPECT_GE(cost(view_).kernels, samples);
  EXPECT_LT(cost(view_).kernels, 20 * samples);
  EXPECT_EQ(cost(view_).pixels, 1280 * 720);
  protocol::View with_medium = view_;
  with_medium.scalars = {medium()};
  EXPECT_GE(cost(with_medium).kernels, cost(view_).kernels + samples);
  protocol::View nothing = view_;
  nothing.vector.field = {protocol::FieldChoice::Kind::none, ""};
  EXPECT_LT(cost(nothing).kernels, samples) << "the picture only";
  nothing.scalars = {medium()};
  (*nothing.scalars)[0].extinction = {{0, 0}};
  EXPECT_LT(cost(nothing).kernels, samples) << "a transparent medium absorbs nothing";
  protocol::View unseen = view_;
  unseen.vector.opacity = 0;
  EXPECT_LT(cost(unseen).kernels, samples);
}

// Not as many as there are samples.
TEST_F(CostTest, CountsThePiecesOfLinesThroughSeeds) {
  protocol::View seeded = view_;
  seeded.vector.trace.emplace();
  const double streamlets = cost(seeded).kernels;
  seeded.vector.trace->seeds.emplace();
  seeded.vector.trace->seeds->evenly = 100;
  const double picture = 1280.0 * 720 / frame::Cost::pixels_a_kernel;
  const double lines = cost(seeded).kernels - picture;
  EXPECT_GE(lines, 100 * 500) << "a kernel for each piece";
  EXPECT_EQ(cost(seeded).dominant, "/vector/trace/seeds");
  seeded.vector.stride = 8;
  EXPECT_DOUBLE_EQ(cost(seeded).kernels - picture, lines) << "the samples do not count";
  seeded.vector.trace->seeds->evenly = 300;
  EXPECT_NEAR(cost(seeded).kernels - picture, 3 * lines, 1e-6 * lines);
  seeded.vector.trace->seeds->evenly = 1;
  EXPECT_LT(cost(seeded).kernels, 0.1 * streamlets);
}

// Measured: 70 ns a pixel of a ground with land and sea, 20 ns of a plain one, at 6 ns a kernel.
TEST_F(CostTest, CountsThePixelsOfGrounds) {
  const auto ground_of = [&](protocol::View view) {
    view.ground.show = protocol::GroundShow::off;
    const double without = cost(view).kernels;
    view.ground.show = protocol::GroundShow::on;
    return cost(view).kernels - without;
  };
  const double plain = ground_of(view_);
  EXPECT_GE(plain, 2 * pixels);
  dataset_ = store_.add("climate:36x18x4").value();
  EXPECT_GE(ground_of(view_), 3 * plain) << "land and sea";
}

// An isosurface of a smooth field has some triangles for each sample of a face of the lattice, an
// oblique section two for each cell that it cuts, and a layer two for each of its cells.
TEST_F(CostTest, CountsTheTrianglesOfSurfacesAndTheSamplesSearchedForThem) {
  const double plain = cost(view_).kernels;
  const auto added = [&](const protocol::SurfaceView& surface, int times) {
    protocol::View view = view_;
    for (int n = 0; n < times; ++n) view.surfaces.push_back(surface);
    return cost(view).kernels - plain;
  };
  protocol::SurfaceView surface;
  surface.field = medium().field;
  surface.isovalue = 0.5;
  const double isosurface = added(surface, 1);
  // 100 ns a triangle at least.
  EXPECT_GE(isosurface, samples + pixels + 3 * std::pow(samples, 2.0 / 3) * 100 / 6);
  EXPECT_NEAR(added(surface, 3), 3 * isosurface, 1e-6 * isosurface);
  surface.isovalue.reset();
  surface.plane = protocol::PlaneView{{0, 0, 0}, {0.3, 1, 0.2}};
  const double section = added(surface, 1);
  EXPECT_LT(section, isosurface);
  surface.plane.reset();
  surface.slice = protocol::SliceView{protocol::GridAxis::x, 3};  // 80 x 60
  const double short_layer = added(surface, 1);
  EXPECT_LT(short_layer, section);
  surface.slice = protocol::SliceView{protocol::GridAxis::z, 3};  // 100 x 80
  EXPECT_GT(added(surface, 1), short_layer);
}

// Measured: some 100 ns for the sunlight of a sample, more on a lattice that is bent.
TEST_F(CostTest, CountsTheSamplesOfLight) {
  protocol::View clouds = view_;
  clouds.scalars = {medium()};
  const auto light_of = [&](protocol::View view) {
    const double unlit = cost(view).kernels;
    view.light.emplace();
    return cost(view).kernels - unlit;
  };
  EXPECT_EQ(light_of(view_), 0) << "no medium";
  EXPECT_GE(light_of(clouds), 5 * samples);
  EXPECT_LE(light_of(clouds), 50 * samples);
  protocol::View sliced = clouds;
  sliced.geometry.slice = protocol::SliceView{protocol::GridAxis::z, 3};
  EXPECT_EQ(light_of(sliced), 0) << "drawn unlit";
}

TEST_F(CostTest, StrideReducesSamplesAndASliceLeavesOneLayer) {
  protocol::View strided = view_;
  strided.vector.stride = 4;
  strided.vector.length = 0.001;
  protocol::View plain = view_;
  plain.vector.stride = 1;
  plain.vector.length = 0.001;
  // At least 16 pixels are counted for each kernel; the rest is the cost of the picture.
  const double picture = 1280.0 * 720 / frame::Cost::pixels_a_kernel;
  EXPECT_NEAR((cost(plain).kernels - picture) / (cost(strided).kernels - picture), 64, 1);
  protocol::View sliced = plain;
  sliced.geometry.slice = protocol::SliceView{protocol::GridAxis::z, 3};
  EXPECT_NEAR((cost(plain).kernels - picture) / (cost(sliced).kernels - picture), 60, 1);
  // Planes have the pitch of the cells.
  protocol::View plane = plain;
  plane.geometry.plane = protocol::PlaneView{{0, 0, 0}, {0, 0, 1}};
  EXPECT_NEAR((cost(plane).kernels - picture) / (cost(sliced).kernels - picture), 1, 0.05);
}

TEST_F(CostTest, GiantKernelsCostWhatTheyCover) {
  protocol::View wide = view_;
  wide.vector.r2 = 64;
  EXPECT_GT(cost(wide).kernels, 100 * cost(view_).kernels);
  EXPECT_EQ(cost(wide).dominant, "/vector/r2");
  protocol::View longest = view_;
  longest.vector.length = 10;
  longest.vector.span = 64;
  EXPECT_GT(cost(longest).kernels, 3 * cost(view_).kernels);
  EXPECT_EQ(cost(longest).dominant, "/vector/length");
  protocol::View large = wide;
  large.image = {8192, 4320, "#000000"};
  EXPECT_GT(cost(large).kernels, 20 * cost(wide).kernels);
  protocol::View thin = view_;
  thin.method.name = protocol::MethodName::slab;
  thin.method.slab_thickness = 0.05;
  EXPECT_EQ(cost(thin).dominant, "/method/slabThickness");
}

TEST_F(CostTest, MergedOrCulledSamplesCostLess) {
  protocol::View far = view_;
  far.vector.opacity = 0.05;  // opaque lines are not merged
  far.camera.eye = protocol::Vec3{0, -1000, 0};
  far.camera.target = protocol::Vec3{0, 0, 0};
  const double all = cost(far).kernels;
  far.method.detail = protocol::Detail::automatic;
  EXPECT_LT(cost(far).kernels, 0.2 * all);
  // From inside, most of the large kernels are behind the eye or outside the picture.
  protocol::View within = view_;
  within.vector.r2 = 20;
  const double from_outside = cost(within).kernels;
  within.camera.eye = protocol::Vec3{0, 0, 0};
  within.camera.target = protocol::Vec3{0, 1, 0};
  within.camera.fov_y = 5;
  EXPECT_LT(cost(within).kernels, 0.5 * from_outside);
}

TEST_F(CostTest, CountsEverySampleWhereLevelsDoNotFitIntoMemory) {
  protocol::View far = view_;
  far.vector.opacity = 0.05;
  far.camera.eye = protocol::Vec3{0, -1000, 0};
  far.camera.target = protocol::Vec3{0, 0, 0};
  const double all = cost(far).kernels;
  far.method.detail = protocol::Detail::automatic;
  const auto within = [&](double bytes) {
    const data::Dataset dataset(data::open_sample("tornado", {100, 80, 60}).value(), "tornado",
                                static_cast<std::uint64_t>(bytes));
    return frame::cost_of(scene::outline(far, dataset).value(), dataset).kernels;
  };
  const double wind = 3 * sizeof(float) * samples;
  EXPECT_LT(within(wind + wind / 8), 0.2 * all);
  EXPECT_EQ(within(wind + wind / 8 - 1), all);
}

TEST_F(CostTest, IsFiniteAndRefusedAtEveryExtremeOfAView) {
  for (const double r2 : {0.0, 64.0}) {
    for (const double length : {0.0, 10.0}) {
      for (const double eye : {1e-6, 1.0, 1e6}) {
        for (const double fov : {0.001, 179.0}) {
          protocol::View view = view_;
          view.image = {8192, 4320, "#000000"};
          view.vector.r1 = 0;
          view.vector.r2 = r2;
          view.vector.length = length;
          view.vector.span = 64;
          view.camera.eye = protocol::Vec3{0, -eye, eye};
          view.camera.target = protocol::Vec3{0, 0, 0};
          view.camera.fov_y = fov;
          view.scalars = {medium(), medium(), medium(), medium()};
          const frame::Cost found = cost(view);
          EXPECT_TRUE(std::isfinite(found.kernels)) << r2 << ' ' << length << ' ' << eye;
          EXPECT_GE(found.kernels, 5 * samples);
        }
      }
    }
  }
}

TEST(CheckCost, NamesTheLimitAndHowToReduceTheCost) {
  Limits limits;
  limits.pixels = 1000;
  limits.kernels = 5000;
  EXPECT_TRUE(check_cost({1000, 5000, "/vector/stride"}, limits));
  const auto large = check_cost({1001, 1, "/image"}, limits);
  ASSERT_FALSE(large);
  EXPECT_EQ(large.error().kind, ErrorKind::too_large);
  EXPECT_EQ(large.error().at.at(0).pointer, "/image");
  EXPECT_NE(large.error().message.find("1000"), std::string::npos);
  for (const double kernels : {5001.0, 1e300, std::nan("")}) {
    const auto dear = check_cost({1, kernels, "/scalars/2/stride"}, limits);
    ASSERT_FALSE(dear) << kernels;
    EXPECT_EQ(dear.error().kind, ErrorKind::invalid);
    EXPECT_EQ(dear.error().at.at(0).pointer, "/scalars/2/stride");
    EXPECT_NE(dear.error().message.find("5e+03"), std::string::npos) << dear.error().message;
  }
  limits.pixels = 0;
  limits.kernels = 0;
  EXPECT_TRUE(check_cost({1LL << 40, 1e300, "/image"}, limits));
}

}  // namespace
}  // namespace windsplat::access
