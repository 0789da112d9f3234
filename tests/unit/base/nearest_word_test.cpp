// Suggestions for misspelt words.
#include "server/base/nearest_word.hpp"

#include <gtest/gtest.h>

namespace windsplat {
namespace {

TEST(NearestWord, CountsChangesAdditionsRemovalsAndSwaps) {
  EXPECT_EQ(letters_between("size", "size"), 0U);
  EXPECT_EQ(letters_between("stpe", "step"), 1U);
  EXPECT_EQ(letters_between("sze", "size"), 1U);
  EXPECT_EQ(letters_between("sizes", "size"), 1U);
  EXPECT_EQ(letters_between("side", "size"), 1U);
  EXPECT_EQ(letters_between("", "size"), 4U);
}

TEST(NearestWord, IsTheNearestOfTheKnownWithinTwoLettersAndHalfOfTheWord) {
  const std::vector<std::string> known{"step", "stride", "steps", "r1"};
  EXPECT_EQ(nearest_word("stepz", known), "step");
  EXPECT_EQ(nearest_word("stirde", known), "stride");
  EXPECT_EQ(nearest_word("banana", known), "");
  EXPECT_EQ(nearest_word("r2", known), "") << "half of a word of two letters";
  EXPECT_EQ(nearest_word(std::string(100, 's'), known), "");
  EXPECT_EQ(did_you_mean("stpe", known), "; did you mean 'step'?");
  EXPECT_EQ(did_you_mean("banana", known), "");
}

}  // namespace
}  // namespace windsplat
