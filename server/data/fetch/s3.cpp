// Lists are scanned for the few elements that are needed instead of parsed: with
// encoding-type=url their text has no markup (Amazon S3 API reference, ListObjectsV2).
#include "server/data/fetch/s3.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <utility>

namespace windsplat::data::fetch {

namespace {

std::string variable(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

// The text of the first element `name` in `xml`, which is advanced beyond it.
std::optional<std::string_view> next_element(std::string_view& xml, std::string_view name) {
  const std::string open = '<' + std::string(name) + '>';
  const std::string close = "</" + std::string(name) + '>';
  const std::size_t from = xml.find(open);
  if (from == std::string_view::npos) return {};
  const std::size_t begin = from + open.size();
  const std::size_t end = xml.find(close, begin);
  if (end == std::string_view::npos) return {};
  const std::string_view out = xml.substr(begin, end - begin);
  xml.remove_prefix(end + close.size());
  return out;
}

std::optional<std::string_view> element_in(std::string_view xml, std::string_view name) {
  return next_element(xml, name);
}

// Continuation tokens are not encoded as URLs.
std::string without_entities(std::string_view text) {
  struct Entity {
    std::string_view name;
    char character;
  };
  constexpr auto entities = std::to_array<Entity>(
      {{"&amp;", '&'}, {"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}, {"&apos;", '\''}});
  std::string out;
  while (!text.empty()) {
    const auto* const known =
        std::find_if(entities.begin(), entities.end(),
                     [&](const Entity& one) { return text.starts_with(one.name); });
    out += known == entities.end() ? text.front() : known->character;
    text.remove_prefix(known == entities.end() ? 1 : known->name.size());
  }
  return out;
}

std::string encoded_value(std::string_view value) {
  std::string out;
  for (const char c : percent_encoded(value)) {
    if (c == '/') {
      out += "%2F";
    } else {
      out += c;
    }
  }
  return out;
}

// In encoding-type=url a '+' is a space.
std::string decoded_key(std::string_view text) {
  std::string plain(text);
  std::replace(plain.begin(), plain.end(), '+', ' ');
  return percent_decoded(plain);
}

}  // namespace

S3Key s3_key_of_environment() {
  S3Key out;
  out.id = variable("AWS_ACCESS_KEY_ID");
  out.secret = variable("AWS_SECRET_ACCESS_KEY");
  out.session_token = variable("AWS_SESSION_TOKEN");
  for (const char* name : {"AWS_REGION", "AWS_DEFAULT_REGION"}) {
    const std::string region = variable(name);
    if (region.empty()) continue;
    out.region = region;
    break;
  }
  return out;
}

Result<S3Service> s3_service(const std::string& endpoint, S3Key key) {
  const auto is_plain = [](const std::string& text, std::string_view others) {
    return std::all_of(text.begin(), text.end(), [&](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
             others.find(c) != std::string_view::npos;
    });
  };
  if (key.region.empty() || !is_plain(key.region, "-")) {
    return make_error(ErrorKind::invalid, "AWS_REGION " + in_quotes(key.region) +
                                              " is not the name of a region such as us-east-1");
  }
  if (key.id.empty() != key.secret.empty()) {
    return make_error(ErrorKind::invalid,
                      "AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY must be given together");
  }
  const auto is_visible = [](const std::string& text) {
    return std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c <= '~'; });
  };
  if (!is_plain(key.id, "-_.") || !is_visible(key.secret) || !is_visible(key.session_token)) {
    return make_error(ErrorKind::invalid, "an AWS_ variable has a character that no key has");
  }
  auto url = parse_url(endpoint.empty() ? "https://s3." + key.region + ".amazonaws.com" : endpoint);
  if (!url || url->scheme == "s3") {
    return make_error(ErrorKind::invalid, "--s3-endpoint " + in_quotes(without_secrets(endpoint)) +
                                              " is not a URL such as https://s3.example");
  }
  while (url->path.ends_with('/')) url->path.pop_back();
  return S3Service{std::move(*url), std::move(key)};
}

Url S3Service::url_of(const Url& object) const {
  Url out = endpoint;
  out.path += '/' + object.host + object.path;
  return out;
}

Url S3Service::bucket_of(const Url& object) const {
  Url out = endpoint;
  out.path += '/' + object.host;
  return out;
}

std::string list_query(std::string_view prefix, std::string_view continuation) {
  std::string out;
  if (!continuation.empty()) out += "continuation-token=" + encoded_value(continuation) + '&';
  return out + "delimiter=%2F&encoding-type=url&list-type=2&prefix=" + encoded_value(prefix);
}

std::optional<ListedPage> parse_list(std::string_view xml, std::string_view prefix) {
  const std::size_t begin = xml.find("<ListBucketResult");
  if (begin == std::string_view::npos ||
      xml.find("</ListBucketResult>") == std::string_view::npos) {
    return {};
  }
  xml.remove_prefix(begin);
  ListedPage out;
  const auto add = [&](std::string_view text) {
    const std::string key = decoded_key(text);
    constexpr std::size_t key_bytes_max = 1024;  // of S3
    if (!key.starts_with(prefix) || key.size() > key_bytes_max) return false;
    if (key.size() > prefix.size()) out.names.push_back(key.substr(prefix.size()));
    return true;
  };
  std::string_view rest = xml;
  while (const auto contents = next_element(rest, "Contents")) {
    const auto key = element_in(*contents, "Key");
    if (!key || !add(*key)) return {};
  }
  rest = xml;
  while (const auto folder = next_element(rest, "CommonPrefixes")) {
    const auto name = element_in(*folder, "Prefix");
    if (!name || !add(*name)) return {};
  }
  if (element_in(xml, "IsTruncated") == "true") {
    const auto next = element_in(xml, "NextContinuationToken");
    if (!next || next->empty()) return {};
    out.continuation = without_entities(*next);
  }
  return out;
}

}  // namespace windsplat::data::fetch
