// A small header must not make notes without bound.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "server/data/model/dataset_info.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

TEST(ManyNotes, ThoseOnHowDataAreShownStay) {
  std::vector<std::string> notes;
  for (int n = 0; n < 300; ++n) notes.push_back("of the file " + std::to_string(n));
  notes.emplace_back("levels are placed by 'z'");
  bound_notes(300, notes);
  ASSERT_EQ(notes.size(), notes_of_data_max);
  EXPECT_EQ(notes[147], "of the file 147");
  EXPECT_EQ(notes[148], "levels are placed by 'z'");
  EXPECT_EQ(notes[149], "152 more notes");
}

TEST(ManyNotes, AreBoundedAndCounted) {
  constexpr int vectors = 300;
  const Folder folder;
  {
    NetcdfMaker file(folder / "a.nc", 0);
    const int y = file.dimension("y", 2);
    const int x = file.dimension("x", 2);
    for (int n = 0; n < vectors; ++n) {
      const std::string number = std::to_string(n);
      file.text(file.variable("u" + number, NC_FLOAT, {y, x}, counting(4)), "units", "m s-1");
      file.text(file.variable("v" + number, NC_FLOAT, {y, x}, counting(4)), "units", "knots");
    }
  }
  const auto source = opened(folder / "a.nc");
  const auto& notes = source->info().notes;
  EXPECT_EQ(std::count_if(notes.begin(), notes.end(),
                          [](const std::string& note) {
                            return note.find("is converted from knots") != std::string::npos;
                          }),
            40);
  // One note for each pair, of which 40 are told.
  EXPECT_TRUE(has_note(source->info(), "260 more notes on components of vectors"));
  EXPECT_NE(source->info().find("wind_vector_299"), nullptr) << "all 300 vectors are there";
  EXPECT_EQ(source->info().find("wind_vector_300"), nullptr);
}

}  // namespace
}  // namespace windsplat::data::test
