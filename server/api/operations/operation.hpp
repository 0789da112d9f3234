// What the documents of the API say of a route: its query parameters, body and answers. The router
// and the handlers read the query by the same parameters, so that documents and behaviour agree.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"
#include "server/http/request_target.hpp"

namespace windsplat::api {

enum class ParameterKind {
  text,
  number,
  integer,
  boolean,  // true, 1, false or 0
  pair,     // two numbers "a,b"
  choice,   // one of `values`
  indices,  // three integers "i,j,k"
  names     // "a,b": names separated by commas
};

// A query parameter. All texts outlive it.
struct Parameter {
  std::string_view name;
  ParameterKind kind = ParameterKind::text;
  std::string_view summary;
  double min = 0;  // of a number, of both of a pair, and of an integer
  double max = 0;
  std::string_view fallback = {};               // value without the parameter, as JSON
  std::array<std::string_view, 4> values = {};  // of a choice; empty ones count for nothing
  bool required = false;
};

// The value of a parameter within its limits; nullopt if absent or refused. Errors are those of
// QueryReader::finish().
std::optional<std::string> read_text(http::QueryReader& query, const Parameter& parameter);
std::optional<double> read_number(http::QueryReader& query, const Parameter& parameter);
std::optional<int> read_integer(http::QueryReader& query, const Parameter& parameter);
// The same with a lower limit that follows from the data.
std::optional<int> read_integer(http::QueryReader& query, const Parameter& parameter, int max);
std::optional<bool> read_boolean(http::QueryReader& query, const Parameter& parameter);
std::optional<std::array<double, 2>> read_pair(http::QueryReader& query,
                                               const Parameter& parameter);

using MediaTypes = std::vector<std::string_view>;
inline constexpr std::string_view json_media = "application/json";

// Names of shapes: keys of $defs in protocol/messages.schema.json; "view": protocol/
// view.schema.json; "object": any JSON object; empty: not JSON.
struct RequestBody {
  std::string_view shape;
  MediaTypes media;
  std::string_view summary;
};

struct Answer {
  int status = 200;
  std::string_view summary;
  std::string_view shape = {};
  MediaTypes media = {};                       // empty: no body
  std::vector<std::string_view> headers = {};  // besides those of every answer (headers.cpp)
};

struct Operation {
  std::string_view id = {};       // unique, for generators of clients
  std::string_view group = {};    // heading under which documents list it
  std::string_view summary = {};  // one line without a full stop
  std::string_view description = {};
  std::vector<Parameter> query = {};
  std::optional<RequestBody> body = std::nullopt;
  std::vector<Answer> answers = {};
  // Statuses of application/problem+json besides those of every operation, and of every one with a
  // body (problems.cpp).
  std::vector<int> problems = {};
  bool any_query = false;  // other parameters are ignored
  bool deprecated = false;
  bool needs_no_token = false;  // see access::needs_no_token()
};

// Refuses repeated parameters and those that the operation does not have. Errors: malformed.
Result<void> check_query(const Operation& operation, const http::Parameters& query);

}  // namespace windsplat::api
