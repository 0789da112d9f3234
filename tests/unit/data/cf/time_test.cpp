// CF calendars compared with dates that can be verified by hand or in an almanac.
#include "server/data/cf/time.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <optional>
#include <vector>

namespace windsplat::data::cf {
namespace {

std::string text_of(double value, const std::string& units, const std::string& calendar = "") {
  const DecodedTime time = decode_time({value}, units, calendar);
  EXPECT_EQ(time.reason, "") << units;
  return time.steps.at(0).text;
}

std::string reason_of(double value, const std::string& units, const std::string& calendar = "") {
  const DecodedTime time = decode_time({value}, units, calendar);
  EXPECT_EQ(time.steps.at(0).text, number_text(value)) << units;
  EXPECT_EQ(time.steps.at(0).value, value);
  return time.reason;
}

TEST(CfTime, HoursAndFractionsOfDays) {
  EXPECT_EQ(text_of(3, "hours since 2001-01-01 00:00:00"), "2001-01-01T03:00:00Z");
  EXPECT_EQ(text_of(0.125, "days since 2001-01-01"), "2001-01-01T03:00:00Z");
  EXPECT_EQ(text_of(-0.25, "days since 2001-01-01"), "2000-12-31T18:00:00Z");
  EXPECT_EQ(text_of(90, "minutes since 2001-01-01 22:45"), "2001-01-02T00:15:00Z");
  EXPECT_EQ(text_of(1, "seconds since 1999-12-31 23:59:59"), "2000-01-01T00:00:00Z");
  EXPECT_EQ(text_of(1500, "msec since 2001-01-01"), "2001-01-01T00:00:01.500Z");
  EXPECT_EQ(text_of(0.0625, "s since 2001-01-01"), "2001-01-01T00:00:00.063Z");
}

TEST(CfTime, AThirdOfADayIsWholeHours) {
  // 1/3 has no exact double; the text must not read 07:59:59.999.
  EXPECT_EQ(text_of(1.0 / 3.0, "days since 2001-01-01"), "2001-01-01T08:00:00Z");
  EXPECT_EQ(text_of(73000 + 2.0 / 3.0, "days since 1800-01-01"), "1999-11-14T16:00:00Z");
}

TEST(CfTime, LeapYearsOfTheGregorianCalendar) {
  for (const char* calendar : {"", "standard", "gregorian", "proleptic_gregorian", "Gregorian"}) {
    EXPECT_EQ(text_of(59, "days since 2000-01-01", calendar), "2000-02-29T00:00:00Z");
    EXPECT_EQ(text_of(59, "days since 1900-01-01", calendar), "1900-03-01T00:00:00Z");
    EXPECT_EQ(text_of(59, "days since 2001-01-01", calendar), "2001-03-01T00:00:00Z");
    EXPECT_EQ(text_of(366, "days since 2004-01-01", calendar), "2005-01-01T00:00:00Z");
    // Unix time 1e9 was reached on 9 September 2001 at 01:46:40.
    EXPECT_EQ(text_of(1e9, "seconds since 1970-01-01", calendar), "2001-09-09T01:46:40Z");
    // 24107 days lie between the first days of 1900 and 1966: 66 * 365 + 16 leap days + 1.
    EXPECT_EQ(text_of(24107, "days since 1900-01-01", calendar), "1966-01-02T00:00:00Z");
  }
}

TEST(CfTime, GregorianReformOf1582) {
  EXPECT_EQ(text_of(1, "days since 1582-10-04", "standard"), "1582-10-15T00:00:00Z");
  EXPECT_EQ(text_of(-1, "days since 1582-10-15", "gregorian"), "1582-10-04T00:00:00Z");
  EXPECT_EQ(text_of(1, "days since 1582-10-04", "proleptic_gregorian"), "1582-10-05T00:00:00Z");
  EXPECT_EQ(text_of(1, "days since 1582-10-04", "julian"), "1582-10-05T00:00:00Z");
  EXPECT_NE(reason_of(0, "days since 1582-10-10", "standard"), "");
  // Julian day 0 is noon of 1 January 4713 BC (year -4712); day 2451545 is noon of 2000-01-01.
  EXPECT_EQ(text_of(2451545, "days since -4712-01-01 12:00:00", "standard"),
            "2000-01-01T12:00:00Z");
}

TEST(CfTime, JulianCalendar) {
  // 1900 is a Julian leap year, and the two calendars are then 12 days apart, 13 afterwards.
  EXPECT_EQ(text_of(59, "days since 1900-01-01", "julian"), "1900-02-29T00:00:00Z");
  EXPECT_EQ(
      day_number({2000, 1, 14}, Calendar::proleptic_gregorian) -
          day_number({1582, 10, 15}, Calendar::proleptic_gregorian),
      day_number({2000, 1, 1}, Calendar::julian) - day_number({1582, 10, 5}, Calendar::julian));
}

TEST(CfTime, NoLeap) {
  for (const char* calendar : {"noleap", "365_day"}) {
    EXPECT_EQ(text_of(1, "days since 2000-02-28", calendar), "2000-03-01T00:00:00Z");
    EXPECT_EQ(text_of(365, "days since 2000-01-01", calendar), "2001-01-01T00:00:00Z");
    EXPECT_NE(reason_of(0, "days since 2000-02-29", calendar), "");
  }
}

TEST(CfTime, AllLeap) {
  for (const char* calendar : {"all_leap", "366_day"}) {
    EXPECT_EQ(text_of(1, "days since 2001-02-28", calendar), "2001-02-29T00:00:00Z");
    EXPECT_EQ(text_of(366, "days since 2001-01-01", calendar), "2002-01-01T00:00:00Z");
  }
}

TEST(CfTime, MonthsOfThirtyDays) {
  EXPECT_EQ(text_of(30, "days since 2000-01-30", "360_day"), "2000-02-30T00:00:00Z");
  EXPECT_EQ(text_of(1, "days since 2000-12-30", "360_day"), "2001-01-01T00:00:00Z");
  EXPECT_EQ(text_of(359, "days since 2000-01-01", "360_day"), "2000-12-30T00:00:00Z");
  EXPECT_EQ(text_of(-1, "days since 2000-03-01", "360_day"), "2000-02-30T00:00:00Z");
  EXPECT_NE(reason_of(0, "days since 2000-01-31", "360_day"), "");
}

TEST(CfTime, EveryDayOfEightCenturiesFollowsThePrevious) {
  for (const Calendar calendar :
       {Calendar::standard, Calendar::proleptic_gregorian, Calendar::julian, Calendar::noleap,
        Calendar::all_leap, Calendar::day360}) {
    std::int64_t number = day_number({-401, 1, 1}, calendar);
    Date before = date_of(number - 1, calendar);
    EXPECT_EQ(before.year, -402);
    for (int i = 0; i < 800 * 366; ++i, ++number) {
      const Date date = date_of(number, calendar);
      ASSERT_TRUE(is_valid(date, calendar));
      ASSERT_EQ(day_number(date, calendar), number);
      const bool same_month = date.year == before.year && date.month == before.month;
      ASSERT_TRUE(same_month ? date.day == before.day + 1 : date.day == 1)
          << date.year << ' ' << date.month << ' ' << date.day;
      before = date;
    }
  }
}

TEST(CfTime, MonthsAndYearsFollowTheCalendar) {
  EXPECT_EQ(text_of(5, "months since 2001-01-01", ""), "2001-06-01T00:00:00Z");
  EXPECT_EQ(text_of(-1, "months since 2001-01-15 06:00", ""), "2000-12-15T06:00:00Z");
  EXPECT_EQ(text_of(1, "months since 2000-01-31", ""), "2000-02-29T00:00:00Z");
  EXPECT_EQ(text_of(1, "months since 2001-01-31", "noleap"), "2001-02-28T00:00:00Z");
  EXPECT_EQ(text_of(1, "months since 2001-01-30", "360_day"), "2001-02-30T00:00:00Z");
  EXPECT_EQ(text_of(3, "years since 2001-02-28 12:00", ""), "2004-02-28T12:00:00Z");
  // A fraction is that of its month: half of February's 28 days; half a year is six months.
  EXPECT_EQ(text_of(1.5, "months since 2001-01-01", ""), "2001-02-15T00:00:00Z");
  EXPECT_EQ(text_of(0.5, "years since 2001-01-01", ""), "2001-07-01T00:00:00Z");
  EXPECT_NE(reason_of(1e300, "months since 2001-01-01"), "");
}

TEST(CfTime, TimesInOtherUnits) {
  using Times = std::optional<std::vector<double>>;
  // 6 hours after 3 January is 2.25 days after the 1st; the offset of 2 hours east of UTC is
  // subtracted.
  EXPECT_EQ(convert_times({6, 30}, {"hours since 2001-01-03", ""}, {"days since 2001-01-01", ""}),
            (Times{{2.25, 3.25}}));
  EXPECT_EQ(convert_times({6}, {"hours since 2001-01-03 00:00 +2", ""},
                          {"hours since 2001-01-01", "gregorian"}),
            (Times{{52}}));
  EXPECT_EQ(convert_times({60}, {"days since 2000-01-01", "noleap"},
                          {"days since 2000-02-01", "365_day"}),
            (Times{{29}}));
  EXPECT_EQ(convert_times({7}, {"Month", ""}, {"Month", ""}), (Times{{7}}));
  EXPECT_EQ(convert_times({1}, {"days since 2000-01-01", "proleptic_gregorian"},
                          {"days since 1999-01-01", ""}),
            (Times{{366}}));
  EXPECT_FALSE(
      convert_times({1}, {"days since 2000-01-01", "noleap"}, {"days since 1999-01-01", ""}));
  EXPECT_FALSE(convert_times({1}, {"days since 1400-01-01", "proleptic_gregorian"},
                             {"days since 1400-01-01", "standard"}));
  EXPECT_FALSE(convert_times({1}, {"days since 2000-01-01", ""}, {"Month", ""}));
}

TEST(CfTime, SpellingsOfTheEpoch) {
  for (const char* epoch :
       {"2001-02-03 04:05:06", "2001-02-03T04:05:06Z", "2001-2-3 4:5:6", "2001-02-03 04:05:06.0",
        "2001-02-03 04:05:06 UTC", "2001-02-03 06:35:06 +2:30", "2001-02-03 06:35:06 +0230",
        "2001-02-02 23:05:06 -5", "  2001-02-03 04:05:06  "}) {
    EXPECT_EQ(text_of(0, std::string("hours since ") + epoch), "2001-02-03T04:05:06Z") << epoch;
  }
  EXPECT_EQ(text_of(0, "Days Since 2001-02-03"), "2001-02-03T00:00:00Z");
  EXPECT_EQ(text_of(0, "days since 0001-01-01"), "0001-01-01T00:00:00Z");
  EXPECT_EQ(text_of(0, "days since 1-1-1 00:00:0.0"), "0001-01-01T00:00:00Z");
  EXPECT_EQ(text_of(-1, "days since 0000-01-01", "noleap"), "-0001-12-31T00:00:00Z");
  EXPECT_EQ(text_of(1, "days since 9999-12-31"), "+10000-01-01T00:00:00Z");
}

TEST(CfTime, ElapsedTimeKeepsAllDigits) {
  for (const char* units : {"s", "hours", "days"}) {
    EXPECT_EQ(reason_of(5, units), "") << units;
    EXPECT_EQ(decode_time({5}, units, "").steps.at(0).text, "5") << units;
  }
}

TEST(CfTime, UnknownUnitsKeepTheNumberWithAReason) {
  for (const char* units :
       {"", "Month", "day as %Y%m%d.%f", "days since", "days since yesterday", "days since 2001",
        "days since 2001-13-01", "days since 2001-02-30", "days since 2001-01-01 25:00",
        "days since 2001-01-01 00:61", "fortnights since 2001-01-01", "days since 99999999-01-01",
        "days since 2001-01-01 +99"}) {
    EXPECT_NE(reason_of(5, units), "") << units;
  }
  EXPECT_NE(reason_of(5, "days since 2001-01-01", "martian"), "");
  EXPECT_NE(reason_of(1e300, "days since 2001-01-01"), "");
  EXPECT_NE(reason_of(-4e17, "msec since 2001-01-01"), "");
}

TEST(CfTime, NumbersAreReadBackExactly) {
  for (const double value : {0.1, 1.0 / 3.0, 1e22, -12345678.875}) {
    EXPECT_EQ(std::stod(number_text(value)), value);
  }
  EXPECT_EQ(number_text(12), "12");
}

}  // namespace
}  // namespace windsplat::data::cf
