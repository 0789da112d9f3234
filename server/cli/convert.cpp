// windsplat convert: writes a dataset as a Zarr store of bricks at several levels.
#include "server/convert/convert.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "protocol/view.hpp"
#include "server/base/cancel.hpp"
#include "server/base/elapsed.hpp"
#include "server/cli/animate/plan.hpp"
#include "server/cli/command.hpp"
#include "server/cli/data_hosts.hpp"
#include "server/cli/open_store.hpp"
#include "server/cli/progress.hpp"
#include "server/cli/signals.hpp"
#include "server/convert/verify.hpp"
#include "server/data/files/files.hpp"
#include "server/data/model/stored.hpp"
#include "server/data/resident/budget.hpp"
#include "server/data/samples/samples.hpp"
#include "server/scene/detail.hpp"
#include "server/scene/lattice.hpp"

namespace windsplat::cli {
namespace {

// Coarser levels end with one that is loaded in a moment.
constexpr std::size_t coarsest_samples = std::size_t{1} << 18;
constexpr int halvings_max = 7;

struct ConvertArguments {
  std::vector<std::string>
      names;  // the input; with --verify alone the store, and perhaps the input
  std::string output;
  std::vector<std::string> fields;
  std::string steps;
  std::string compression = "lz4";
  std::string memory = "8G";
  DataHostArguments data_hosts;
  unsigned threads = 0;
  int zarr = 3;
  bool force = false;
  bool restart = false;
  bool verify = false;
};

// Full detail and every coarser level, as pictures of the default placement choose them. Of data
// with coarser levels at least so many that the middles of kernels of the widest stride are stored:
// the default lines of data that do not fit into memory are drawn from them.
Result<std::vector<data::Coarsening>> levels_of(const data::DatasetInfo& info) {
  const auto lattice = scene::place_lattice(info.grid, protocol::GeometryView{});
  if (!lattice) return lattice.error();
  std::vector<data::Coarsening> out{data::Coarsening{}};
  std::array<int, 3> level{0, 0, 0};
  const auto samples = [&] {
    std::size_t product = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      product *= static_cast<std::size_t>(data::halved(lattice->dims.at(a), level.at(a)));
    }
    return product;
  };
  const std::size_t least = samples() > coarsest_samples ? 1 + data::strided_levels_max : 1;
  while ((samples() > coarsest_samples || out.size() < least) &&
         std::ranges::max(level) < halvings_max) {
    const auto next = scene::coarser_level(*lattice, std::nullopt, level, 1);
    if (next == level) break;
    level = next;
    out.push_back(scene::coarsening_of(*lattice, level));
  }
  return out;
}

Result<std::vector<std::size_t>> steps_of(const std::string& text, std::size_t steps) {
  std::vector<std::size_t> out;
  if (text.empty()) return out;
  const auto range = parse_steps(text);
  if (!range) {
    return make_error(ErrorKind::malformed, "--steps '" + printable(text) +
                                                "' is not of the form FIRST:LAST or "
                                                "FIRST:LAST:STRIDE");
  }
  if (static_cast<std::size_t>(*range->last) >= steps) {
    return make_error(ErrorKind::invalid, "--steps '" + printable(text) +
                                              "': the last step of the dataset is " +
                                              std::to_string(steps - 1));
  }
  for (std::int64_t step = range->first; step <= *range->last; step += range->stride) {
    out.push_back(static_cast<std::size_t>(step));
  }
  return out;
}

// Whether one of two absolute paths is the other, or a folder that has it below.
bool is_at_or_below(const std::filesystem::path& path, const std::filesystem::path& folder) {
  return std::ranges::mismatch(folder, path).in1 == folder.end();
}

// The output must not replace its input, nor be a part of it.
Result<void> check_apart(const std::string& input, const std::string& output) {
  if (data::sized_sample(input)) return {};
  const auto location = data::locate(input);
  if (!location) return location.error();
  if (location->fetched) return {};
  const auto plain = convert::plain_path(output);
  if (!plain) return plain.error();
  std::error_code fault;
  const std::filesystem::path there = std::filesystem::weakly_canonical(*plain, fault);
  bool is_apart =
      location->kind != data::Location::Kind::folder ||
      (!is_at_or_below(there, location->folder) && !is_at_or_below(location->folder, there));
  for (const auto& member : location->members) {
    is_apart = is_apart && !is_at_or_below(member.path, there);
  }
  if (is_apart && !fault) return {};
  return make_error(ErrorKind::invalid, "-o " + in_quotes(output) + " is, contains or is within " +
                                            in_quotes(input) + ", which is read");
}

class Conversion {
 public:
  Conversion(const ConvertArguments& arguments, const CancelToken& cancel)
      : arguments_(arguments), cancel_(cancel) {}

