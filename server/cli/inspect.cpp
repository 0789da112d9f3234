// windsplat inspect: prints the content of a dataset as JSON or text.
#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "protocol/codec.hpp"
#include "server/cli/command.hpp"
#include "server/cli/data_hosts.hpp"
#include "server/cli/greatest.hpp"
#include "server/cli/inspect_text.hpp"
#include "server/cli/open_store.hpp"
#include "server/cli/progress.hpp"
#include "server/data/bytes/decode_limits.hpp"
#include "server/data/model/stored.hpp"
#include "server/data/resident/budget.hpp"
#include "server/data/resident/store.hpp"
#include "server/scene/describe.hpp"

namespace windsplat::cli {
namespace {

// Ranges are by default over all steps if reading them is fast, otherwise over the first step; they
// are omitted if even that decodes much more than is stored.
constexpr std::uint64_t whole_series_bytes_max = 1ULL << 30;
constexpr std::uint64_t bytes_of_a_read = 65536;  // minimum cost of a read

struct InspectArguments {
  std::vector<std::string> datasets;
  std::string memory = "8G";
  DataHostArguments data_hosts;
  std::string ranges = "auto";
  bool json = false;
};

// Cost of reading the fields at one step, in bytes.
constexpr double chunks_at_a_time = 4;  // chunk cache of the library and buffers of its filters
struct Cost {
  double decoded = 0;  // total of all fields
  double memory = 0;   // maximum over the fields, in the loader
};

Cost cost_of_step(const data::DatasetInfo& info) {
  Cost cost;
  for (const data::FieldInfo& field : info.fields) {
    if (field.derived) continue;
    const std::uint64_t volume = info.grid.samples() * field.components.size() * sizeof(float);
    cost.decoded += static_cast<double>(std::max({field.decoded_bytes, volume, bytes_of_a_read}));
    cost.memory =
        std::max(cost.memory, static_cast<double>(volume) +
                                  chunks_at_a_time * static_cast<double>(field.chunk_bytes));
  }
  return cost;
}

std::string size_text(double bytes) {
  return data::megabytes(static_cast<std::uint64_t>(std::min(bytes, 0x1p40)));
}

// The steps that ranges cover, and the reason for not covering all; empty if they do.
struct Choice {
  scene::RangesOf ranges = scene::RangesOf::all_steps;
  std::string note;
};

bool has_all_ranges(const data::DatasetInfo& info) {
  for (std::size_t f = 0; f < info.fields.size(); ++f) {
    if (!info.fields[f].derived && data::stored_range(info, f, 0) == nullptr) return false;
  }
  return true;
}

Choice choose_ranges(const data::DatasetInfo& info, std::uint64_t bytes_when_resident) {
  const Cost cost = cost_of_step(info);
  const auto steps = static_cast<double>(info.steps.size());
  const std::string beyond = ", beyond the limit of ";
  const std::string files = " for files of " + size_text(static_cast<double>(info.stored_bytes));
  const bool is_sample = info.stored_bytes == 0;
  const auto decoded_max = static_cast<double>(data::range_bytes_max(info.stored_bytes));
  const auto memory_max = static_cast<double>(data::range_memory_max(info.stored_bytes));
  if (!is_sample && (cost.decoded > decoded_max || cost.memory > memory_max)) {
    const bool by_size = cost.decoded > decoded_max;
    if (has_all_ranges(info)) return {scene::RangesOf::none, ""};
    return {scene::RangesOf::none,
            "ranges are not read: a step " +
                (by_size ? "decodes to " + size_text(cost.decoded) + beyond + size_text(decoded_max)
                         : "takes " + size_text(cost.memory) + " of memory" + beyond +
                               size_text(memory_max)) +
                files + "; --ranges first or all reads them"};
  }
  const bool by_size = !is_sample && cost.decoded * steps > decoded_max;
  if (!by_size && bytes_when_resident <= whole_series_bytes_max) return {};
  if (info.steps.size() == 1) return {scene::RangesOf::first_step, ""};
  return {
      scene::RangesOf::first_step,
      "ranges cover the first step only: all " + std::to_string(info.steps.size()) +
          (by_size ? " decode to " + size_text(cost.decoded * steps) + beyond +
                         size_text(decoded_max) + files
                   : " have " + size_text(static_cast<double>(bytes_when_resident)) + " of values" +
                         beyond + size_text(static_cast<double>(whole_series_bytes_max))) +
          "; --ranges all reads them"};
}

Choice asked_ranges(const std::string& ranges) {
  return {ranges == "all"     ? scene::RangesOf::all_steps
          : ranges == "first" ? scene::RangesOf::first_step
                              : scene::RangesOf::none,
          ""};
}

// Fields are read one at a time. Empty: none.
std::string largest_field(const data::DatasetInfo& info) {
  std::string name;
  std::size_t components = 0;
  for (const data::FieldInfo& field : info.fields) {
    if (field.derived || field.components.size() <= components) continue;
    components = field.components.size();
    name = field.name;
  }
  return name;
}

Result<std::string> described(const InspectArguments& arguments, const std::string& name) {
  const auto limit = memory_limit(arguments.memory);
  if (!limit) return limit.error();
  const bool asked = arguments.ranges != "auto";
  auto fetcher = open_fetcher(arguments.data_hosts);
  if (!fetcher) return fetcher.error();
  data::Store store(asked ? store_options(*limit, std::move(*fetcher))
                          : frugal_store_options(*limit, std::move(*fetcher)));
  const auto dataset = store.add(name);
  if (!dataset) return dataset.error();
  auto description = scene::describe(**dataset, scene::RangesOf::none);
  if (!description) return description.error();
  Choice choice = asked ? asked_ranges(arguments.ranges)
                        : choose_ranges((*dataset)->info(), description->bytes_when_resident);
  if (choice.ranges != scene::RangesOf::none) {
    auto ranged = scene::describe(**dataset, choice.ranges);
    if (ranged) {
      description = std::move(ranged);
      const bool all = choice.ranges == scene::RangesOf::all_steps;
      const auto lines = greatest_values(**dataset, all ? (*dataset)->info().steps.size() : 1);
      description->notes.insert(description->notes.end(), lines.begin(), lines.end());
    } else {
      const Error error =
          (*dataset)->with_need(ranged.error(), {largest_field((*dataset)->info())});
      if (asked || error.kind != ErrorKind::out_of_memory) return error;
      // Report what needs no field data.
      choice.note = "ranges are not read: " + error.message;
    }
  }
  for (const std::string& note : {choice.note, store.note((*dataset)->info().id)}) {
    if (!note.empty()) description->notes.push_back(note);
  }
  return arguments.json ? protocol::encode_dataset(*description) + "\n"
                        : inspect_text(*description);
}

// A file that cannot be read does not prevent the others from being described.
int inspect(const InspectArguments& arguments) {
  int code = exit_ok;
  bool first = true;
  Progress progress;
  std::size_t done_files = 0;
  const auto files = static_cast<double>(arguments.datasets.size());
  for (const std::string& name : arguments.datasets) {
    progress.show(static_cast<double>(done_files++) / files, name);
    auto text = described(arguments, name);
    if (text && !arguments.json && !first) text->insert(0, "\n");
    progress.clear();
    const auto done = text ? write_stdout(*text) : Result<void>(text.error());
    if (text && !done) return answer(done.error());
    if (!done) {
      Error error = done.error();
      if (arguments.datasets.size() > 1) error.message = printable(name) + ": " + error.message;
      const int failed = answer(error);
      if (code == exit_ok) code = failed;
    }
    first = false;
  }
  return code;
}

}  // namespace

void add_inspect(CLI::App& app, Action& chosen) {
  CLI::App* command = app.add_subcommand(
      "inspect", "Describe a dataset: axes, fields, ranges, steps, and what is ignored and why");
  const auto arguments = std::make_shared<InspectArguments>();
  command->add_option("files", arguments->datasets, "Files, or names of samples")
      ->required()
      ->type_name("DATASET");
  add_memory_option(*command, arguments->memory);
  add_data_host_options(*command, arguments->data_hosts);
  command
      ->add_option("--ranges", arguments->ranges,
                   "Steps to read for the ranges of fields, at any cost; auto: "
                   "all, the first or none, depending on the cost of decoding")
      ->check(CLI::IsMember({"auto", "all", "first", "none"}))
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "Print one line of JSON for each file");
  add_verbosity_options(*command);
  command->callback([&chosen, arguments] { chosen = [arguments] { return inspect(*arguments); }; });
}

}  // namespace windsplat::cli
