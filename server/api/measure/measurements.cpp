// Queries of a dataset's values run as load jobs and return JSON. A pass over all steps is split
// into short jobs, so that pictures are drawn in between.
#include "protocol/measurements.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "protocol/limits.hpp"
#include "protocol/view.hpp"
#include "server/api/measure/positions.hpp"
#include "server/api/measure/subject.hpp"
#include "server/api/operations/parameters.hpp"
#include "server/api/resources.hpp"
#include "server/data/model/measure.hpp"
#include "server/http/problem.hpp"
#include "server/http/request_target.hpp"
#include "server/tasks/catalogue.hpp"
#include "server/tasks/run_guarded.hpp"

namespace windsplat::api {
namespace {

namespace limits = protocol::limits;
using Clock = std::chrono::steady_clock;

constexpr int histogram_bins = 64;
constexpr std::chrono::milliseconds turn_budget{
    30};  // time for reading steps before yielding to other jobs

// --- over all steps -----------------------------------------------------------------------------

// A pass over the steps of a field, several steps per job.
struct Pass {
  Subject subject;
  CancelToken cancel;
  std::string payer;
  std::shared_ptr<http::Reply> reply;
  std::function<Result<void>()> begin;                 // called before the first step; may be empty
  std::function<Result<void>(std::size_t step)> take;  // called for each step
  std::function<http::Response()> finish;
  std::size_t next_step = 0;
};

// The response, or nullopt if steps remain.
Result<std::optional<http::Response>> take_turn(Pass& pass) {
  const std::size_t steps = pass.subject.dataset->info().steps.size();
  const auto until = Clock::now() + turn_budget;
  if (pass.begin) {
    if (const auto ok = std::exchange(pass.begin, nullptr)(); !ok) return ok.error();
  }
  while (pass.next_step < steps) {
    if (pass.cancel.cancelled()) {
      return make_error(ErrorKind::cancelled, "request cancelled");
    }
    if (const auto ok = pass.take(pass.next_step); !ok) return ok.error();
    ++pass.next_step;
    if (Clock::now() >= until) break;
  }
  if (pass.next_step < steps) return std::optional<http::Response>();
  return std::optional(pass.finish());
}

// Resubmits itself, so that other loads run in between. Only the first job may be refused.
void go_on(tasks::TaskExecutor& loads, const std::shared_ptr<Pass>& pass, bool admitted) {
  const auto run = [&loads, pass] {
    auto answer = tasks::run_guarded<std::optional<http::Response>>(
        "a pass over all steps", pass->cancel, [&] { return take_turn(*pass); });
    if (!answer) return (*pass->reply)(http::problem_response(answer.error()));
    if (*answer) return (*pass->reply)(std::move(**answer));
    go_on(loads, pass, true);
  };
  const auto queued = loads.submit(
      {pass->cancel, run, admitted, pass->subject.dataset->shared_info(), pass->payer});
  if (!queued) (*pass->reply)(http::problem_response(queued.error()));
}

std::shared_ptr<Pass> pass_over(Subject subject, const http::Request& request, http::Reply reply) {
  auto pass = std::make_shared<Pass>();
  pass->subject = std::move(subject);
  pass->cancel = request.cancel;
  pass->payer = request.address;
  pass->reply = std::make_shared<http::Reply>(std::move(reply));
  return pass;
}

Result<void> check_steps(const data::DatasetInfo& info) {
  if (info.steps.size() <= static_cast<std::size_t>(limits::series_steps_max)) return {};
  return make_error(ErrorKind::too_large, "the dataset has " + std::to_string(info.steps.size()) +
                                              " steps; the limit is " +
                                              std::to_string(limits::series_steps_max));
}

// --- histogram ----------------------------------------------------------------------------------

struct HistogramQuery {
  data::HistogramRequest request;
  std::size_t step = 0;
};

Result<HistogramQuery> read_histogram(http::QueryReader& query, const data::Dataset& dataset) {
  HistogramQuery out;
  const auto step = read_step(query, dataset);
  out.request.bins = read_integer(query, parameters::bins).value_or(histogram_bins);
  out.request.range = read_pair(query, parameters::range);
  out.request.logarithmic = read_boolean(query, parameters::log).value_or(false);
  const auto clip = read_number(query, parameters::clip);
  if (const auto ok = query.finish(); !ok) return ok.error();
  if (!step) return step.error();
  out.step = *step;
  out.request.clip = clip.value_or(0);
  if (out.request.range && clip) {
    return make_error(ErrorKind::invalid,
                      "query parameters 'range' and 'clip' are mutually exclusive");
  }
  return out;
}

http::Response histogram_response(const Subject& subject, const HistogramQuery& query,
                                  const CancelToken& cancel) {
  const auto volume = load(subject, query.step);
  if (!volume) return http::problem_response(volume.error());
  auto made = data::histogram(**volume, query.request, cancel);
  if (!made) return http::problem_response(made.error());
  protocol::HistogramDescription out;
  out.range = made->range;
  out.counts = std::move(made->counts);
  out.below = made->below;
  out.above = made->above;
  out.masked = made->masked;
  out.log = query.request.logarithmic;
  if (out.log) out.edges = std::move(made->edges);
  return json_response(protocol::encode_histogram(out));
}

// --- probe --------------------------------------------------------------------------------------

struct ProbeQuery {
  Position position;
  std::size_t step = 0;
  std::vector<std::string> fields;  // derived ones that are computed; others only if in memory
};

// "a,b"
Result<std::vector<std::string>> read_fields(http::QueryReader& query,
                                             const data::DatasetInfo& info) {
  std::vector<std::string> out;
  const std::string names = read_text(query, parameters::fields).value_or("");
  for (std::size_t at = 0; at < names.size();) {
    const std::size_t end = std::min(names.find(',', at), names.size());
    out.push_back(names.substr(at, end - at));
    at = end + 1;
    if (info.find(out.back()) != nullptr) continue;
    return make_error(ErrorKind::invalid, "query parameter 'fields': there is no field '" +
                                              printable(out.back()) + "'" +
                                              data::absence_text(info, out.back()));
  }
  return out;
}

http::Response probe_response(tasks::Catalogue& catalogue, data::Dataset& dataset,
                              const ProbeQuery& query, const CancelToken& cancel) {
  const data::DatasetInfo& info = dataset.info();
  const auto located = locate(catalogue, dataset.minuend(), query.position, cancel);
  if (!located) return http::problem_response(located.error());
  protocol::ProbeDescription out;
  out.position = located->position;
  out.step = static_cast<int>(query.step);
  for (const data::FieldInfo& field : info.fields) {
    if (cancel.cancelled()) {
      return http::problem_response(make_error(ErrorKind::cancelled, "request cancelled"));
    }
    // Of derived fields those that are wanted or in memory: computing all would take seconds.
    const bool is_wanted =
        std::find(query.fields.begin(), query.fields.end(), field.name) != query.fields.end();
    const bool is_optional = field.derived && !is_wanted;
    const auto& index = located->place.index;
    Nearby nearby;
    if (is_optional) {
      auto there = dataset.resident_only().volume(field.name, query.step);
      if (!there) continue;
      nearby.volume = std::move(*there);
    } else {
      auto loaded = load_nearby(catalogue, dataset, field.name, query.step, index, cancel);
      // Fields that cannot be subtracted have no difference.
      if (!loaded && !is_wanted && dataset.subtrahend() &&
          loaded.error().kind == ErrorKind::invalid)
        continue;
      if (!loaded) return http::problem_response(loaded.error());
      nearby = std::move(*loaded);
    }
    out.fields.push_back(probed_field(field));
    out.values.push_back(nearby.value_at(index));
  }
  return json_response(protocol::encode_probe(out));
}

// --- range --------------------------------------------------------------------------------------

http::Response range_response(const data::FieldRange& range, const char* of) {
  return json_response(protocol::encode_range({range.range, range.masked, of, {}}));
}

std::size_t index_of(const data::DatasetInfo& info, const data::FieldInfo& field) {
  return static_cast<std::size_t>(info.find(field.name) - info.fields.data());
}

http::Response step_range(const Subject& subject, std::size_t step) {
  // Of a field that does not fit into memory: stored, without the places.
  const data::Dataset& dataset = *subject.dataset;
  const data::DatasetInfo& info = dataset.info();
  if (!dataset.subtrahend() && !dataset.fits_in_full({subject.field.name})) {
    if (const auto* const stored = data::stored_range(info, index_of(info, subject.field), step)) {
      data::FieldRange range;
      range.add(*stored, info.grid.samples());
      return range_response(range, "step");
    }
  }
  const auto volume = load(subject, step);
  if (!volume) return http::problem_response(volume.error());
  data::FieldRange range;
  range.add(**volume);
  protocol::RangeDescription out{range.range, range.masked, "step", {}};
  if (const auto places = data::extremes(**volume)) {
    out.places = {position_of(info.grid, places->least), position_of(info.grid, places->greatest)};
  }
  return json_response(protocol::encode_range(out));
}

// Over all steps, if the source has stored it.
std::optional<data::FieldRange> stored_range(const data::DatasetInfo& info,
                                             const data::FieldInfo& field) {
  const std::size_t index = index_of(info, field);
  data::FieldRange out;
  for (std::size_t step = 0; step < info.steps.size(); ++step) {
    const auto* const stored = data::stored_range(info, index, step);
    if (stored == nullptr) return std::nullopt;
    out.add(*stored, info.grid.samples());
  }
  return out;
}

void answer_range_of_all(tasks::Backend& backend, Subject subject, const http::Request& request,
                         http::Reply reply) {
  auto of = subject.dataset->shared_info();
  const bool is_difference = subject.dataset->subtrahend().has_value();  // its ranges are not kept
  const auto known = is_difference ? std::nullopt : backend.ranges.find(of, subject.field.name);
  if (known) {
    reply(range_response(*known, "all"));
    return;
  }
  if (const auto stored = is_difference ? std::nullopt : stored_range(*of, subject.field)) {
    reply(range_response(*stored, "all"));
    return;
  }
  const auto pass = pass_over(std::move(subject), request, std::move(reply));
  const auto range = std::make_shared<data::FieldRange>();
  pass->take = [range, &subject = pass->subject](std::size_t step) -> Result<void> {
    const auto volume = load(subject, step);
    if (!volume) return volume.error();
    range->add(**volume);
    return {};
  };
  pass->finish = [&ranges = backend.ranges, range, of = std::move(of), is_difference,
                  field = pass->subject.field.name] {
    if (!is_difference) ranges.keep(of, field, *range);
    return range_response(*range, "all");
  };
  go_on(backend.loads, pass, false);
}

}  // namespace

void get_histogram(tasks::Catalogue& catalogue, tasks::TaskExecutor& loads, const std::string& id,
                   const std::string& field, const http::Request& request, http::Reply reply) {
  http::QueryReader reader(request.query);
  auto subject = find_subject(catalogue, id, field, request, reader);
  if (!subject) {
    reply(http::problem_response(subject.error()));
    return;
  }
  const auto query = read_histogram(reader, *subject->dataset);
  if (!query) {
    reply(http::problem_response(query.error()));
    return;
  }
  run_later(loads, request, std::move(reply), "a histogram", subject->dataset.get(),
            [subject = *subject, query = *query, cancel = request.cancel] {
              return histogram_response(subject, query, cancel);
            });
}

void get_probe(tasks::Catalogue& catalogue, tasks::TaskExecutor& loads, const std::string& id,
               const http::Request& request, http::Reply reply) {
  const auto refuse = [&](const Error& error) { reply(http::problem_response(error)); };
  http::QueryReader query(request.query);
  auto dataset = find_dataset(catalogue, id, query);
  if (!dataset) return refuse(dataset.error());
  const auto at = read_position(query, (*dataset)->info().grid);
  const auto step = read_step(query, **dataset);
  const auto wanted = read_fields(query, (*dataset)->info());
  const auto ok = query.finish();
  if (!ok) return refuse(ok.error());
  if (!at) return refuse(at.error());
  if (!step) return refuse(step.error());
  if (!wanted) return refuse(wanted.error());
  run_later(
      loads, request, std::move(reply), "a probe", dataset->get(),
      [&catalogue, dataset = *dataset, asked = ProbeQuery{*at, *step, *wanted},
       cancel = request.cancel] { return probe_response(catalogue, *dataset, asked, cancel); });
}

void get_series(tasks::Catalogue& catalogue, tasks::TaskExecutor& loads, const std::string& id,
                const std::string& field, const http::Request& request, http::Reply reply) {
  const auto refuse = [&](const Error& error) { reply(http::problem_response(error)); };
  http::QueryReader query(request.query);
  auto subject = find_subject(catalogue, id, field, request, query);
  if (!subject) return refuse(subject.error());
  const data::DatasetInfo& info = subject->dataset->info();
  const auto position = read_position(query, info.grid);
  if (const auto ok = query.finish(); !ok) return refuse(ok.error());
  if (!position) return refuse(position.error());
  if (const auto ok = check_steps(info); !ok) return refuse(ok.error());

  const auto series = std::make_shared<protocol::SeriesDescription>();
  series->field = probed_field(subject->field);
  for (const data::TimeStep& step : info.steps) series->times.push_back({step.value, step.text});
  const auto pass = pass_over(std::move(*subject), request, std::move(reply));
  const auto index = std::make_shared<std::array<int, 3>>();
  // Locating the position is slow among many columns, so it runs on a loading thread.
  pass->begin = [at = *position, series, index, &of = pass->subject]() -> Result<void> {
    const auto found = locate(*of.catalogue, of.dataset->minuend(), at, of.cancel);
    if (!found) return found.error();
    *index = found->place.index;
    series->position = found->position;
    return {};
  };
  pass->take = [series, index, &of = pass->subject](std::size_t step) -> Result<void> {
    const auto loaded =
        load_nearby(*of.catalogue, *of.dataset, of.field.name, step, *index, of.cancel);
    if (!loaded) return loaded.error();
    series->values.push_back(loaded->value_at(*index));
    return {};
  };
  pass->finish = [series] { return json_response(protocol::encode_series(*series)); };
  go_on(loads, pass, false);
}

void get_range(tasks::Backend& backend, const std::string& id, const std::string& field,
               const http::Request& request, http::Reply reply) {
  const auto refuse = [&](const Error& error) { reply(http::problem_response(error)); };
  http::QueryReader query(request.query);
  auto subject = find_subject(backend.catalogue, id, field, request, query);
  if (!subject) return refuse(subject.error());
  const std::string of = read_text(query, parameters::range_of).value_or("step");
  const auto step = read_step(query, *subject->dataset);
  if (const auto ok = query.finish(); !ok) return refuse(ok.error());
  if (of != "step" && of != "all") {
    return refuse(make_error(ErrorKind::invalid,
                             "query parameter 'of' must be step or all, not " + printable(of, 40)));
  }
  if (of == "step") {
    if (!step) return refuse(step.error());
    run_later(backend.loads, request, std::move(reply), "a range", subject->dataset.get(),
              [subject = *subject, step = *step] { return step_range(subject, step); });
    return;
  }
  const auto is_of_step = [](const auto& given) {
    return given.first == parameters::step.name || given.first == parameters::time.name ||
           given.first == parameters::nearest.name;
  };
  const auto given = std::find_if(request.query.begin(), request.query.end(), is_of_step);
  if (given != request.query.end()) {
    return refuse(
        make_error(ErrorKind::invalid, "query parameter '" + given->first + "' requires of=step"));
  }
  if (const auto ok = check_steps(subject->dataset->info()); !ok) return refuse(ok.error());
  answer_range_of_all(backend, std::move(*subject), request, std::move(reply));
}

}  // namespace windsplat::api
