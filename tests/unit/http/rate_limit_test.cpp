// The headers RateLimit and RateLimit-Policy.
#include "server/http/rate_limit.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>

namespace windsplat::http {
namespace {

using RateHeader = std::pair<std::string, std::string>;

TEST(RateLimits, AreListsOfNamesWithParameters) {
  Response response;
  add_rate_limits(response, {});
  EXPECT_TRUE(response.headers.empty());
  add_rate_limits(
      response, {{"requests", 10000, 10, 9987, 1, ""}, {"bytes", 500, 10, 0, 12, "content-bytes"}});
  ASSERT_EQ(response.headers.size(), 2U);
  EXPECT_EQ(response.headers[0],
            RateHeader("RateLimit-Policy",
                       R"("requests";q=10000;w=10, "bytes";q=500;w=10;qu="content-bytes")"));
  EXPECT_EQ(response.headers[1],
            RateHeader("RateLimit", R"("requests";r=9987;t=1, "bytes";r=0;t=12)"));
}

}  // namespace
}  // namespace windsplat::http
