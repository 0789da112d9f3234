// What the command line says of surfaces that have no part in a picture.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "server/base/thread_pool.hpp"
#include "server/cli/beside/panels.hpp"
#include "server/cli/beside/sheets.hpp"

namespace windsplat::cli {
namespace {

Sheet sheet_with_isovalue(const std::string& isovalue, const std::vector<std::string>& others) {
  ViewArguments arguments;
  arguments.dataset = "tornado:16";
  arguments.settings = {"/image/width=64", "/image/height=48",
                        "/surfaces=[{\"field\": \"cloud\", \"isovalue\": " + isovalue + "}]"};
  arguments.settings.insert(arguments.settings.end(), others.begin(), others.end());
  auto panels = open_panels(arguments);
  ThreadPool pool(1);
  auto sheets = Sheets::of(panels.value(), {}, pool);
  return sheets.value().draw({}).value();
}

TEST(EmptySurface, IsNamedWithTheRangeOfItsFieldBesideOtherContent) {
  const Sheet beyond = sheet_with_isovalue("7", {});
  EXPECT_THAT(beyond.empty_surfaces,
              testing::HasSubstr("/surfaces/0/isovalue 7 is beyond the values of \"cloud\", 0 to"));
  EXPECT_EQ(beyond.empty, "");
  EXPECT_EQ(sheet_with_isovalue("0.5", {}).empty_surfaces, "");
}

TEST(EmptySurface, IsNamedOnceWhereThePictureShowsNothing) {
  const Sheet alone = sheet_with_isovalue("7", {"/scalars=[]", "/vector/field=null"});
  EXPECT_THAT(alone.empty, testing::HasSubstr("is beyond the values"));
  EXPECT_EQ(alone.empty_surfaces, "");
}

}  // namespace
}  // namespace windsplat::cli
