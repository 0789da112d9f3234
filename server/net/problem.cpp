// Problem -> response; answers that may be tried again later say when.
#include "server/net/problem.hpp"

#include <utility>

#include "protocol/codec.hpp"

namespace windsplat::net {
namespace {

constexpr const char* retry_after_s = "1";

Response respond(const protocol::Problem& problem) {
  Response response;
  response.status = problem.status;
  response.content_type = "application/problem+json";
  response.headers = {{"Cache-Control", "no-store"}};
  if (problem.status == 429 || problem.status == 503) {
    response.headers.emplace_back("Retry-After", retry_after_s);
  }
  response.body = Body::of(protocol::encode_problem(problem));
  return response;
}

}  // namespace

Response problem_response(const Error& error) { return respond(protocol::problem_from(error)); }

Response problem_response(int status, std::string title, std::string detail) {
  protocol::Problem problem;
  problem.status = status;
  problem.title = std::move(title);
  problem.detail = std::move(detail);
  return respond(problem);
}

}  // namespace windsplat::net
