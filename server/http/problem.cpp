// Builds problem responses; sets Retry-After on retryable ones.
#include "server/http/problem.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "protocol/codec.hpp"
#include "protocol/problems/problem_types.hpp"
#include "server/http/request_id.hpp"

namespace windsplat::http {
namespace {

constexpr const char* problem_type = "application/problem+json";

// Whether the same request may succeed later, so that the answer says when.
bool is_temporary(const protocol::Problem& problem) {
  if (problem.status == 429 || problem.status == 503) return true;
  return problem.type ==
         protocol::problem_reference(protocol::problem_type_of(ErrorKind::not_resident));
}

Response respond(const protocol::Problem& problem, int retry_after_s) {
  Response response;
  response.status = problem.status;
  response.content_type = problem_type;
  response.headers = {{"Cache-Control", "no-store"}};
  if (is_temporary(problem)) {
    response.headers.emplace_back("Retry-After", std::to_string(std::max(1, retry_after_s)));
  }
  response.body = Body::of(protocol::encode_problem(problem));
  return response;
}

}  // namespace

Response problem_response(const Error& error) {
  return respond(protocol::problem_from(error), error.retry_after_s);
}

Response problem_response(int status, std::string title, std::string detail, int retry_after_s) {
  protocol::Problem problem;
  problem.status = status;
  if (const protocol::ProblemType* const type = protocol::problem_type_of_status(status)) {
    problem.type = protocol::problem_reference(*type);
  }
  problem.title = std::move(title);
  problem.detail = std::move(detail);
  return respond(problem, retry_after_s);
}

void name_request(Response& response, const std::string& request_id, const std::string& base_path) {
  response.headers.emplace_back(request_id_header, request_id);
  if (response.content_type != problem_type) return;
  const std::string problem(response.body.bytes.begin(), response.body.bytes.end());
  response.body = Body::of(
      protocol::with_request_id(protocol::resolved_problem(base_path, problem), request_id));
}

}  // namespace windsplat::http
