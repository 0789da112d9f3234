// The rules by which pictures of extreme cases are judged.
#include "server/study/extremes/judge.hpp"

#include <algorithm>
#include <cmath>

namespace windsplat::study {

namespace {

// All cases of one value.
struct Column {
  std::string label;
  bool number = false;
  bool drawn = false;
  bool failed = false;
  double worst = std::numeric_limits<double>::quiet_NaN();
};

double larger(double a, double b) { return std::isnan(a) || b > a ? b : a; }

std::vector<Column> columns_of(const std::vector<const CaseResult*>& cases) {
  std::vector<Column> columns;
  for (const CaseResult* one : cases) {
    auto at = std::find_if(columns.begin(), columns.end(),
                           [&](const Column& column) { return column.label == one->label; });
    if (at == columns.end()) {
      at = columns.insert(at, Column{one->label, !std::isnan(one->value)});
    }
    at->drawn = at->drawn || !one->refused;
    at->failed = at->failed || one->failed();
    if (!one->refused) at->worst = larger(at->worst, one->verdict.rmse);
  }
  std::erase_if(columns, [](const Column& column) {
    return !column.drawn || (!column.failed && std::isnan(column.worst));
  });
  return columns;
}

bool is_trusted(const Column& column, double limit) {
  return !column.failed && column.worst <= limit;
}

std::string values_within(const std::vector<Column>& columns, double limit) {
  const auto fits = [limit](const Column& column) { return is_trusted(column, limit); };
  if (std::none_of(columns.begin(), columns.end(), fits)) return "none";
  if (std::all_of(columns.begin(), columns.end(), fits)) return "all";
  std::string text;
  if (!columns.front().number) {
    const auto fitting = std::count_if(columns.begin(), columns.end(), fits);
    const bool most = 2 * static_cast<std::size_t>(fitting) > columns.size();
    for (const Column& column : columns) {
      if (fits(column) == most) continue;
      text += text.empty() ? (most ? "all but " : "") : ", ";
      text += column.label;
    }
    return text;
  }
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (!fits(columns[i])) continue;
    std::size_t last = i;
    while (last + 1 < columns.size() && fits(columns[last + 1])) ++last;
    if (!text.empty()) text += ", ";
    text += columns[i].label;
    if (last > i) text += " to " + columns[last].label;
    i = last;
  }
  return text;
}

// Errors that state what is wrong with a view or its data.
bool is_refusal(ErrorKind kind) {
  return kind == ErrorKind::invalid || kind == ErrorKind::malformed ||
         kind == ErrorKind::too_large || kind == ErrorKind::bad_data;
}

}  // namespace

const char* name_of(TruthKind kind) {
  switch (kind) {
    case TruthKind::integrator:
      return "integrator";
    case TruthKind::reference:
      return "reference";
    case TruthKind::closed_form:
      return "closed form";
  }
  return "";
}

const char* outcome_of(const CaseResult& one) {
  return one.refused ? "refused" : one.failed() ? "failed" : "good";
}

void judge_refusal(const std::string& by_design, const Result<void>& drawn, CaseResult& result) {
  constexpr std::size_t message_max = 400;
  if (!drawn) result.message = printable(drawn.error().message, message_max);
  if (by_design.empty()) return;
  result.refused = !drawn && is_refusal(drawn.error().kind) &&
                   result.message.find(by_design) != std::string::npos;
  if (result.refused) return;
  result.message = (drawn ? "not refused" : result.message) + "; expected: " + by_design;
}

Verdict judge(const Observed& observed) {
  Verdict verdict;
  for (const float value : observed.rgba) {
    verdict.finite = verdict.finite && std::isfinite(value);
    verdict.bounded = verdict.bounded && value >= -rounding && value <= 1 + rounding;
  }
  if (!observed.truth.empty()) {
    double squares = 0;
    double most = 0;
    for (std::size_t i = 0; i < observed.pixels.size(); ++i) {
      for (std::size_t c = 0; c < 4; ++c) {
        const double value = observed.rgba[4 * observed.pixels[i] + c];
        const double apart = std::abs(value - observed.truth[4 * i + c]);
        squares += apart * apart;
        most = larger(most, std::isnan(apart) ? std::numeric_limits<double>::infinity() : apart);
      }
    }
    verdict.rmse = std::sqrt(squares / static_cast<double>(observed.truth.size()));
    if (std::isnan(verdict.rmse)) verdict.rmse = std::numeric_limits<double>::infinity();
    verdict.max = most;
  }
  if (observed.reported && verdict.rmse > honest_from) {
    verdict.honest = *observed.reported >= honest_share * verdict.rmse;
  }
  return verdict;
}

bool is_monotone(std::span<const float> before, std::span<const float> after, double slack) {
  for (std::size_t i = 3; i < after.size(); i += 4) {
    if (!(after[i] >= before[i] - slack)) return false;
  }
  return true;
}

namespace {

// Adds a case that was drawn and compared.
void add_error(const CaseResult& one, Trust& trust) {
  const double rmse = one.verdict.rmse;
  if (std::isnan(trust.worst) || rmse > trust.worst) {
    trust.worst = rmse;
    trust.worst_at = one.label;
  }
  trust.measured += one.measured ? 1 : 0;
  if (one.measured && rmse > honest_from) {
    const double share = *one.measured / rmse;
    if (std::isnan(trust.least_reported) || !(share >= trust.least_reported)) {
      trust.least_reported = share;
    }
  }
  if (std::isnan(one.bound)) return;
  ++trust.estimated;
  trust.within_bound += rmse <= one.bound ? 1 : 0;
}

}  // namespace

std::vector<Trust> trust_of(const std::vector<CaseResult>& cases) {
  std::vector<Trust> all;
  for (const CaseResult& one : cases) {
    const auto same = [](const auto& a, const auto& b) {
      return a.group == b.group && a.method == b.method;
    };
    if (std::any_of(all.begin(), all.end(), [&](const Trust& t) { return same(t, one); })) continue;
    Trust trust;
    trust.group = one.group;
    trust.method = one.method;
    trust.worst = trust.least_reported = std::numeric_limits<double>::quiet_NaN();
    std::vector<const CaseResult*> own;
    for (const CaseResult& other : cases) {
      if (!same(other, one)) continue;
      own.push_back(&other);
      ++trust.cases;
      trust.refused += other.refused ? 1 : 0;
      trust.failed += other.failed() ? 1 : 0;
      if (!other.refused && !std::isnan(other.verdict.rmse)) add_error(other, trust);
    }
    const std::vector<Column> columns = columns_of(own);
    for (std::size_t i = 0; i < trust_limits.size(); ++i) {
      trust.within.at(i) = values_within(columns, trust_limits.at(i));
    }
    all.push_back(std::move(trust));
  }
  return all;
}

}  // namespace windsplat::study
