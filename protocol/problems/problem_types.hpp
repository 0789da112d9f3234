// The types of problems (RFC 9457): the one table from which documents, pages and errors come.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "server/base/error.hpp"

namespace windsplat::protocol {

struct ProblemType {
  std::string_view slug;  // its page is problems/{slug} below the base path
  int status = 500;
  std::string_view title;  // the reason phrase: RFC 9110, and the customary ones of 499 and 507
  std::string_view explanation;
};

// In the order of their status.
std::span<const ProblemType> problem_types();

// Null if there is none.
const ProblemType* find_problem_type(std::string_view slug);
const ProblemType& problem_type_of(ErrorKind kind);
// The type of errors of HTTP itself, which have no ErrorKind: the first of that status; null if
// there is none.
const ProblemType* problem_type_of_status(int status);

// The member `type` of problems that do not know the base path: a reference relative to it.
std::string problem_reference(const ProblemType& type);
// The same below a base path such as "/" or "/winds/". Other references are unchanged.
std::string resolved_type(const std::string& base_path, const std::string& type);
// An encoded problem with a type so resolved.
std::string resolved_problem(const std::string& base_path, std::string_view problem_json);

}  // namespace windsplat::protocol
