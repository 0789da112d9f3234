// A view of a difference: its defaults and what is refused.
#include "server/scene/difference/difference.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {
namespace {

using protocol::DifferenceView;
using testing::HasSubstr;

// Temperature 250 + n + s (n - 20) K at sample n of 36 and step s; its difference from step 0 is
// s (n - 20), from -20 s to 15 s. Heights of `rise` m a level, 10 m more with each step.
class Warming final : public data::Source {
 public:
  explicit Warming(double rise = 1000) : rise_(rise) {
    info_.id = "warming";
    info_.grid = atmosphere_grid();
    info_.fields = {scalar_info("temperature", "K"), wind_info(), scalar_info("height", "m")};
    for (int s = 0; s < 4; ++s) {
      info_.steps.push_back({static_cast<double>(s), std::to_string(s)});
    }
  }
  [[nodiscard]] const data::DatasetInfo& info() const override { return info_; }
  Result<data::Volume> read(std::size_t field, std::size_t step) override {
    data::Volume volume;
    volume.dims = info_.grid.dims();
    volume.components = field == 1 ? 3 : 1;
    std::vector<float> values;
    for (std::size_t n = 0; n < volume.samples() * static_cast<std::size_t>(volume.components);
         ++n) {
      const auto at = static_cast<double>(n);
      const auto s = static_cast<double>(step);
      const double height = rise_ * static_cast<double>(n / 12 + 1) + 10 * s;
      values.push_back(static_cast<float>(field == 2 ? height : 250 + at + s * (at - 20)));
    }
    volume.values = std::move(values);
    data::finish_volume(volume);
    return volume;
  }

