// The table of problem types, and its document.
#include "protocol/problems/problem_types.hpp"

#include <gmock/gmock.h>

#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <string_view>

namespace windsplat::protocol {
namespace {

TEST(ProblemTypes, AreNamedOnceInOrderOfTheirStatus) {
  std::set<std::string_view> slugs;
  int before = 400;
  for (const ProblemType& type : problem_types()) {
    EXPECT_TRUE(slugs.insert(type.slug).second) << type.slug;
    EXPECT_EQ(type.slug.find_first_not_of("abcdefghijklmnopqrstuvwxyz-"), std::string_view::npos);
    EXPECT_GE(type.status, before) << type.slug;
    EXPECT_LT(type.status, 600) << type.slug;
    EXPECT_FALSE(type.title.empty()) << type.slug;
    EXPECT_EQ(type.explanation.back(), '.') << type.slug;
    EXPECT_EQ(type.explanation.find_first_of("<>&|"), std::string_view::npos)
        << "it is a part of HTML and of a table";
    EXPECT_EQ(find_problem_type(type.slug), &type);
    before = type.status;
  }
  EXPECT_EQ(find_problem_type("invalid"), nullptr);
  EXPECT_EQ(problem_type_of_status(418), nullptr);
  EXPECT_EQ(problem_type_of_status(429)->slug, "rate-limited");
  EXPECT_EQ(problem_type_of(ErrorKind::busy).slug, "busy");
}

TEST(ProblemTypes, EachHasItsRowInTheDocument) {
  std::ifstream file(WINDSPLAT_SOURCE_DIR "/docs/user/problems.md");
  const std::string document((std::istreambuf_iterator<char>(file)), {});
  std::size_t rows = 0;
  for (std::size_t at = document.find("\n| `"); at != std::string::npos; ++rows) {
    at = document.find("\n| `", at + 1);
  }
  EXPECT_EQ(rows, problem_types().size());
  for (const ProblemType& type : problem_types()) {
    const std::string row = "| `" + std::string(type.slug) + "` | " + std::to_string(type.status) +
                            " " + std::string(type.title) + " | " + std::string(type.explanation) +
                            " |";
    EXPECT_THAT(document, testing::HasSubstr(row));
  }
}

TEST(ProblemTypes, ReferencesAreResolvedBelowTheBasePath) {
  EXPECT_EQ(problem_reference(problem_type_of(ErrorKind::too_large)), "problems/too-large");
  EXPECT_EQ(resolved_type("/winds/", "problems/busy"), "/winds/problems/busy");
  EXPECT_EQ(resolved_type("/winds/", "about:blank"), "about:blank");
  EXPECT_EQ(resolved_problem("/", R"({"detail":"\"type\":\"problems/x\"","type":"problems/busy"})"),
            R"({"detail":"\"type\":\"problems/x\"","type":"/problems/busy"})");
  EXPECT_EQ(resolved_problem("/", R"({"type":"about:blank"})"), R"({"type":"about:blank"})");
}

}  // namespace
}  // namespace windsplat::protocol
