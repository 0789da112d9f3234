// Errors as answers.
#include "server/http/problem.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace windsplat::http {
namespace {

TEST(Problems, ContainARetryTimeInTheirHeader) {
  const auto retry_after = [](int seconds) {
    Error error = make_error(ErrorKind::busy, "later");
    error.retry_after_s = seconds;
    const Headers headers = problem_response(error).headers;
    const auto found = std::find_if(headers.begin(), headers.end(), [](const auto& header) {
      return header.first == "Retry-After";
    });
    return found == headers.end() ? "" : found->second;
  };
  EXPECT_EQ(retry_after(8), "8");
  EXPECT_EQ(retry_after(0), "1") << "unknown: soon";
}

}  // namespace
}  // namespace windsplat::http
