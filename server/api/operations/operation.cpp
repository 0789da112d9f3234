#include "server/api/operations/operation.hpp"

#include <algorithm>

namespace windsplat::api {

std::optional<std::string> read_text(http::QueryReader& query, const Parameter& parameter) {
  return query.text(parameter.name);
}

std::optional<double> read_number(http::QueryReader& query, const Parameter& parameter) {
  return query.number(parameter.name, parameter.min, parameter.max);
}

std::optional<int> read_integer(http::QueryReader& query, const Parameter& parameter) {
  return read_integer(query, parameter, static_cast<int>(parameter.max));
}

std::optional<int> read_integer(http::QueryReader& query, const Parameter& parameter, int max) {
  return query.integer(parameter.name, static_cast<int>(parameter.min),
                       std::min(max, static_cast<int>(parameter.max)));
}

std::optional<bool> read_boolean(http::QueryReader& query, const Parameter& parameter) {
  return query.boolean(parameter.name);
}

std::optional<std::array<double, 2>> read_pair(http::QueryReader& query,
                                               const Parameter& parameter) {
  return query.pair(parameter.name, parameter.min, parameter.max);
}

Result<void> check_query(const Operation& operation, const http::Parameters& query) {
  if (operation.any_query) return {};
  http::QueryReader reader(query);
  for (const Parameter& parameter : operation.query) (void)reader.text(parameter.name);
  return reader.finish();
}

}  // namespace windsplat::api
