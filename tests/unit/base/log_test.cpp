// Log lines: one event is one line whatever it contains, in text and in JSON.
#include "server/base/log.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <string>

namespace windsplat::log {
namespace {

TEST(Log, TextLineHasAMessageAndPairs) {
  EXPECT_EQ(text_line("listening", {}), "listening");
  EXPECT_EQ(text_line("frame", {{"ms", 12.5}, {"session", "a1"}, {"final", true}, {"seq", 3}}),
            "frame ms=12.5 session=a1 final=true seq=3");
  EXPECT_EQ(text_line("opened", {{"title", "two words"}, {"empty", ""}}),
            "opened title=\"two words\" empty=\"\"");
}

TEST(Log, TextLineCannotBeForged) {
  EXPECT_EQ(text_line("bad\nname", {{"name", "x\r\n2026 error forged"}}),
            R"(bad\x0aname name="x\\x0d\\x0a2026 error forged")");
  EXPECT_EQ(text_line("m", {{"name", "a\" ok=\"1"}}), R"(m name="a\" ok=\"1")");
}

TEST(Log, JsonLineIsOneObject) {
  EXPECT_EQ(json_line("2026-01-02T03:04:05.678Z", Level::warn, "slow",
                      {{"ms", 12.5},
                       {"who", "a\"b\\c\n"},
                       {"n", std::uint64_t{18446744073709551615U}},
                       {"final", false}}),
            R"({"time":"2026-01-02T03:04:05.678Z","level":"warn","message":"slow","ms":12.5,)"
            R"("who":"a\"b\\c\\x0a","n":18446744073709551615,"final":false})");
}

TEST(Log, NonFiniteNumbersAreText) {
  EXPECT_EQ(json_line("t", Level::info, "m", {{"x", std::numeric_limits<double>::infinity()}}),
            R"({"time":"t","level":"info","message":"m","x":"inf"})");
}

TEST(Log, LongValuesAreTruncated) {
  const std::string line = text_line("m", {{"value", std::string(10000, 'x')}});
  EXPECT_LT(line.size(), 500U);
  EXPECT_EQ(line.substr(line.size() - 3), "...");
}

TEST(Log, LevelsHaveNames) {
  EXPECT_EQ(parse_level("debug"), Level::debug);
  EXPECT_EQ(parse_level("off"), Level::off);
  EXPECT_FALSE(parse_level("loud").has_value());
}

TEST(Log, WritesToStderrFromItsLevelUp) {
  testing::internal::CaptureStderr();
  configure(Format::json, Level::warn);
  info("not this", {});
  warn("but this", {{"n", 1}});
  configure(Format::text, Level::info);
  info("and this", {});
  debug("nor this", {});
  const std::string text = testing::internal::GetCapturedStderr();
  EXPECT_EQ(text.find("not this"), std::string::npos);
  EXPECT_EQ(text.find("nor this"), std::string::npos);
  EXPECT_NE(text.find(R"("level":"warn","message":"but this","n":1})"), std::string::npos);
  EXPECT_NE(text.find("and this\n"), std::string::npos);
}

}  // namespace
}  // namespace windsplat::log
