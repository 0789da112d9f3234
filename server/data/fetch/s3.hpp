// Files of an S3 service: s3://BUCKET/KEY -> the URL of an endpoint, and lists of keys.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/fetch/http_client.hpp"
#include "server/data/files/url.hpp"

namespace windsplat::data::fetch {

struct S3Service {
  Url endpoint;  // https or http, with the path "/" or a prefix without a final '/'
  S3Key key;

  // The URL of an object in path style: ENDPOINT/BUCKET/KEY.
  [[nodiscard]] Url url_of(const Url& object) const;
  // The URL of a bucket, for lists.
  [[nodiscard]] Url bucket_of(const Url& object) const;
};

// `endpoint`: empty for that of Amazon in the key's region. Errors: invalid.
Result<S3Service> s3_service(const std::string& endpoint, S3Key key);
// The key in AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY, AWS_SESSION_TOKEN, AWS_REGION or
// AWS_DEFAULT_REGION.
S3Key s3_key_of_environment();

// The query of ListObjectsV2 for the entries directly below `prefix`, which is empty or ends in
// '/'; `continuation` is empty for the first page.
std::string list_query(std::string_view prefix, std::string_view continuation);

struct ListedPage {
  std::vector<std::string> names;  // without the prefix; folders end in '/'
  std::string continuation;        // of the next page; empty: this is the last one
};
// Parses an answer of ListObjectsV2 with encoding-type=url. Empty: not such an answer.
std::optional<ListedPage> parse_list(std::string_view xml, std::string_view prefix);

}  // namespace windsplat::data::fetch
