// URLs and lists of S3 services (Amazon S3 API reference, ListObjectsV2).
#include "server/data/fetch/s3.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace windsplat::data::fetch {
namespace {

using testing::ElementsAre;

S3Key key(const std::string& id, const std::string& secret, const std::string& token = "",
          const std::string& region = "us-east-1") {
  return {id, secret, token, region};
}

TEST(S3Urls, ObjectsAreAddressedInPathStyle) {
  const Url object = parse_url("s3://bucket/runs/a%20b.zarr").value();
  const auto amazon = s3_service("", key("", "", "", "eu-central-1"));
  ASSERT_TRUE(amazon) << amazon.error().message;
  EXPECT_EQ(amazon->url_of(object).text(),
            "https://s3.eu-central-1.amazonaws.com/bucket/runs/a%20b.zarr");
  const auto own = s3_service("http://127.0.0.1:9000/storage/", {});
  ASSERT_TRUE(own) << own.error().message;
  EXPECT_EQ(own->url_of(object).text(), "http://127.0.0.1:9000/storage/bucket/runs/a%20b.zarr");
  EXPECT_EQ(own->bucket_of(object).text(), "http://127.0.0.1:9000/storage/bucket");
}

TEST(S3Urls, FaultySettingsAreRefused) {
  EXPECT_FALSE(s3_service("s3://bucket", {}));
  EXPECT_FALSE(s3_service("", key("", "", "", "eu/../x")));
  EXPECT_FALSE(s3_service("", key("a", "")));
  EXPECT_FALSE(s3_service("", key("a:b", "c")));
  EXPECT_FALSE(s3_service("", key("a", "c", "x\r\nHost: evil")));
}

TEST(S3Lists, QueriesAreSortedAndEncoded) {
  EXPECT_EQ(list_query("", ""), "delimiter=%2F&encoding-type=url&list-type=2&prefix=");
  EXPECT_EQ(list_query("a b/c/", "1+/="),
            "continuation-token=1%2B%2F%3D&delimiter=%2F&encoding-type=url&list-type=2&"
            "prefix=a%20b%2Fc%2F");
}

TEST(S3Lists, NamesAreThoseBelowThePrefix) {
  const std::string xml =
      "<?xml version=\"1.0\"?><ListBucketResult xmlns=\"http://s3.amazonaws.com/doc/2006-03-01/\">"
      "<Name>bucket</Name><Prefix>runs/</Prefix><IsTruncated>true</IsTruncated>"
      "<NextContinuationToken>a&amp;b</NextContinuationToken>"
      "<Contents><Key>runs/</Key><Size>0</Size></Contents>"
      "<Contents><Key>runs/.zgroup</Key><Size>24</Size></Contents>"
      "<Contents><Key>runs/a+b%2B%C3%A4</Key></Contents>"
      "<CommonPrefixes><Prefix>runs/u/</Prefix></CommonPrefixes></ListBucketResult>";
  const auto page = parse_list(xml, "runs/");
  ASSERT_TRUE(page);
  EXPECT_THAT(page->names, ElementsAre(".zgroup", "a b+\xC3\xA4", "u/"));
  EXPECT_EQ(page->continuation, "a&b");
}

TEST(S3Lists, AnswersThatAreNoListAreRefused) {
  EXPECT_FALSE(parse_list("", ""));
  EXPECT_FALSE(parse_list("<Error><Code>AccessDenied</Code></Error>", ""));
  EXPECT_FALSE(parse_list("<ListBucketResult><Contents><Key>a</Key></Contents>", "")) << "cut off";
  EXPECT_FALSE(parse_list(
      "<ListBucketResult><Contents><Key>other/a</Key></Contents></ListBucketResult>", "runs/"));
  EXPECT_FALSE(parse_list("<ListBucketResult><Contents></Contents></ListBucketResult>", ""));
  for (const std::size_t length : {1024U, 1025U}) {
    EXPECT_EQ(parse_list("<ListBucketResult><Contents><Key>" + std::string(length, 'a') +
                             "</Key></Contents></ListBucketResult>",
                         "")
                  .has_value(),
              length <= 1024)
        << "longer than a key of S3";
  }
  EXPECT_FALSE(
      parse_list("<ListBucketResult><IsTruncated>true</IsTruncated></ListBucketResult>", ""));
}

}  // namespace
}  // namespace windsplat::data::fetch
