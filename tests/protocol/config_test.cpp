// The format of the configuration file, and the pointers of its errors.
#include "protocol/config.hpp"

#include <gmock/gmock.h>

namespace windsplat::protocol {
namespace {

using ::testing::HasSubstr;
using Kind = ConfigEntry::Kind;

TEST(Config, HoldsTextsNumbersBooleansAndLists) {
  const auto config = parse_config(
      R"({"listen": "[::1]:80", "max-sessions": 5, "rate": 1e3, "share": 0.25, "allow-remote": true,
          "allow-origin": ["https://a.example", "https://b.example"], "none": [], "off": false})");
  ASSERT_TRUE(config) << config.error().message;
  std::map<std::string, ConfigEntry> entries;
  for (const ConfigEntry& entry : config->entries) entries[entry.key] = entry;
  ASSERT_EQ(entries.size(), 8U);
  const auto expect = [&](const char* key, Kind kind, const std::vector<std::string>& words) {
    EXPECT_EQ(entries[key].kind, kind) << key;
    EXPECT_EQ(entries[key].words, words) << key;
  };
  expect("listen", Kind::text, {"[::1]:80"});
  expect("max-sessions", Kind::number, {"5"});
  expect("rate", Kind::number, {"1000"});
  expect("share", Kind::number, {"0.25"});
  expect("allow-remote", Kind::boolean, {"true"});
  expect("off", Kind::boolean, {"false"});
  expect("allow-origin", Kind::list, {"https://a.example", "https://b.example"});
  expect("none", Kind::list, {});
  EXPECT_TRUE(parse_config("{}")->entries.empty());
}

TEST(Config, RefusesWithAPointer) {
  struct Case {
    std::string text;
    std::string pointer;
    ErrorKind kind = ErrorKind::invalid;
  };
  for (const Case& c : {
           Case{"[]", ""},
           Case{"null", ""},
           Case{R"({"listen": null})", "/listen"},
           Case{R"({"a/b~": {}})", "/a~1b~0"},
           Case{R"({"allow-origin": ["a", 1]})", "/allow-origin/1"},
           Case{R"({"allow-origin": [["a"]]})", "/allow-origin/0"},
           Case{R"({"listen": "a\nb"})", "/listen"},
           Case{R"({"listen": "a\u0000b"})", "/listen"},
           Case{"{\"listen\": \"" + std::string(4097, 'x') + "\"}", "/listen"},
           Case{R"({"n": 1e999})", "/n"},
           Case{R"({"listen": "a", "listen": "b"})", "/listen", ErrorKind::malformed},
           Case{R"({"listen": "a",})", "", ErrorKind::malformed},
           Case{"", "", ErrorKind::malformed},
           Case{"\xef\xbb\xbf{}", "", ErrorKind::malformed},
       }) {
    SCOPED_TRACE(c.text.substr(0, 60));
    const auto config = parse_config(c.text);
    ASSERT_FALSE(config);
    EXPECT_EQ(config.error().kind, c.kind);
    ASSERT_FALSE(config.error().at.empty());
    EXPECT_EQ(config.error().at.front().pointer, c.pointer) << config.error().message;
  }
}

TEST(Config, HasTheLimitsOfEveryDocument) {
  std::string list = "{\"a\": [";
  for (int i = 0; i < 257; ++i) list += i == 0 ? "\"x\"" : ",\"x\"";
  EXPECT_FALSE(parse_config(list + "]}"));
  const auto large = parse_config("{\"a\": \"" + std::string(70000, 'x') + "\"}");
  ASSERT_FALSE(large);
  EXPECT_EQ(large.error().kind, ErrorKind::too_large);
  const auto deep = parse_config(std::string(40, '[') + std::string(40, ']'));
  ASSERT_FALSE(deep);
  EXPECT_THAT(deep.error().message, HasSubstr("32 levels"));
}

TEST(Config, ReportsEveryInvalidValue) {
  const auto config = parse_config(R"({"a": null, "b": 1, "c": {}})");
  ASSERT_FALSE(config);
  ASSERT_EQ(config.error().at.size(), 2U);
  EXPECT_EQ(config.error().at[1].pointer, "/c");
}

}  // namespace
}  // namespace windsplat::protocol
