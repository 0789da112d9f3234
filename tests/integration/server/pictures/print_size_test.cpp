// The size on paper of pictures over REST: `dpi` of the formats that tell one.
#include <gmock/gmock.h>

#include <string>

#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

using testing::HasSubstr;

class PrintSize : public testing::Test {
 protected:
  [[nodiscard]] std::uint16_t port() const { return server_.port(); }
  Answer post(const std::string& query, const std::string& type) {
    return request(port(), "POST", "/v1/frames" + query,
                   {{"Content-Type", "application/json"}, {"Accept", type}},
                   R"({"dataset":"small","image":{"width":200,"height":100}})");
  }

 private:
  TestServer server_;
};

TEST_F(PrintSize, DocumentsHaveSoManyPixelsToTheInch) {
  // 200 pixels at 100 to the inch are 2 inches, at the usual 300 two thirds of one.
  EXPECT_THAT(post("?dpi=100", "image/svg+xml").body,
              HasSubstr(R"(width="2.00in" height="1.00in")"));
  EXPECT_THAT(post("", "image/svg+xml").body, HasSubstr(R"(width="0.67in")"));
  EXPECT_THAT(post("?dpi=100", "application/pdf").body, HasSubstr("144 72"));  // 1/72 inch
  const std::string path = "/v1/datasets/small/frame.svg?width=200&height=100&dpi=";
  const Answer one = get(port(), path + "100");
  EXPECT_THAT(one.body, HasSubstr(R"(width="2.00in")"));
  EXPECT_NE(one.header("etag"), get(port(), path + "200").header("etag"));
}

TEST_F(PrintSize, PngsTellThemOnlyIfAsked) {
  const std::string asked = post("?dpi=254", "image/png").body;
  const std::size_t at = asked.find("pHYs");
  ASSERT_NE(at, std::string::npos);
  // 254 to the inch are 10000 = 0x2710 to the metre.
  EXPECT_EQ(asked.substr(at + 4, 9), std::string("\0\0\x27\x10\0\0\x27\x10\x01", 9));
  EXPECT_EQ(post("", "image/png").body.find("pHYs"), std::string::npos);
}

TEST_F(PrintSize, ValuesOutOfRangeAndOtherFormatsAreRefused) {
  EXPECT_EQ(post("?dpi=9", "application/pdf").status, 422);
  EXPECT_EQ(post("?dpi=2401", "image/svg+xml").status, 422);
  const Answer jpeg = post("?dpi=100", "image/jpeg");
  EXPECT_EQ(jpeg.status, 422);
  EXPECT_THAT(jpeg.body, HasSubstr("'dpi' is of PNG, PDF and SVG"));
}

}  // namespace
}  // namespace server_test
