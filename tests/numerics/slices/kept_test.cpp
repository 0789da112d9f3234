// What is kept of sections: shared, of one view, on any number of threads, within the memory limit.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <utility>
#include <vector>

#include "server/scene/build.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/lattice.hpp"
#include "tests/numerics/slices/planes.hpp"

namespace windsplat::scene {
namespace {

using protocol::GridAxis;
using protocol::SliceView;
using protocol::View;

TEST(Plane, SampledFieldsAreSharedAndCountAsResident) {
  auto dataset = dataset_with(box_grid(false), linear);
  View view = plane_view({0, 0, 0}, {1, 2, 3});
  View whole = view;
  whole.geometry.plane.reset();
  static_cast<void>(built(whole, *dataset));
  const auto before = dataset->resident_bytes();
  const Scene scene = built(view, *dataset);
  const std::uint64_t places = scene.lattice.places->size() * 3 * sizeof(float);
  EXPECT_EQ(dataset->resident_bytes() - before,
            scene.vector->field->bytes() + scene.scalars[0].field->bytes() + places);
  data::Dataset session = dataset->resident_only();
  const Scene again = built(view, session);
  EXPECT_EQ(again.vector->field, scene.vector->field);
  EXPECT_EQ(again.scalars[0].field, scene.scalars[0].field);
  EXPECT_EQ(again.lattice.places, scene.lattice.places);
}

std::unique_ptr<data::Dataset> weather() {
  return dataset_of(std::make_unique<FakeSource>(
      atmosphere_grid(), std::vector<data::FieldInfo>{wind_info(), scalar_info("cloud", "1")}, 1));
}

// What is kept belongs to one placement, plane and layer.
TEST(Plane, PlacesAreThoseOfTheView) {
  auto dataset = weather();
  std::vector<View> views(4, plane_view({0, 0, 0}, {1, 2, 3}));
  views[1].geometry.scale = {1, 2, 1};
  views[2].geometry.plane->normal = {1, 2, 4};
  views[3].geometry.plane->point = {0.2, 0, 0};
  View raised = plane_view({0, 0, 0}, {1, 0, 0});
  raised.geometry.plane.reset();
  raised.geometry.mapping = protocol::GeometryMapping::sphere;
  for (const double index : {0.5, 0.75}) {
    raised.geometry.slice = SliceView{GridAxis::z, index};
    views.push_back(raised);
    views.push_back(raised);
    views.back().geometry.scale = {1, 1, 2};
  }
  std::vector<std::vector<std::array<float, 3>>> places;
  for (const View& view : views) {
    const Scene scene = built(view, *dataset);
    places.push_back(*scene.lattice.places);
    EXPECT_EQ(std::count(places.begin(), places.end(), places.back()), 1);
    EXPECT_EQ(places.back(), *built(view, *weather()).lattice.places);
  }
}

// Log p and p have the same places on a plane, but other values there.
TEST(Plane, ValuesAreThoseOfThePlacement) {
  auto dataset = weather();
  View view = plane_view({0, 0, 0}, {1, 2, 3});
  for (const auto vertical :
       {protocol::VerticalPlacement::linear, protocol::VerticalPlacement::logp}) {
    view.geometry.vertical = vertical;
    const Scene scene = built(view, *dataset);
    const Scene alone = built(view, *weather());
    for (const auto& [kept, made] : {std::pair(scene.vector->field, alone.vector->field),
                                     std::pair(scene.scalars[0].field, alone.scalars[0].field)}) {
      ASSERT_EQ(kept->bytes(), made->bytes());
      EXPECT_EQ(std::memcmp(kept->values.data(), made->values.data(), kept->bytes()), 0);
    }
  }
}

// So many samples are divided among threads.
TEST(Plane, OfManySamplesIsThatOfItsPlaces) {
  data::Grid grid;
  for (data::Axis& one : grid.axes) {
    std::vector<double> at(121);
    for (std::size_t i = 0; i < at.size(); ++i) at[i] = static_cast<double>(i);
    one = axis(data::AxisKind::cartesian, "km", std::move(at));
  }
  grid.axes[0].coordinates.resize(1200);
  for (std::size_t i = 0; i < 1200; ++i) grid.axes[0].coordinates[i] = static_cast<double>(i) / 10;
  auto dataset = dataset_with(grid, linear);
  View view = plane_view({0.1, 0, 0}, {0.2, 0.3, 1});
  view.vector.field = {protocol::FieldChoice::Kind::none, ""};
  const Scene scene = built(view, *dataset);
  const data::Volume& cloud = *scene.scalars.at(0).field;
  ASSERT_GT(cloud.samples(), 2U * 16 * 4096);
  const Lattice whole = place_lattice(grid, {}).value();
  std::size_t inner = 0;
  for (std::size_t i = 0; i < cloud.samples(); i += 7) {
    const glm::dvec3 at = place(scene, i);
    bool among_samples = true;
    for (int a = 0; a < 3; ++a) {
      among_samples = among_samples && at[a] >= whole.positions[a].front() &&
                      at[a] <= whole.positions[a].back();
    }
    if (!among_samples) continue;
    ++inner;
    ASSERT_NEAR(cloud.values[i], linear(at), 3e-6);
  }
  EXPECT_GT(inner, cloud.samples() / 10);
}

// ---- memory ----

View lines_view() {
  View view = plane_view({0, 0, 0}, {1, 2, 3});
  view.scalars->clear();
  view.vector.magnitude_range = protocol::Range{0, 4};
  view.vector.color.by = protocol::ColorBy::magnitude;
  return view;
}

struct Bytes {
  std::uint64_t wind = std::uint64_t{sizeof(float)} * 3 * box_dims[0] * box_dims[1] * box_dims[2];
  std::uint64_t section = 0;  // of its vectors, and as many of their places
};
Bytes bytes_of_lines() {
  auto dataset = dataset_with(box_grid(true), linear);
  Bytes bytes;
  bytes.section = built(lines_view(), *dataset).vector->field->bytes();
  return bytes;
}

std::unique_ptr<data::Dataset> limited(std::uint64_t bytes_max) {
  class Source final : public data::Source {
   public:
    [[nodiscard]] const data::DatasetInfo& info() const override { return fake_.info(); }
    Result<data::Volume> read(std::size_t field, std::size_t step) override {
      return fake_.read(field, step);
    }

   private:
    FakeSource fake_{box_grid(true), {wind_info(), scalar_info("cloud", "1")}, 1};
  };
  return std::make_unique<data::Dataset>(std::make_unique<Source>(), "limited", bytes_max);
}

// The data, the section and its places do not fit together.
TEST(Plane, PlacesNeedNoRoomBesideTheData) {
  const auto [wind, section] = bytes_of_lines();
  ASSERT_GT(section, 100U);
  auto dataset = limited(wind + section + section / 2);
  const auto completed = complete(lines_view(), *dataset);
  ASSERT_TRUE(completed);
  const auto scene = build_scene(*completed, *dataset);
  EXPECT_TRUE(scene) << scene.error().message;
}

// The renderer leaves it to the loading thread, which waits for room.
TEST(Plane, WithoutRoomIsNotResident) {
  const auto [wind, section] = bytes_of_lines();
  auto dataset = limited(wind + 2 * section);
  const auto completed = complete(lines_view(), *dataset);
  std::shared_ptr<const data::Volume> drawn = built(lines_view(), *dataset).vector->field;
  const auto taken = dataset->reserve(wind + section / 2);
  ASSERT_TRUE(taken);
  data::Dataset resident = dataset->resident_only();
  const auto refused = build_scene(*completed, resident);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::not_resident) << refused.error().message;
}

TEST(Plane, PicturesNearTheLimitShareItsPlaces) {
  const auto [wind, section] = bytes_of_lines();
  auto dataset = limited(std::max(wind + section, 2 * section) + section / 2);
  const auto completed = complete(lines_view(), *dataset);
  const Scene drawn = built(lines_view(), *dataset);
  data::Dataset resident = dataset->resident_only();
  const auto other = build_scene(*completed, resident);
  ASSERT_TRUE(other) << other.error().message;
  EXPECT_EQ(other->lattice.places, drawn.lattice.places);
}

}  // namespace
}  // namespace windsplat::scene
