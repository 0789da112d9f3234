// The shared vectors, checked by the codec and by the schemas.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "protocol/codec.hpp"
#include "support.hpp"

namespace windsplat::protocol::testing {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

std::vector<std::string> complaints_about(const Vector& vector) {
  const Json document = Json::parse(vector.text());
  if (vector.body.contains("shape")) {
    return schema_complaints("messages.schema.json",
                             "#/$defs/" + vector.body["shape"].get<std::string>(), document);
  }
  if (vector.kind() == "view") return schema_complaints("view.schema.json", "", document);
  return schema_complaints("messages.schema.json", "#/$defs/" + vector.kind(), document);
}

TEST(Vectors, EveryValidDocumentPassesItsSchema) {
  for (const Vector& vector : read_vectors("valid")) {
    if (vector.kind() == "frameHeader") continue;
    EXPECT_THAT(complaints_about(vector), IsEmpty()) << vector.name();
  }
}

TEST(Vectors, EveryInvalidDocumentFailsItsSchemaAtItsPointer) {
  for (const Vector& vector : read_vectors("invalid")) {
    if (vector.kind() == "frameHeader" || !vector.body.value("schema", true)) continue;
    std::string pointer = vector.body.at("pointer");
    for (const auto& [escaped, plain] :
         std::map<std::string, std::string>{{"~0", "~"}, {"~1", "/"}}) {
      const auto at = pointer.find(escaped);
      if (at != std::string::npos) pointer.replace(at, 2, plain);
    }
    EXPECT_THAT(complaints_about(vector), Contains(HasSubstr(pointer + ": "))) << vector.name();
  }
}

TEST(Vectors, CodecAcceptsEveryValidView) {
  for (const Vector& vector : read_vectors("valid")) {
    if (vector.kind() != "view") continue;
    const auto document = ViewDocument::parse(vector.text());
    ASSERT_TRUE(document.has_value()) << vector.name() << ": " << document.error().message;
    if (vector.body.contains("canonical")) {
      EXPECT_EQ(document->canonical(), vector.body["canonical"]) << vector.name();
    }
    EXPECT_THAT(schema_complaints("view.schema.json", "", Json::parse(document->canonical())),
                IsEmpty())
        << vector.name();
  }
}

TEST(Vectors, CodecAcceptsEveryValidClientMessage) {
  for (const Vector& vector : read_vectors("valid")) {
    if (vector.kind() != "clientMessage") continue;
    const auto message = parse_client_message(vector.text());
    EXPECT_TRUE(message.has_value()) << vector.name() << ": " << message.error().message;
  }
}

void expect_refusal(const Vector& vector, const Error& error) {
  EXPECT_EQ(status_of(error), vector.body.at("status").get<int>())
      << vector.name() << ": " << error.message;
  ASSERT_FALSE(error.at.empty()) << vector.name() << ": " << error.message;
  EXPECT_EQ(error.at.front().pointer, vector.body.at("pointer").get<std::string>())
      << vector.name() << ": " << error.message;
  EXPECT_FALSE(error.at.front().detail.empty()) << vector.name();
  EXPECT_THAT(error.message, HasSubstr(error.at.front().detail)) << vector.name();
}

TEST(Vectors, CodecRefusesEveryInvalidViewAtItsPointer) {
  for (const Vector& vector : read_vectors("invalid")) {
    if (vector.kind() != "view") continue;
    const auto document = ViewDocument::parse(vector.text());
    ASSERT_FALSE(document.has_value()) << vector.name();
    expect_refusal(vector, document.error());
  }
}

TEST(Vectors, CodecRefusesEveryInvalidClientMessageAtItsPointer) {
  for (const Vector& vector : read_vectors("invalid")) {
    if (vector.kind() != "clientMessage") continue;
    const auto message = parse_client_message(vector.text());
    ASSERT_FALSE(message.has_value()) << vector.name();
    expect_refusal(vector, message.error());
  }
}

TEST(Vectors, EveryKindIsReadByATest) {
  for (const char* folder : {"valid", "invalid"}) {
    for (const Vector& vector : read_vectors(folder)) {
      EXPECT_THAT(
          (std::vector<std::string>{"view", "clientMessage", "serverMessage", "frameHeader"}),
          Contains(vector.kind()))
          << vector.name();
    }
  }
}

}  // namespace
}  // namespace windsplat::protocol::testing
