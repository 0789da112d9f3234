// The fields and media that a view shows by default.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "server/scene/completed_view.hpp"
#include "server/scene/lattice.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {
namespace {

using protocol::View;

// As the colours of a map, which values of the field determine, wherever it hides no lines.
TEST(CompleteView, MediaOfASliceAreOpaqueUnlessLinesAreAmongThem) {
  auto climate = sample_dataset("climate", {24, 16, 12});
  const auto least = [&](const View& view) {
    double out = 1e300;
    const auto full = complete(view, *climate);
    const double layer = cell_size(full->lattice(), 2);
    for (const auto& [value, extinction] : full->view().scalars->front().extinction.value()) {
      out = std::min(out, extinction * layer);
    }
    return out;  // optical depth through the layer
  };
  View view;
  view.vector.field.kind = protocol::FieldChoice::Kind::none;
  EXPECT_EQ(least(view), 0) << "the volume shows its dense parts";
  view.geometry.slice = protocol::SliceView{protocol::GridAxis::z, 4};
  EXPECT_GT(least(view), 5);
  view.vector.field.kind = protocol::FieldChoice::Kind::dataset_default;
  EXPECT_EQ(least(view), 0);
  view.vector.combine = protocol::LineCombination::either;
  EXPECT_GT(least(view), 5) << "lines are laid over the medium";
}

// The magnitude of (m/s, m/s, Pa/s) means nothing.
TEST(CompleteView, AVectorOfOneUnitIsPreferredToTheOneThatItConverts) {
  data::FieldInfo wind = wind_info("Pa s-1");
  data::FieldInfo stress = wind_info();
  stress.name = "stress";
  stress.components = {"tx", "ty", "tz"};
  data::FieldInfo converted = wind_info();
  converted.name = "wind_m";
  converted.components.back() = "w(omega)";
  const auto chosen = [](std::vector<data::FieldInfo> fields) {
    auto dataset =
        dataset_of(std::make_unique<FakeSource>(atmosphere_grid(), std::move(fields), 1));
    return complete(View{}, *dataset)->view().vector.field.name;
  };
  EXPECT_EQ(chosen({wind, stress, converted}), "wind_m");
  EXPECT_EQ(chosen({wind, stress}), "wind");
  EXPECT_EQ(chosen({stress, wind, converted}), "stress");
}

}  // namespace
}  // namespace windsplat::scene
