#include "server/api/documents/answers.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace windsplat::api::documents {
namespace {

struct Problem {
  int status;
  const char* name;
  const char* summary;
};

constexpr std::array<Problem, 18> problems{{
    {400, "BadRequest", "The request is malformed; of JSON its detail tells where."},
    {401, "Unauthorized", "The token is absent or wrong."},
    {403, "Forbidden", "Not permitted to this client, page or server."},
    {404, "NotFound", "There is no such dataset, field, view or job."},
    {406, "NotAcceptable", "Accept permits no format that the resource has."},
    {409, "Conflict", "The data are not in memory yet, or the id is taken."},
    {411, "LengthRequired", "A body requires Content-Length."},
    {412, "PreconditionFailed", "If-Match or If-None-Match do not hold."},
    {413, "TooLarge", "More bytes, pixels or work than the limit."},
    {415, "UnsupportedMediaType", "The Content-Type is not one of the body."},
    {421, "MisdirectedRequest", "Host is not a name of this server."},
    {422, "Invalid", "Values violate limits; errors names each by its JSON pointer."},
    {426, "UpgradeRequired", "The resource is a WebSocket."},
    {429, "TooManyRequests", "The share of this client, or a queue, is full."},
    {500, "InternalError", "An error of the server; its log has the request id."},
    {501, "NotImplemented", "The body has a Transfer-Encoding: send Content-Length."},
    {503, "Unavailable", "The server is full or shutting down."},
    {507, "InsufficientStorage", "Over the limit of memory or of storage."},
}};

// Of every operation, and of those with a body.
constexpr std::array<int, 6> always{400, 403, 421, 429, 500, 503};
constexpr std::array<int, 4> with_body{411, 413, 415, 501};
constexpr std::array<int, 3> retried{409, 429, 503};
constexpr int unauthorized = 401;

const Problem& problem_of(int status) {
  const auto* const found =
      std::find_if(problems.begin(), problems.end(),
                   [&](const Problem& known) { return known.status == status; });
  if (found == problems.end()) throw std::out_of_range("status " + std::to_string(status));
  return *found;
}

struct Header {
  const char* name;
  const char* type;
  const char* summary;
  bool required = true;  // of every answer that lists it
};

constexpr std::array<Header, 14> known_headers{{
    {"X-Request-Id", "string", "Id of the request, as in the log of the server."},
    {"ETag", "string", "Tag of the content, for If-None-Match and If-Match.", false},
    {"Location", "string", "Path of the job or of what was made."},
    {"Content-Disposition", "string", "Name of the file for those who save it (RFC 6266)."},
    {"Link", "string", "Descriptions of the service (RFC 8288)."},
    {"Retry-After", "integer", "Seconds until another attempt may succeed.", false},
    {"Server-Timing", "string", "Times of queue, render and encode, milliseconds."},
    {"Windsplat-Frame", "string", "FrameInfo as JSON: method, work and error of the picture."},
    {"Windsplat-Values", "string", "Values as JSON: dimensions and axes of the array."},
    {"RateLimit", "string", "What is left of the rates of the client (structured field).", false},
    {"RateLimit-Policy", "string", "The rates of the client (structured field).", false},
    {"Vary", "string", "Headers of the request on which the answer depends."},
    {"Upgrade", "string", "The protocol: websocket."},
    {"WWW-Authenticate", "string", "How to authenticate (RFC 9110)."},
}};

Json header_reference(const char* name) {
  return {{"$ref", std::string("#/components/headers/") + name}};
}

// Of every answer.
Json common_headers() {
  Json out = Json::object();
  for (const char* name : {"X-Request-Id", "RateLimit", "RateLimit-Policy"}) {
    out[name] = header_reference(name);
  }
  return out;
}

Json problem_content(Bundle& bundle) {
  return {{"application/problem+json", {{"schema", bundle.refer("problem")}}}};
}

Json response_of(const Answer& answer, Bundle& bundle) {
  Json out{{"description", answer.summary}, {"headers", common_headers()}};
  if (answer.status == 101) out.erase("headers");
  for (const std::string_view header : answer.headers) {
    const std::string name(header);
    out["headers"][name] = header_reference(name.c_str());
  }
  for (const std::string_view media : answer.media) {
    Json content = Json::object();
    if (!answer.shape.empty()) content["schema"] = bundle.refer(std::string(answer.shape));
    out["content"][std::string(media)] = std::move(content);
  }
  return out;
}

std::vector<int> problems_of(const Operation& operation, bool with_token) {
  std::vector<int> out = operation.problems;
  out.insert(out.end(), always.begin(), always.end());
  if (operation.body) out.insert(out.end(), with_body.begin(), with_body.end());
  if (with_token && !operation.needs_no_token) out.push_back(unauthorized);
  return out;
}

}  // namespace

Json responses_of(const Operation& operation, bool with_token, Bundle& bundle) {
  std::map<std::string, Json> made;
  for (const Answer& answer : operation.answers) {
    made.emplace(std::to_string(answer.status), response_of(answer, bundle));
  }
  for (const int status : problems_of(operation, with_token)) {
    const Json reference{
        {"$ref", std::string("#/components/responses/") + problem_of(status).name}};
    const auto [at, is_new] = made.emplace(std::to_string(status), reference);
    // A status that has another meaning, too.
    if (!is_new && at->second.contains("content")) {
      at->second["content"].update(problem_content(bundle));
    }
  }
  Json out = Json::object();
  for (auto& [status, response] : made) out[status] = std::move(response);
  return out;
}

Json problem_responses(const std::vector<Operation>& operations, bool with_token, Bundle& bundle) {
  std::set<int> used;
  for (const Operation& operation : operations) {
    for (const int status : problems_of(operation, with_token)) used.insert(status);
  }
  Json out = Json::object();
  for (const Problem& problem : problems) {
    if (used.count(problem.status) == 0) continue;
    Json headers = common_headers();
    if (std::find(retried.begin(), retried.end(), problem.status) != retried.end()) {
      headers["Retry-After"] = header_reference("Retry-After");
    }
    if (problem.status == unauthorized) {
      headers["WWW-Authenticate"] = header_reference("WWW-Authenticate");
    }
    out[problem.name] = {{"description", problem.summary},
                         {"headers", std::move(headers)},
                         {"content", problem_content(bundle)}};
  }
  return out;
}

Json headers(bool with_token) {
  Json out = Json::object();
  for (const Header& header : known_headers) {
    if (header.name == std::string_view("WWW-Authenticate") && !with_token) continue;
    out[header.name] = {{"description", header.summary},
                        {"required", header.required},
                        {"schema", {{"type", header.type}}}};
  }
  return out;
}

}  // namespace windsplat::api::documents
