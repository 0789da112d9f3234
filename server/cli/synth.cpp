// windsplat synth: writes a built-in sample as a CF netCDF file.
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <string>
#include <string_view>

#include "server/base/cancel.hpp"
#include "server/cli/command.hpp"
#include "server/cli/progress.hpp"
#include "server/cli/signals.hpp"
#include "server/data/formats/netcdf/writer.hpp"
#include "server/data/samples/samples.hpp"

namespace windsplat::cli {
namespace {

struct SynthArguments {
  std::string sample;
  std::string dims;  // "XxYxZ"; empty: default of the sample
  int steps = 0;     // 0: default of the sample
  std::string output;
};

Result<void> synth(const SynthArguments& arguments, const std::string& path,
                   const CancelToken& cancel) {
  std::array<int, 3> dims{};
  if (!arguments.dims.empty()) {
    const auto extent = parse_extent(arguments.dims, 3);
    if (!extent) {
      return make_error(ErrorKind::malformed,
                        "--dims '" + printable(arguments.dims) + "' is not of the form 64x64x64");
    }
    for (std::size_t a = 0; a < dims.size(); ++a) {
      if ((*extent)[a] > std::numeric_limits<int>::max()) {
        return make_error(ErrorKind::too_large,
                          "--dims '" + printable(arguments.dims) + "' is too large");
      }
      dims[a] = static_cast<int>((*extent)[a]);
    }
  }
  const auto source = data::open_sample(arguments.sample, dims, arguments.steps);
  if (!source) return source.error();
  Progress progress;
  return data::write_netcdf(**source, path, cancel,
                            [&progress](double done) { progress.show(done, "written"); });
}

// netCDF is written at several places of its file, so that stdout gets a copy.
Result<void> copy_to_stdout(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes(std::size_t{1} << 20U, '\0');
  while (file) {
    file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    const auto count = static_cast<std::size_t>(file.gcount());
    if (auto done = write_stdout(std::string_view(bytes).substr(0, count)); !done) return done;
  }
  if (file.eof()) return {};
  return make_error(ErrorKind::internal, "cannot read " + in_quotes(path));
}

// Where the file is written: the output, or a temporary file.
struct Place {
  std::string path;
  bool is_temporary = false;

  void remove() const {
    ::unlink(data::netcdf_part(path).c_str());
    if (is_temporary) ::unlink(path.c_str());
  }
};
Place place_of(const std::string& output) {
  if (!is_stdout(output)) return {output};
  const auto name = "windsplat-synth-" + std::to_string(::getpid()) + ".nc";
  return {(std::filesystem::temp_directory_path() / name).native(), true};
}

int run_synth(const SynthArguments& arguments) {
  if (auto free = check_streams({}, {{"-o", arguments.output}}); !free) {
    return answer(free.error());
  }
  const CancelToken cancel;
  const Place place = place_of(arguments.output);
  const SignalWatch watch([&cancel] { cancel.cancel(); }, nullptr,
                          {exit_interrupted, [&place] { place.remove(); }});
  auto done = synth(arguments, place.path, cancel);
  if (done && place.is_temporary) done = copy_to_stdout(place.path);
  if (place.is_temporary) place.remove();
  if (done) return exit_ok;
  const int code = answer(done.error());
  return done.error().kind == ErrorKind::cancelled ? exit_interrupted : code;
}

}  // namespace

void add_synth(CLI::App& app, Action& chosen) {
  CLI::App* command = app.add_subcommand("synth", "Write a built-in sample as a CF netCDF file");
  const auto arguments = std::make_shared<SynthArguments>();
  command->add_option("sample", arguments->sample, "Name of the sample")
      ->required()
      ->check(CLI::IsMember(data::sample_names()));
  command->add_option("--dims", arguments->dims, "Grid size along x, y and z")->type_name("XxYxZ");
  command->add_option("--steps", arguments->steps, "Number of time steps")
      ->check(CLI::Range(1, std::numeric_limits<int>::max()).description(""))
      ->type_name("N");
  command->add_option("-o,--output", arguments->output, "Output file, .nc; - writes to stdout")
      ->required()
      ->type_name("FILE");
  add_verbosity_options(*command);
  command->callback(
      [&chosen, arguments] { chosen = [arguments] { return run_synth(*arguments); }; });
}

}  // namespace windsplat::cli
