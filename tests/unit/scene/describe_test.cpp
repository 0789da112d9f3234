// Descriptions of datasets of which many fields cannot be read.
#include "server/scene/describe.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {
namespace {

using testing::HasSubstr;

// Scalars of which none can be read, with notes of the file.
class DamagedSource final : public data::Source {
 public:
  DamagedSource(int fields, int notes) {
    info_.id = "damaged";
    info_.grid = atmosphere_grid();
    info_.steps.push_back({0, "0"});
    for (int n = 0; n < fields; ++n) {
      info_.fields.push_back(scalar_info("f" + std::to_string(n), "K"));
    }
    for (int n = 0; n < notes; ++n) info_.notes.push_back("note " + std::to_string(n));
  }
  [[nodiscard]] const data::DatasetInfo& info() const override { return info_; }
  Result<data::Volume> read(std::size_t /*field*/, std::size_t /*step*/) override {
    return make_error(ErrorKind::bad_data, "damaged");
  }

 private:
  data::DatasetInfo info_;
};

std::vector<std::string> notes_of(int fields, int notes) {
  const auto dataset = dataset_of(std::make_unique<DamagedSource>(fields, notes));
  auto described = describe(*dataset, RangesOf::first_step);
  EXPECT_TRUE(described) << described.error().message;
  return described ? std::move(described->notes) : std::vector<std::string>();
}

TEST(Descriptions, ListUnknownRangesUpToABoundAndCountTheRest) {
  const auto few = notes_of(5, 3);
  ASSERT_GE(few.size(), 8U);
  EXPECT_EQ(few[2], "note 2");
  EXPECT_THAT(few[3], HasSubstr("the range of 'f0' is not known: "));
  EXPECT_THAT(few[7], HasSubstr("the range of 'f4' is not known: "));
  for (const int notes : {0, 150}) {
    const auto many = notes_of(400, notes);
    EXPECT_EQ(many.size(), data::notes_max - 2);  // two more may be on what is not shown
    std::size_t listed = 0;
    std::string rest;
    for (const std::string& note : many) {
      listed += note.starts_with("the range of ") ? 1 : 0;
      if (note.starts_with("the ranges of ")) rest = note;
    }
    EXPECT_EQ(rest, "the ranges of " + std::to_string(400 - listed) + " more fields are not known");
    if (notes > 0) {
      EXPECT_EQ(many[149], "note 149");
    }
  }
}

// Uniform values of the fields.
class EvenSource final : public data::Source {
 public:
  explicit EvenSource(std::vector<data::FieldInfo> fields) {
    info_.id = "even";
    info_.grid = atmosphere_grid();
    info_.fields = std::move(fields);
    info_.steps = {{0, "0"}};
  }
  [[nodiscard]] const data::DatasetInfo& info() const override { return info_; }
  Result<data::Volume> read(std::size_t field, std::size_t /*step*/) override {
    data::Volume out;
    out.dims = info_.grid.dims();
    out.components = static_cast<int>(info_.fields[field].components.size());
    out.values = std::vector<float>(out.samples() * info_.fields[field].components.size(), 5);
    out.range = {5, 5};
    return out;
  }

 private:
  data::DatasetInfo info_;
};

TEST(Descriptions, NameScalarsThatTheDefaultViewLeavesOut) {
  data::FieldInfo wind = scalar_info("wind", "m s-1");
  wind.kind = data::FieldKind::vector;
  wind.components = {"u", "v"};
  wind.component_units = {"m s-1", "m s-1"};
  const data::FieldInfo u = scalar_info("u", "m s-1");
  const data::FieldInfo share = scalar_info("mixture", "1");
  const data::FieldInfo cloud = scalar_info("cloud", "1");
  const auto note = [](std::vector<data::FieldInfo> fields) {
    const auto dataset = dataset_of(std::make_unique<EvenSource>(std::move(fields)));
    const auto described = describe(*dataset, RangesOf::first_step);
    EXPECT_TRUE(described) << described.error().message;
    for (const std::string& one : described->notes) {
      if (one.starts_with("the default view shows vectors only")) return one;
    }
    return std::string();
  };
  EXPECT_EQ(note({wind, u, share}),
            "the default view shows vectors only: /scalars shows 'mixture'");
  EXPECT_EQ(note({wind, u}), "");
  EXPECT_EQ(note({wind, share, cloud}), "");
  EXPECT_EQ(note({share}), "");
}

}  // namespace
}  // namespace windsplat::scene
