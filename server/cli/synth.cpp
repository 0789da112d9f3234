// windsplat synth: writes a built-in sample as a CF netCDF file.
#include <unistd.h>

#include <limits>
#include <memory>
#include <string>

#include "server/base/cancel.hpp"
#include "server/cli/command.hpp"
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

Result<void> synth(const SynthArguments& arguments, const CancelToken& cancel) {
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
  return data::write_netcdf(**source, arguments.output, cancel);
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
  command->add_option("-o", arguments->output, "Output file")->required()->type_name("F.nc");
  command->callback([&chosen, arguments] {
    chosen = [arguments] {
      const CancelToken cancel;
      const std::string part = data::netcdf_part(arguments->output);
      const SignalWatch watch([&cancel] { cancel.cancel(); }, nullptr,
                              {exit_interrupted, [&part] { ::unlink(part.c_str()); }});
      const auto done = synth(*arguments, cancel);
      if (done) return exit_ok;
      const int code = answer(done.error());
      return done.error().kind == ErrorKind::cancelled ? exit_interrupted : code;
    };
  });
}

}  // namespace windsplat::cli
