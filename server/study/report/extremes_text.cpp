// Results of the extreme cases -> lines.
#include "server/study/report/extremes_text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "server/study/extremes/cases.hpp"
#include "server/study/report/report.hpp"

namespace windsplat::study {

namespace {

std::string number_or_nothing(double value) {
  return std::isnan(value) ? "" : format_number("%.6g", value);
}

std::string flag(bool value) { return value ? "1" : "0"; }

std::string where(const CaseResult& one) {
  return one.group + " " + one.label + ", " + one.method + ", " + one.projection;
}

std::string faults(const CaseResult& one) {
  if (!one.message.empty()) return one.message;
  std::string text;
  const auto add = [&text](const std::string& fault) {
    text += (text.empty() ? "" : "; ") + fault;
  };
  if (!one.verdict.finite) add("not finite");
  if (!one.verdict.bounded) add("outside [0, 1]");
  if (!one.verdict.monotone.value_or(true)) add("opacity decreases");
  if (!one.verdict.honest) {
    std::string errors = one.measured ? "measured error " : "bound of the estimate ";
    errors += format_number("%.1e", one.measured.value_or(one.bound));
    errors += ", true error ";
    errors += format_number("%.1e", one.verdict.rmse);
    add(errors);
  }
  return text;
}

// Columns as wide as their widest cell; the first two and the last are set flush left.
std::string aligned(const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> widths(rows.front().size());
  for (const auto& row : rows) {
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], row[c].size());
  }
  constexpr std::size_t numbers_from = 2;
  constexpr std::size_t numbers_to = 9;
  std::string text;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t c = 0; c < row.size(); ++c) {
      const std::string gap(widths[c] - row[c].size(), ' ');
      const bool right = c >= numbers_from && c < numbers_to;
      if (c > 0) line += "  ";
      line += right ? gap + row[c] : row[c] + gap;
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

std::string trust_table(const Extremes& extremes) {
  std::vector<std::vector<std::string>> rows{{"group", "method", "cases", "refused", "failed",
                                              "largest RMSE", "measured", "measured/true",
                                              "in bound", "at"}};
  for (const double limit : trust_limits) {
    std::string head = "RMSE <= ";
    head += format_number("%g", limit);
    rows.front().push_back(std::move(head));
  }
  for (const Trust& trust : extremes.trust) {
    std::vector<std::string> row{trust.group,
                                 trust.method,
                                 std::to_string(trust.cases),
                                 std::to_string(trust.refused),
                                 std::to_string(trust.failed),
                                 format_number("%.1e", trust.worst),
                                 std::to_string(trust.measured),
                                 format_number("%.2f", trust.least_reported),
                                 std::string(1, '-'),
                                 trust.worst_at};
    if (trust.estimated > 0) {
      row[8] = std::to_string(trust.within_bound) + "/" + std::to_string(trust.estimated);
    }
    row.insert(row.end(), trust.within.begin(), trust.within.end());
    rows.push_back(std::move(row));
  }
  return aligned(rows);
}

}  // namespace

std::string extremes_csv(const Extremes& extremes) {
  std::string text =
      "group,value,method,projection,mapping,samplesX,samplesY,samplesZ,width,height,outcome,truth,"
      "finite,bounded,monotone,honest,rmse,max,measured,estimate,bound,message\n";
  for (const CaseResult& one : extremes.cases) {
    const Verdict& verdict = one.verdict;
    std::vector<std::string> cells{one.group, one.label, one.method, one.projection, one.mapping};
    for (const int n : one.samples) cells.push_back(std::to_string(n));
    cells.push_back(std::to_string(one.width));
    cells.push_back(std::to_string(one.height));
    cells.emplace_back(outcome_of(one));
    if (one.message.empty()) {
      cells.emplace_back(name_of(one.truth));
      cells.push_back(flag(verdict.finite));
      cells.push_back(flag(verdict.bounded));
      cells.push_back(verdict.monotone ? flag(*verdict.monotone) : "");
      cells.push_back(flag(verdict.honest));
      for (const double v : {verdict.rmse, verdict.max, one.measured.value_or(std::nan("")),
                             one.estimate, one.bound}) {
        cells.push_back(number_or_nothing(v));
      }
    } else {
      cells.resize(cells.size() + 10);
    }
    cells.push_back(one.message);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (i > 0) text += ',';
      text += csv_text(cells[i]);
    }
    text += '\n';
  }
  return text;
}

std::string extremes_text(const Extremes& extremes) {
  std::string text = trust_table(extremes);
  text += "\n";
  std::vector<std::string> refusals;
  for (const CaseResult& one : extremes.cases) {
    if (one.failed()) {
      text += "failed: ";
      text += where(one);
      text += ": ";
      text += faults(one);
      text += '\n';
    }
    if (!one.refused) continue;
    std::string line = "refused: " + one.group + " " + one.label + ": " + one.message + "\n";
    if (std::find(refusals.begin(), refusals.end(), line) == refusals.end()) {
      refusals.push_back(std::move(line));
    }
  }
  for (const std::string& line : refusals) text += line;
  return text;
}

}  // namespace windsplat::study