 private:
  double rise_;
  data::DatasetInfo info_;
};

protocol::View temperature_minus(int step) {
  protocol::View view;
  view.difference = DifferenceView{std::nullopt, step};
  view.scalars.emplace().emplace_back().field = "temperature";
  return view;
}

data::Dataset handle(const protocol::View& view) {
  const data::Dataset dataset(std::make_unique<Warming>(), "warming", std::uint64_t{1} << 24U);
  return with_difference(view, dataset, nullptr).value();
}

TEST(DifferenceView, HasADivergingMapOverASymmetricRangeThatIsClearAtZero) {
  const protocol::View view = temperature_minus(0);
  data::Dataset difference = handle(view);
  const auto full = complete(view, difference);
  ASSERT_TRUE(full) << full.error().message;
  const protocol::ScalarView& scalar = full->view().scalars->front();
  EXPECT_EQ(scalar.color.map, "coolwarm");
  EXPECT_EQ(scalar.color.range, (protocol::Range{-60, 60})) << "20 K a step, of step 3";
  const auto& curve = *scalar.extinction;
  ASSERT_EQ(curve.size(), 4U);
  for (std::size_t n = 0; n < curve.size(); ++n) {
    EXPECT_DOUBLE_EQ(curve[n][0], -curve[3 - n][0]);
    EXPECT_DOUBLE_EQ(curve[n][1], curve[3 - n][1]);
  }
  EXPECT_GT(curve[0][1], 0);
  EXPECT_EQ(curve[1][1], 0);
  EXPECT_LT(curve[1][0], 0) << "zero is transparent";
}

TEST(DifferenceView, RangesDoNotDependOnTheStepShown) {
  for (const int minus : {0, 1, 2, 3}) {
    protocol::View view = temperature_minus(minus);
    data::Dataset difference = handle(view);
    const double farthest = std::max(minus, 3 - minus);
    for (view.step = 0; view.step < 4; ++view.step) {
      const auto full = complete(view, difference);
      ASSERT_TRUE(full) << full.error().message;
      EXPECT_EQ(full->view().scalars->front().color.range->at(1), 20 * farthest)
          << view.step << " minus " << minus;
    }
  }
}

TEST(DifferenceView, DrawsTheDifferenceOfEveryKindOfField) {
  protocol::View view = temperature_minus(0);
  view.step = 2;
  view.vector.color.by = protocol::ColorBy::scalar;
  view.vector.color.field = "temperature";
  view.vector.min_magnitude = 0;
  view.method.detail = protocol::Detail::full;
  data::Dataset difference = handle(view);
  const Scene scene = built(view, difference);
  ASSERT_TRUE(scene.vector);
  ASSERT_EQ(scene.scalars.size(), 1U);
  const data::Volume& lines = *scene.vector->field;
  for (std::size_t n = 0; n < lines.values.size(); ++n) {
    EXPECT_FLOAT_EQ(lines.values[n], static_cast<float>(2 * (static_cast<double>(n) - 20))) << n;
  }
  const data::Volume& colors = *scene.vector->color_field;
  const data::Volume& medium = *scene.scalars.front().field;
  for (std::size_t n = 0; n < 36; ++n) {
    const auto expected = static_cast<float>(2 * (static_cast<double>(n) - 20));
    EXPECT_FLOAT_EQ(colors.values[n], expected) << n;
    EXPECT_FLOAT_EQ(medium.values[n], expected) << n;
  }
}

TEST(DifferenceView, HeightsArePlacedByTheFieldItself) {
  protocol::View view = temperature_minus(1);
  view.geometry.height_field = "height";
  data::Dataset difference = handle(view);
  data::Dataset plain = difference.minuend();
  protocol::View undiffered = view;
  undiffered.difference.reset();
  const auto with = complete(view, difference);
  ASSERT_TRUE(with) << with.error().message;
  const auto without = complete(undiffered, plain);
  ASSERT_TRUE(without) << without.error().message;
  EXPECT_EQ(with->lattice().box_max, without->lattice().box_max);
  EXPECT_GT(with->lattice().box_max.z, 0.01) << "levels are apart";
}

TEST(DifferenceView, HeightsOfTheDatasetSubtractedPlaceNothing) {
  protocol::View view = temperature_minus(0);
  view.difference->dataset = "higher";
  view.geometry.height_field = "height";
  view.geometry.vertical = protocol::VerticalPlacement::metric;  // otherwise any rise fills the box
  const auto opened = [](double rise) {
    return data::Dataset(std::make_unique<Warming>(rise), "warming", std::uint64_t{1} << 24U);
  };
  const data::Dataset higher = opened(3000);
  data::Dataset difference = with_difference(view, opened(1000), &higher).value();
  const auto with = complete(view, difference);
  ASSERT_TRUE(with) << with.error().message;
  view.difference.reset();
  data::Dataset plain = opened(1000);  // of its own, for places are kept with the data
  const auto without = complete(view, plain);
  ASSERT_TRUE(without) << without.error().message;
  EXPECT_EQ(with->lattice().box_max, without->lattice().box_max);
  EXPECT_EQ(with->lattice().box_min, without->lattice().box_min);
}

TEST(DifferenceView, IsRefusedWhereItCannotBeShown) {
  const auto refusal = [](const protocol::View& view, data::Dataset dataset) {
    const auto full = complete(view, dataset);
    return full ? std::string() : full.error().message;
  };
  const protocol::View view = temperature_minus(0);
  protocol::View plain = view;
  plain.difference.reset();
  EXPECT_EQ(refusal(view, handle(view)), "");
  EXPECT_THAT(refusal(view, handle(plain)), HasSubstr("/difference: cannot be shown here"));
  EXPECT_THAT(refusal(plain, handle(view)), HasSubstr("/difference: is null"));
  const protocol::View beyond = temperature_minus(4);
  const data::Dataset dataset(std::make_unique<Warming>(), "warming", std::uint64_t{1} << 24U);
  const auto refused = with_difference(beyond, dataset, nullptr);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().at.front().pointer, "/difference/step");
  EXPECT_THAT(refused.error().message, HasSubstr("has steps 0 to 3"));
}

}  // namespace
}  // namespace windsplat::scene
