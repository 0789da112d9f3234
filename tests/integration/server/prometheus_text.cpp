// Line by line, then the invariants of histograms.
#include "tests/integration/server/prometheus_text.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <regex>
#include <sstream>

namespace server_test {

namespace {

const char* const name_pattern = "[a-zA-Z_:][a-zA-Z0-9_:]*";

// The family of a sample name, if declared.
std::optional<std::string> family_of(const Exposition& read, const std::string& name) {
  if (read.types.count(name) > 0 && read.types.at(name) != "histogram") return name;
  for (const std::string suffix : {"_bucket", "_sum", "_count"}) {
    if (name.size() <= suffix.size() || !name.ends_with(suffix)) continue;
    const std::string family = name.substr(0, name.size() - suffix.size());
    if (read.types.count(family) > 0 && read.types.at(family) == "histogram") return family;
  }
  return std::nullopt;
}

std::optional<double> number_of(const std::string& text) {
  if (text == "+Inf") return std::numeric_limits<double>::infinity();
  if (text == "Nan" || text == "NaN") return std::nan("");
  std::size_t used = 0;
  try {
    const double value = std::stod(text, &used);
    if (used == text.size()) return value;
  } catch (const std::exception&) {
    return std::nullopt;
  }
  return std::nullopt;
}

class Reader {
 public:
  Exposition read(const std::string& text) {
    if (text.empty() || text.back() != '\n') fault("the last line has no end");
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) read_line(line);
    for (const auto& [series, buckets] : buckets_) check_buckets(series, buckets);
    return std::move(out_);
  }

 private:
  struct Buckets {
    std::string family;
    std::string labels;
    std::vector<std::pair<double, double>> bounds;
  };

  void fault(const std::string& what) { out_.faults.push_back(what); }

  void read_line(const std::string& line) {
    static const std::regex help("# HELP (" + std::string(name_pattern) + ") ([^\\n]+)");
    static const std::regex type("# TYPE (" + std::string(name_pattern) +
                                 ") (counter|gauge|histogram)");
    std::smatch found;
    if (std::regex_match(line, found, help)) {
      if (!helped_.insert(found[1]).second) fault("told twice: " + line);
    } else if (std::regex_match(line, found, type)) {
      if (helped_.count(found[1]) == 0) fault("no HELP: " + line);
      if (!out_.types.emplace(found[1], found[2]).second) fault("told twice: " + line);
      family_ = found[1];
    } else {
      read_sample(line);
    }
  }

  void read_sample(const std::string& line) {
    static const std::regex sample(
        "(" + std::string(name_pattern) +
        R"()(\{(?:[a-zA-Z_][a-zA-Z0-9_]*="(?:[^"\\]|\\[\\n"])*",?)+\})? (\S+))");
    std::smatch found;
    if (!std::regex_match(line, found, sample)) return fault("no sample: " + line);
    const std::string name = found[1];
    const std::string labels = found[2];
    const auto family = family_of(out_, name);
    if (!family) return fault("of no family: " + line);
    if (*family != family_) fault("not below its family: " + line);
    const auto value = number_of(found[3]);
    if (!value) return fault("no number: " + line);
    if (out_.types[*family] != "gauge" && !(*value >= 0)) fault("below 0: " + line);
    if (!out_.samples.emplace(name + labels, *value).second) fault("told twice: " + line);
    if (name == *family + "_bucket") note_bucket(*family, labels, *value, line);
  }

  void note_bucket(const std::string& family, const std::string& labels, double value,
                   const std::string& line) {
    static const std::regex bound(R"(,?le="([^"]+)\")");
    std::smatch found;
    if (!std::regex_search(labels, found, bound)) return fault("no le: " + line);
    const auto le = number_of(found[1]);
    if (!le) return fault("no bound: " + line);
    std::string rest = found.prefix().str() + found.suffix().str();
    if (rest == "{}") rest.clear();
    Buckets& buckets = buckets_[family + rest];
    buckets.family = family;
    buckets.labels = rest;
    buckets.bounds.emplace_back(*le, value);
  }

  void check_buckets(const std::string& series, const Buckets& buckets) {
    for (std::size_t i = 1; i < buckets.bounds.size(); ++i) {
      if (buckets.bounds[i].first <= buckets.bounds[i - 1].first) fault("bounds of " + series);
      if (buckets.bounds[i].second < buckets.bounds[i - 1].second) fault("counts of " + series);
    }
    if (!std::isinf(buckets.bounds.back().first)) fault("no +Inf: " + series);
    const auto count = out_.samples.find(buckets.family + "_count" + buckets.labels);
    if (count == out_.samples.end() || count->second != buckets.bounds.back().second) {
      fault("_count of " + series);
    }
    if (out_.samples.count(buckets.family + "_sum" + buckets.labels) == 0) {
      fault("_sum of " + series);
    }
  }

  Exposition out_;
  std::string family_;
  std::set<std::string> helped_;
  std::map<std::string, Buckets> buckets_;
};

}  // namespace

double Exposition::value(const std::string& sample) const {
  const auto found = samples.find(sample);
  if (found == samples.end()) {
    ADD_FAILURE() << "no sample " << sample;
    return 0;
  }
  return found->second;
}

std::set<std::string> Exposition::families() const {
  std::set<std::string> names;
  for (const auto& [name, type] : types) names.insert(name);
  return names;
}

Exposition parse_exposition(const std::string& text) { return Reader().read(text); }

}  // namespace server_test
