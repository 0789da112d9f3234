// Which sites may show the page in a frame.
#include "server/http/framing.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace windsplat::http {
namespace {

TEST(Framing, EmbeddersAreOriginsOfHttp) {
  for (const char* const good :
       {"https://a.example", "http://localhost:8080", "https://*.b.example:8443", "http://10.0.0.1",
        "https://a_b-c.example:65535"}) {
    EXPECT_TRUE(is_embedder(good)) << good;
  }
  for (const char* const bad :
       {"", "a.example", "https://", "https://*", "https://a.example/", "https://a.example/page",
        "https://a.example:", "https://a.example:0", "https://a.example:65536",
        "https://a.example:80x", "ftp://a.example", "https://.example", "https://*.*.example",
        "https://a.example; script-src *", "https://a.example\r\nX: y", "*", "'self'"}) {
    EXPECT_FALSE(is_embedder(bad)) << bad;
  }
}

TEST(Framing, ThePolicyNamesThePageItselfAndEveryEmbedder) {
  EXPECT_EQ(frame_ancestors({}), "frame-ancestors 'self'");
  EXPECT_EQ(frame_ancestors({"https://a.example", "http://localhost:8080"}),
            "frame-ancestors 'self' https://a.example http://localhost:8080");
}

TEST(Framing, AFrameIsToldByTheDestinationAndTheEmbeddedViewByTheQuery) {
  for (const char* const into : {"iframe", "frame", "embed", "object"}) {
    Request request;
    request.headers.emplace_back("Sec-Fetch-Dest", into);
    EXPECT_TRUE(is_in_frame(request)) << into;
  }
  for (const char* const into : {"document", "empty", "iframes", ""}) {
    Request request;
    request.headers.emplace_back("Sec-Fetch-Dest", into);
    EXPECT_FALSE(is_in_frame(request)) << into;
  }
  Request request;
  EXPECT_FALSE(is_in_frame(request));
  EXPECT_FALSE(asks_embedded(request));
  request.query = {{"embedded", "1"}};
  EXPECT_FALSE(asks_embedded(request));
  request.query = {{"dataset", "a"}, {"embed", ""}};
  EXPECT_TRUE(asks_embedded(request));
}

}  // namespace
}  // namespace windsplat::http
