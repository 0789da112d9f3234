// Numbers of code tables -> names.
#include "server/data/formats/grib/products.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string_view>

namespace windsplat::data::grib {

namespace {

struct Statistic {
  std::string_view name;
  std::string_view words;
  bool linear;
};

// In the order of code table 4.10, named as stepType of ecCodes.
constexpr auto over_time = std::to_array<Statistic>({{"avg", "average over time", true},
                                                     {"accum", "accumulation over time", true},
                                                     {"max", "maximum over time", false},
                                                     {"min", "minimum over time", false},
                                                     {"diff", "difference, end minus start", true},
                                                     {"rms", "root mean square over time", false},
                                                     {"sd", "standard deviation over time", false},
                                                     {"cov", "covariance over time", false},
                                                     {"sdiff", "difference, start minus end", true},
                                                     {"ratio", "ratio over time", false},
                                                     {"stdanom", "standardized anomaly", false},
                                                     {"sum", "sum over time", true}});

// In the order of code table 4.7.
constexpr auto over_members = std::to_array<Statistic>(
    {{"mean", "mean of the members", true},
     {"weighted_mean", "weighted mean of the members", true},
     {"cluster_sd", "standard deviation of the cluster", false},
     {"normalized_sd", "normalized standard deviation of the cluster", false},
     {"spread", "spread of the members", false},
     {"anomaly", "large anomaly index of the members", false},
     {"cluster_mean", "mean of the members of the cluster", true},
     {"iqr", "interquartile range of the members", false},
     {"lowest", "minimum of the members", false},
     {"highest", "maximum of the members", false},
     {"variance", "variance of the members", false}});

void add(Product& product, const Statistic& found) {
  product.suffix += (product.suffix.empty() ? "" : "_") + std::string(found.name);
  product.words += (product.words.empty() ? "" : ", ") + std::string(found.words);
  product.linear = product.linear && found.linear;
  product.key += std::string(found.name) + ";";
}

template <class Table>
void add_numbered(Product& product, const Table& table, long number, const std::string& otherwise) {
  if (number >= 0 && number < static_cast<long>(table.size())) {
    return add(product, table[static_cast<std::size_t>(number)]);
  }
  const std::string name = otherwise + std::to_string(number);
  add(product, {name, name, false});
}

double limit(const Message& message, const std::string& which) {
  const double value = message.number(("scaledValueOf" + which + "Limit").c_str());
  const double factor = message.number(("scaleFactorOf" + which + "Limit").c_str());
  return value * std::pow(10, -factor);
}

// Code table 4.9.
void add_probability(Product& product, const Message& message, long type) {
  const auto shown = [](double value) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.6g", value);
    return std::string(text.data());
  };
  const std::string lower = shown(limit(message, "Lower"));
  const std::string upper = shown(limit(message, "Upper"));
  std::string words = "probability of type " + std::to_string(type);
  if (type == 0) words = "probability below " + lower;
  if (type == 1) words = "probability above " + upper;
  if (type == 2) words = "probability between " + lower + " and " + upper;
  if (type == 3) words = "probability above " + lower;
  if (type == 4) words = "probability below " + upper;
  add(product, {"prob", words, false});
  product.key += words + ";";
}

void find_2(const Message& message, Product& out) {
  const long derived = message.whole("derivedForecast", -1);
  if (derived >= 0) add_numbered(out, over_members, derived, "derived");
  const long percentile = message.whole("percentileValue", -1);
  if (percentile >= 0) {
    const std::string number = std::to_string(percentile);
    add(out, {"p" + number, "percentile " + number, false});
  }
  const long probability = message.whole("probabilityType", -1);
  if (probability >= 0) add_probability(out, message, probability);
  const long process = message.whole("typeOfStatisticalProcessing", -1);
  constexpr long missing = 255;
  if (process >= 0 && process != missing) add_numbered(out, over_time, process, "statistic");
}

void find_1(const Message& message, Product& out) {
  const std::string type = message.text("dataType");
  if (type == "em") add(out, over_members[0]);
  if (type == "es") add(out, over_members[4]);
  const std::string step = message.text("stepType");
  if (step.empty() || step == "instant" || step == "unknown") return;
  const auto known = std::find_if(over_time.begin(), over_time.end(),
                                  [&](const Statistic& one) { return one.name == step; });
  if (known != over_time.end()) return add(out, *known);
  add(out, {step, "statistic " + step, step.starts_with("avg")});
}

}  // namespace

Product read_product(const Message& message) {
  Product out;
  message.whole("edition", 2) == 1 ? find_1(message, out) : find_2(message, out);
  return out;
}

}  // namespace windsplat::data::grib
