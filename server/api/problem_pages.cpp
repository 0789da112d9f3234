// The pages of problem types, to which the member `type` of problems refers.
#include <array>
#include <string>
#include <string_view>

#include "protocol/problems/problem_types.hpp"
#include "server/api/resources.hpp"
#include "server/http/cors.hpp"
#include "server/http/negotiate.hpp"
#include "server/http/problem.hpp"

namespace windsplat::api {
namespace {

using protocol::ProblemType;

std::string heading_of(const ProblemType& type) {
  return std::string(type.slug) + ": " + std::to_string(type.status) + ' ' +
         std::string(type.title);
}

bool wants_html(const http::Request& request) {
  constexpr std::array<std::string_view, 2> offers{"text/plain", "text/html"};
  return http::choose_type(request.header("Accept"), offers) == 1U;
}

http::Response page_of(const http::Request& request, const std::string& title,
                       const std::string& text, const std::string& html) {
  const bool as_html = wants_html(request);
  http::Response response;
  response.headers = {{"Cache-Control", "public, max-age=3600"}};
  http::add_vary(response, "Accept");
  response.content_type = as_html ? "text/html; charset=utf-8" : "text/plain; charset=utf-8";
  response.body = http::Body::of(
      as_html
          ? "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\">"
            "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\"><title>" +
                title + "</title></head><body><h1>" + title + "</h1>" + html + "</body></html>\n"
          : title + "\n\n" + text);
  return response;
}

}  // namespace

// Neither the table nor a base path has characters that HTML escapes.
http::Response get_problem_types(const std::string& base_path, const http::Request& request) {
  std::string text;
  std::string html = "<dl>";
  for (const ProblemType& type : protocol::problem_types()) {
    const std::string heading = heading_of(type);
    const std::string path = base_path + protocol::problem_reference(type);
    text.append(heading).append("\n  ").append(type.explanation).append("\n\n");
    html.append("<dt><a href=\"").append(path).append("\">").append(heading);
    html.append("</a></dt><dd>").append(type.explanation).append("</dd>");
  }
  return page_of(request, "Problem types of windsplat", text, html + "</dl>");
}

http::Response get_problem_type(const std::string& base_path, const std::string& slug,
                                const http::Request& request) {
  const ProblemType* const type = protocol::find_problem_type(slug);
  if (type == nullptr) {
    return http::problem_response(make_error(ErrorKind::not_found, "unknown problem type"));
  }
  const std::string explanation(type->explanation);
  const std::string all = base_path + "problems";
  return page_of(request, heading_of(*type), explanation + "\n\nAll types: " + all + "\n",
                 "<p>" + explanation + "</p><p><a href=\"" + all + "\">All problem types</a></p>");
}

}  // namespace windsplat::api
