// windsplat inspect: dataset -> what is in it, as JSON or for a reader.
#include <memory>
#include <string>

#include "protocol/codec.hpp"
#include "server/cli/command.hpp"
#include "server/cli/inspect_text.hpp"
#include "server/cli/open_store.hpp"
#include "server/data/store.hpp"
#include "server/scene/describe.hpp"

namespace windsplat::cli {
namespace {

// Ranges are over the whole series where reading it takes moments, else over the first step.
constexpr std::uint64_t whole_series_bytes_max = 1ULL << 30;

struct InspectArguments {
  std::string dataset;
  bool json = false;
};

Result<void> inspect(const InspectArguments& arguments) {
  data::Store store(store_options(command_bytes_max));
  const auto dataset = store.add(arguments.dataset);
  if (!dataset) return dataset.error();
  auto description = scene::describe(**dataset, scene::RangesOf::none);
  if (!description) return description.error();
  const bool whole = description->bytes_when_resident <= whole_series_bytes_max;
  description =
      scene::describe(**dataset, whole ? scene::RangesOf::all_steps : scene::RangesOf::first_step);
  if (!description) return description.error();
  return write_stdout(arguments.json ? protocol::encode_dataset(*description) + "\n"
                                     : inspect_text(*description));
}

}  // namespace

void add_inspect(CLI::App& app, Action& chosen) {
  CLI::App* command = app.add_subcommand(
      "inspect", "Say what is in a file: axes, fields, ranges, steps, what is left out and why");
  const auto arguments = std::make_shared<InspectArguments>();
  command->add_option("file", arguments->dataset, "A file, or a sample's name")
      ->required()
      ->type_name("FILE");
  command->add_flag("--json", arguments->json, "For programs: one JSON object");
  command->callback([&chosen, arguments] {
    chosen = [arguments] {
      const auto done = inspect(*arguments);
      return done ? exit_ok : answer(done.error());
    };
  });
}

}  // namespace windsplat::cli