  Result<void> run() {
    const auto limit = memory_limit(arguments_.memory);
    if (!limit) return limit.error();
    limit_ = *limit;
    auto fetcher = open_fetcher(arguments_.data_hosts);
    if (!fetcher) return fetcher.error();
    fetcher_ = std::move(*fetcher);
    if (arguments_.output.empty()) return check();
    if (auto done = write(); !done || !arguments_.verify) return done;
    return verified(arguments_.output, arguments_.names.front());
  }

 private:
  [[nodiscard]] std::uint64_t loader_bytes() const { return limit_ / 2; }

  // --verify STORE [INPUT]
  Result<void> check() {
    const bool has_input = arguments_.names.size() > 1;
    return verified(arguments_.names.front(), has_input ? arguments_.names[1] : "");
  }

  // Files, and numbers: of the input if it is given, otherwise of the store's full detail.
  Result<void> verified(const std::string& store, const std::string& input) {
    const auto start = std::chrono::steady_clock::now();
    Progress progress;
    const auto shown = [&](double done) { progress.show(done, "verified"); };
    const auto recorded = convert::check_files(store, cancel_, shown);
    progress.clear();
    if (!recorded) return recorded.error();
    if (!recorded->same_program) {
      note("it was written by " + printable(recorded->program) +
           ": its files are compared with their checksums, and its numbers are not made anew");
    } else if (auto done = numbers_verified(store, input, *recorded); !done) {
      return done.error();
    }
    note(in_quotes(store) + " is sound: " + std::to_string(recorded->files) + " files of " +
         data::megabytes(recorded->bytes) +
         (input.empty() ? "" : ", with the numbers of " + in_quotes(input)));
    detail("verified in " + seconds_text(seconds_since(start)));
    return {};
  }

  Result<void> numbers_verified(const std::string& store, const std::string& input,
                                const convert::Recorded& recorded) {
    // Full detail is a dataset by itself.
    const std::string name = input.empty() ? (std::filesystem::path(store) / "0").native() : input;
    auto source = open_source(name, loader_bytes(), fetcher_, cancel_);
    if (!source) return source.error();
    const data::DatasetInfo info = (*source)->info();
    source->reset();
    auto options = options_for(info);
    if (!options) return options.error();
    options->fields = recorded.fields;
    if (!input.empty()) {
      options->steps = recorded.steps;
    } else {
      options->steps.clear();
    }
    options->compression = recorded.compression;
    options->zarr = recorded.zarr;
    const auto chain = levels_of(info);
    if (!chain) return chain.error();
    const convert::Open open = [&](std::uint64_t bytes) {
      return open_source(name, bytes, fetcher_, cancel_);
    };
    Progress progress;
    return convert::check_numbers(info, *chain, *options, open, store, cancel_,
                                  [&](double done) { progress.show(done, "made anew"); });
  }

  Result<convert::Options> options_for(const data::DatasetInfo& info) const {
    convert::Options out;
    out.fields = arguments_.fields;
    auto steps = steps_of(arguments_.steps, info.steps.size());
    if (!steps) return steps.error();
    out.steps = std::move(*steps);
    out.compression = arguments_.compression;
    out.zarr = arguments_.zarr;
    out.memory_bytes = limit_;
    out.memory_text = [](std::uint64_t bytes) { return "--memory-limit " + bytes_text(bytes); };
    out.threads = arguments_.threads;
    if (out.threads == 0) out.threads = std::max(1U, std::thread::hardware_concurrency());
    out.force = arguments_.force;
    out.restart = arguments_.restart;
    return out;
  }

