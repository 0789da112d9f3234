// Errors as values, escaping of text, and cancel tokens.
#include "server/base/error.hpp"

#include <gtest/gtest.h>

#include <random>
#include <stdexcept>
#include <string>
#include <utility>

#include "server/base/cancel.hpp"
#include "server/base/check.hpp"

namespace windsplat {
namespace {

Result<int> half(int number) {
  if (number % 2 != 0) return make_error_at(ErrorKind::invalid, "/number", "must be even");
  return number / 2;
}

TEST(Result, HoldsAValueOrAnError) {
  EXPECT_EQ(half(8).value(), 4);
  const auto failed = half(7);
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().kind, ErrorKind::invalid);
  EXPECT_EQ(failed.error().message, "/number: must be even");
  ASSERT_EQ(failed.error().at.size(), 1U);
  EXPECT_EQ(failed.error().at[0].pointer, "/number");
  EXPECT_EQ(failed.error().at[0].detail, "must be even");
}

TEST(Result, ValueOfAFailedResultAbortsWithTheError) {
  try {
    (void)half(7).value();
    FAIL() << "nothing was thrown";
  } catch (const std::logic_error& error) {
    EXPECT_NE(std::string(error.what()).find("/number: must be even"), std::string::npos);
  }
}

TEST(Result, TheDocumentItselfHasAnEmptyPointer) {
  const Error error = make_error_at(ErrorKind::malformed, "", "is not an object");
  EXPECT_EQ(error.message, "the document: is not an object");
  EXPECT_EQ(error.at.at(0).pointer, "");
}

TEST(Result, ForeignPointerCannotForgeTheMessage) {
  const Error error = make_error_at(ErrorKind::invalid, "/a\r\nb\x1b[31m", "unknown key");
  EXPECT_EQ(error.message, "/a\\x0d\\x0ab\\x1b[31m: unknown key");
}

TEST(Printable, KeepsTextAndEscapesControls) {
  EXPECT_EQ(printable("plain text, 12 km"), "plain text, 12 km");
  EXPECT_EQ(printable("\xce\xa9 \xe2\x82\xac \xf0\x9f\x8c\x80"),
            "\xce\xa9 \xe2\x82\xac \xf0\x9f\x8c\x80");
  EXPECT_EQ(printable("a\nb\rc\x1b[0m\x7f"), "a\\x0ab\\x0dc\\x1b[0m\\x7f");
  EXPECT_EQ(printable(std::string_view("nul\0byte", 8)), "nul\\x00byte");
  EXPECT_EQ(printable(""), "");
}

TEST(Printable, EscapesNonAsciiTerminalControls) {
  EXPECT_EQ(printable("\xc2\x9b[31m"), "\\xc2\\x9b[31m");         // C1: CSI
  EXPECT_EQ(printable("a\xe2\x80\xae b"), "a\\xe2\\x80\\xae b");  // right-to-left override
  EXPECT_EQ(printable("a\xe2\x80\xa8"
                      "b"),
            "a\\xe2\\x80\\xa8"
            "b");  // line separator
}

TEST(Printable, EscapesBytesThatAreNotUtf8) {
  EXPECT_EQ(printable("\xff"), "\\xff");
  EXPECT_EQ(printable("\xc3("), "\\xc3(");                           // truncated
  EXPECT_EQ(printable("\xc0\xaf"), "\\xc0\\xaf");                    // overlong
  EXPECT_EQ(printable("\xe0\x80\xaf"), "\\xe0\\x80\\xaf");           // overlong
  EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80");           // a surrogate
  EXPECT_EQ(printable("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");  // beyond U+10FFFF
  EXPECT_EQ(printable("ab\xe2\x82"), "ab\\xe2\\x82");                // ends inside a sequence
}

TEST(Printable, TruncatesAtWholeCharactersWithAMark) {
  EXPECT_EQ(printable("0123456789", 10), "0123456789");
  EXPECT_EQ(printable("0123456789a", 10), "0123456...");
  EXPECT_EQ(printable("aaaaaa\xe2\x82\xac\xe2\x82\xac", 10), "aaaaaa...");
  EXPECT_EQ(printable("aaaa\n\n\n", 10), "aaaa...");
  EXPECT_EQ(printable("abcdef", 2), "..");
  EXPECT_EQ(printable("abcdef", 0), "");
}

// For any input: within the limit, no control bytes, and idempotent.
TEST(Printable, InvariantsHoldForRandomBytes) {
  std::mt19937 random(7);
  for (int round = 0; round < 20000; ++round) {
    std::string text(random() % 40, '\0');
    for (char& c : text) c = static_cast<char>(random());
    const std::size_t bytes_max = random() % 60;
    const std::string out = printable(text, bytes_max);
    ASSERT_LE(out.size(), bytes_max);
    for (const char c : out) {
      ASSERT_FALSE(static_cast<unsigned char>(c) < 0x20 || c == 0x7f);
    }
    ASSERT_EQ(printable(out, bytes_max), out);
  }
}

TEST(Check, FailureNamesExpressionAndLocation) {
  EXPECT_NO_THROW(WINDSPLAT_CHECK(1 + 1 == 2));
  try {
    WINDSPLAT_CHECK(1 + 1 == 3);
    FAIL() << "nothing was thrown";
  } catch (const std::logic_error& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("1 + 1 == 3"), std::string::npos);
    EXPECT_NE(text.find("error_test.cpp:"), std::string::npos);
  }
}

TEST(CancelToken, CopiesShareTheFlagAndOthersDoNot) {
  const CancelToken token;
  CancelToken copy;
  copy = token;
  const CancelToken other;
  EXPECT_FALSE(copy.cancelled());
  token.cancel();
  EXPECT_TRUE(token.cancelled());
  EXPECT_TRUE(copy.cancelled());
  EXPECT_FALSE(other.cancelled());
}

TEST(CancelToken, MovedFromTokenRemainsUsable) {
  CancelToken token;
  const CancelToken taken = std::move(token);  // NOLINT(performance-move-const-arg)
  taken.cancel();
  EXPECT_TRUE(token.cancelled());  // NOLINT(bugprone-use-after-move): the point of the test
}

}  // namespace
}  // namespace windsplat
