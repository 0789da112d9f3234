// Shared by the protocol tests: files of the protocol folder, vectors, and a validator for the
// subset of JSON Schema used by the project.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"

namespace windsplat::protocol::testing {

using Json = nlohmann::json;

std::string read_protocol_file(const std::string& name);  // fails the test if it cannot be read
Json read_protocol_json(const std::string& name);

std::string bytes_from_hex(std::string_view hex);  // spaces are skipped

struct Vector {
  std::string file;
  Json body;
  [[nodiscard]] std::string kind() const { return body.at("kind"); }
  [[nodiscard]] std::string name() const;
  [[nodiscard]] std::string text() const;  // the document as a client would send it
};
std::vector<Vector> read_vectors(const std::string& folder);  // "valid" or "invalid"

// Errors of the schema at `pointer` ("" or "#/$defs/...") of `file` for a document; empty if valid.
// An unknown schema keyword is an error, so that none is ignored.
std::vector<std::string> schema_complaints(const std::string& file, const std::string& pointer,
                                           const Json& document);

// Fails the test unless `json` has that shape of messages.schema.json.
void expect_shape(const std::string& shape, const std::string& json);

// pointer + "/" + key.
std::string under(const std::string& pointer, const std::string& key);

int status_of(const Error& error);

}  // namespace windsplat::protocol::testing
