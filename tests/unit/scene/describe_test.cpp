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
    EXPECT_EQ(many.size(), data::notes_max - 1);  // one more may be on vectors
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

}  // namespace
}  // namespace windsplat::scene
