// Saved views as responses and as files, and invalid view ids.
#include "protocol/saved_view.hpp"

#include <gtest/gtest.h>

#include <string>

#include "protocol/limits.hpp"
#include "support.hpp"

namespace windsplat::protocol::testing {
namespace {

SavedView sample() {
  return {"0a1b2c3d4e", "2001-01-01T03:00:00Z",
          ViewDocument::parse(R"({"vector":{"field":null},"step":2.0,"dataset":"t"})").value()};
}

TEST(SavedViews, AnswerHasItsShapeAndTheCanonicalView) {
  for (const char* kept : {"memory", "disk"}) {
    expect_shape("savedView", encode_saved_view(sample(), kept));
    EXPECT_EQ(Json::parse(encode_saved_view(sample(), kept))["kept"], kept);
  }
  EXPECT_NE(encode_saved_view(sample(), "disk")
                .find(R"("view":{"dataset":"t","step":2,"vector":{"field":null}})"),
            std::string::npos);
}

TEST(SavedViews, FileIsReadBackAsWritten) {
  const auto read = parse_view_file(encode_view_file(sample()));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->id, sample().id);
  EXPECT_EQ(read->created, sample().created);
  EXPECT_EQ(read->view.canonical(), sample().view.canonical());
}

TEST(SavedViews, FilesWithOtherContentAreRefused) {
  const Json good = Json::parse(encode_view_file(sample()));
  ASSERT_TRUE(parse_view_file(good.dump()));
  for (const char* key : {"id", "created", "view"}) {
    Json lacking = good;
    lacking.erase(key);
    EXPECT_FALSE(parse_view_file(lacking.dump())) << key;
    lacking[key] = 7;
    EXPECT_FALSE(parse_view_file(lacking.dump())) << key;
    lacking[key] = nullptr;
    EXPECT_FALSE(parse_view_file(lacking.dump())) << key;
  }
  for (const auto& [key, value] :
       std::initializer_list<std::pair<const char*, Json>>{{"id", "../../../x"},
                                                           {"created", "yesterday"},
                                                           {"created", "2001-01-01T03:00:00Zx"},
                                                           {"created", "2001-01-01T03:00:00"},
                                                           {"view", {{"step", -1}}},
                                                           {"view", {{"colour", 1}}},
                                                           {"owner", "me"}}) {
    Json bad = good;
    bad[key] = value;
    EXPECT_FALSE(parse_view_file(bad.dump())) << key << ' ' << value;
  }
  const std::string text = good.dump();
  for (std::size_t length = 0; length < text.size(); ++length) {
    EXPECT_FALSE(parse_view_file(text.substr(0, length))) << length;
  }
}

TEST(SavedViews, IdsAreTenLettersOfBase32) {
  EXPECT_EQ(view_id_letters.size(), 32U);
  EXPECT_TRUE(is_view_id("0123456789"));
  EXPECT_TRUE(is_view_id("zyxwvtsrqp"));
  for (const char* other :
       {"", "012345678", "01234567890", "012345678i", "012345678l", "012345678o", "012345678u",
        "012345678A", "../../../x", "0123/56789", "012345678."}) {
    EXPECT_FALSE(is_view_id(other)) << other;
  }
  EXPECT_FALSE(is_view_id(std::string_view("012345678\0", 10)));
}

// A view with the maximum length of every list, name and number is stored completely.
TEST(SavedViews, LongestViewFitsAFile) {
  std::string name;
  for (std::size_t i = 0; i < limits::name_chars_max; ++i) name += "\xf0\x9f\x8c\x80";
  constexpr double longest = -1.2345678901234567e-29;
  Json scalar{{"field", name}, {"color", {{"map", name}, {"range", {longest, -longest}}}}};
  for (int i = 0; i < limits::extinction_points_max; ++i) {
    scalar["extinction"].push_back({i + 0.12345678901234567, -longest});
  }
  Json view = Json::parse(encode_view(View{}));
  view["dataset"] = view["vector"]["field"] = view["vector"]["color"]["map"] = name;
  view["vector"]["color"]["field"] = view["geometry"]["heightField"] = name;
  view["scalars"] = Json::array();
  for (int i = 0; i < limits::scalars_max; ++i) {
    std::string other = name;
    other.replace(0, 4, std::string(1, static_cast<char>('a' + i)));
    scalar["field"] = other;
    view["scalars"].push_back(scalar);
  }
  const auto document = ViewDocument::parse(view.dump());
  ASSERT_TRUE(document) << document.error().message;
  const std::string file = encode_view_file({"0a1b2c3d4e", "2001-01-01T03:00:00Z", *document});
  EXPECT_LT(2 * file.size(), limits::message_bytes_max);
  EXPECT_TRUE(parse_view_file(file));
}

}  // namespace
}  // namespace windsplat::protocol::testing