  Result<void> write() {
    const std::string& name = arguments_.names.front();
    if (auto apart = check_apart(name, arguments_.output); !apart) return apart;
    Progress progress;
    progress.show(0, "reading");
    auto source = open_source(name, loader_bytes(), fetcher_, cancel_);
    if (!source) return source.error();
    const data::DatasetInfo info = (*source)->info();
    source->reset();  // its loader's memory is not counted
    const auto options = options_for(info);
    if (!options) return options.error();
    const auto chain = levels_of(info);
    if (!chain) return chain.error();
    const convert::Open open = [&](std::uint64_t bytes) {
      return open_source(name, bytes, fetcher_, cancel_);
    };
    const auto start = std::chrono::steady_clock::now();
    const auto report = convert::convert(info, *chain, *options, open, arguments_.output, cancel_,
                                         [&](double done) { progress.show(done, "written"); });
    progress.clear();
    if (!report) return report.error();
    for (const std::string& text : report->notes) note(text);
    const double seconds = seconds_since(start);
    detail("read " + data::megabytes(report->read_bytes) + ", wrote " +
           data::megabytes(report->written_bytes) + " at " + std::to_string(chain->size()) +
           " levels in " + seconds_text(seconds) + " by " + std::to_string(report->workers) +
           " threads; " + std::to_string(report->units_kept) + " of " +
           std::to_string(report->units_kept + report->units_done) +
           " units were there from an earlier run");
    return {};
  }

  const ConvertArguments& arguments_;
  CancelToken cancel_;
  std::uint64_t limit_ = 0;
  FetcherPtr fetcher_;
};

int run_convert(const ConvertArguments& arguments) {
  const bool checks_only = arguments.verify && arguments.output.empty();
  if (arguments.output.empty() && !arguments.verify) {
    complain("-o OUT.zarr is required, unless a store is verified");
    return exit_usage;
  }
  if (arguments.output == "-") {
    complain("-o: a store is a folder, and is not written to standard output");
    return exit_usage;
  }
  if (!checks_only && arguments.names.size() > 1) {
    complain("one dataset is converted at a time; the second is " + in_quotes(arguments.names[1]));
    return exit_usage;
  }
  const CancelToken cancel;
  const SignalWatch watch([&cancel] { cancel.cancel(); }, nullptr, {exit_interrupted});
  const auto done = Conversion(arguments, cancel).run();
  if (done) return exit_ok;
  const int code = answer(done.error());
  return done.error().kind == ErrorKind::cancelled ? exit_interrupted : code;
}

}  // namespace

void add_convert(CLI::App& app, Action& chosen) {
  CLI::App* command = app.add_subcommand(
      "convert", "Write a dataset as a Zarr store of bricks at several levels of detail");
  const auto arguments = std::make_shared<ConvertArguments>();
  command
      ->add_option("dataset", arguments->names,
                   "File, pattern, folder, URL or sample; with --verify and without -o: the store, "
                   "and the dataset that it was made of, if it is to be compared")
      ->required()
      ->expected(1, 2)
      ->type_name("DATASET");
  command->add_option("-o,--output", arguments->output, "Folder of the store, OUT.zarr")
      ->type_name("FOLDER");
  command
      ->add_option("--field", arguments->fields,
                   "Field to be written; may be repeated. Default: all that are stored")
      ->take_all()
      ->expected(1)
      ->type_name("NAME");
  command
      ->add_option("--steps", arguments->steps, "First and last step, and a stride; default: all")
      ->type_name("FIRST:LAST[:STRIDE]");
  command
      ->add_option("--compression", arguments->compression,
                   "lz4, zstd, zstd:1 to zstd:9, or none; zstd is a little smaller and takes "
                   "three times as long to read")
      ->type_name("CODEC")
      ->capture_default_str();
  add_memory_option(*command, arguments->memory);
  add_data_host_options(*command, arguments->data_hosts);
  command->add_option("--threads", arguments->threads, "Workers; 0: one per hardware thread")
      ->envname("WINDSPLAT_THREADS")
      ->check(CLI::Range(0U, 1024U))
      ->type_name("N")
      ->capture_default_str();
  command->add_flag("--force", arguments->force, "Replace a store that exists");
  command->add_flag("--restart", arguments->restart,
                    "Discard what an earlier run left unfinished instead of continuing it");
  command->add_flag("--verify", arguments->verify,
                    "Read the store back: checksums, full detail against the dataset, coarser "
                    "levels and statistics against full detail");
  command
      ->add_option("--zarr-format", arguments->zarr,
                   "3: shards; 2: a file for each brick, for programs without Zarr 3")
      ->check(CLI::IsMember({2, 3}))
      ->capture_default_str();
  add_verbosity_options(*command);
  command->callback(
      [&chosen, arguments] { chosen = [arguments] { return run_convert(*arguments); }; });
}

}  // namespace windsplat::cli
