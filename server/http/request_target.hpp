// Decodes a request target and validates its query parameters.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"
#include "server/http/exchange.hpp"

namespace windsplat::http {

// Normalises to "/" or "/a/b/".
std::string normal_base_path(std::string_view path);

// Fills path, below_base, ends_in_slash and query. Accepts origin form, and absolute form that
// names the request's Host. Errors: malformed.
Result<void> parse_target(std::string_view target, std::string_view base_path, Request& request);

// Reads parameters one by one; finish() rejects unknown ones, listing the known, and repeated ones.
class QueryReader {
 public:
  explicit QueryReader(const Parameters& query) : query_(query) {}

  std::optional<std::string> text(std::string_view key);
  std::optional<double> number(std::string_view key, double min, double max);
  std::optional<bool> boolean(std::string_view key);  // true, 1, false or 0
  std::optional<std::array<double, 2>> pair(std::string_view key, double min, double max);  // "a,b"
  // An integer as text; the parser of the view checks its range.
  std::optional<std::string> integer(std::string_view key);
  std::optional<int> integer(std::string_view key, int min, int max);

  // Errors: malformed (unknown, repeated, not a number), invalid (out of range).
  Result<void> finish() const;

 private:
  const std::string* find(std::string_view key);
  [[nodiscard]] std::string known() const;
  void fail_range(std::string_view key, double min, double max, std::string_view text);
  void fail(ErrorKind kind, std::string message);

  const Parameters& query_;
  std::vector<std::string_view> asked_;
  std::optional<Error> fault_;  // the first
};

}  // namespace windsplat::http
