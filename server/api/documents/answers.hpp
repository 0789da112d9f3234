// The answers of operations in OpenAPI.
#pragma once

#include <vector>

#include "server/api/documents/bundle.hpp"
#include "server/api/operations/operation.hpp"

namespace windsplat::api::documents {

// status -> response: the answers of the operation, its problems, and those of every operation.
Json responses_of(const Operation& operation, bool with_token, Bundle& bundle);
// The responses and headers to which responses_of() refers, by name.
Json problem_responses(const std::vector<Operation>& operations, bool with_token, Bundle& bundle);
Json headers(bool with_token);

}  // namespace windsplat::api::documents
