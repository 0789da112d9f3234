// Strict parser of Prometheus' text format: deviations from its specification are failures.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace server_test {

struct Exposition {
  std::map<std::string, std::string> types;  // family -> counter, gauge or histogram
  std::map<std::string, double> samples;     // "name{a="b"}" as it is written -> value
  std::vector<std::string> faults;           // what is wrong, with its line

  // 0 with a test failure if there is none.
  [[nodiscard]] double value(const std::string& sample) const;
  // Of a histogram, by its labels: "" or {a="b"}.
  [[nodiscard]] double count(const std::string& family, const std::string& labels) const {
    return value(family + "_count" + labels);
  }
  [[nodiscard]] std::set<std::string> families() const;
};

Exposition parse_exposition(const std::string& text);

}  // namespace server_test
