// windsplat render: draws one picture to a file or stdout, with an optional report.
#include <unistd.h>

#include <cstdint>
#include <memory>
#include <string>

#include "server/base/cancel.hpp"
#include "server/base/thread_pool.hpp"
#include "server/cli/beside/panels.hpp"
#include "server/cli/beside/sheets.hpp"
#include "server/cli/command.hpp"
#include "server/cli/picture.hpp"

namespace windsplat::cli {
namespace {

struct RenderArguments {
  ViewArguments view;
  std::string output;
  std::string report;  // empty: no report
  unsigned threads = 0;
};

Result<void> render(const RenderArguments& arguments) {
  const bool to_stdout = arguments.output == "-";
  if (to_stdout && arguments.report == "-") {
    return make_error(ErrorKind::invalid, "--report -: stdout is used for the picture");
  }
  const auto format =
      to_stdout ? Result<frame::Format>(frame::Format::png) : format_of(arguments.output);
  if (!format) return format.error();
  if (to_stdout && isatty(STDOUT_FILENO) == 1) {
    return make_error(ErrorKind::invalid,
                      "-o -: stdout is a terminal; redirect it to a file or a pipe");
  }
  auto panels = open_panels(arguments.view);
  if (!panels) return panels.error();

  ThreadPool pool(arguments.threads);
  frame::Encoding encoding = file_encoding(*format, arguments.view);
  encoding.measure = !arguments.report.empty();
  encoding.measure_change = encoding.measure;
  auto sheets = Sheets::of(*panels, encoding, pool);
  if (!sheets) return sheets.error();
  const auto sheet = sheets->draw(CancelToken());
  if (!sheet) return sheet.error();
  if (!sheet->exceeded.empty()) complain(sheet->exceeded);
  if (!sheet->empty.empty()) complain("the picture shows nothing of the data: " + sheet->empty);
  if (!sheet->empty_surfaces.empty()) complain("a surface is empty: " + sheet->empty_surfaces);
  auto written = write_output(arguments.output, sheet->bytes);
  if (!written || arguments.report.empty()) return written;
  const std::string& text = sheet->reports;
  return write_output(arguments.report,
                      {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

}  // namespace

void add_render(CLI::App& app, Action& chosen) {
  CLI::App* command = app.add_subcommand("render", "Draw one picture");
  const auto arguments = std::make_shared<RenderArguments>();
  add_view_options(*command, arguments->view);
  command->add_option("--step", arguments->view.step, "Time step, from 0")->type_name("N");
  command
      ->add_option("-o", arguments->output,
                   "out.png, .jpg, .npy, .pdf or .svg; - writes a PNG to stdout")
      ->required()
      ->type_name("FILE");
  command
      ->add_option(
          "--report", arguments->report,
          "Write times, memory, omissions and the measured error as JSON; - writes to stdout")
      ->type_name("FILE");
  add_threads_option(*command, arguments->threads);
  command->callback([&chosen, arguments] {
    chosen = [arguments] {
      const auto done = render(*arguments);
      return done ? exit_ok : answer(done.error());
    };
  });
}

}  // namespace windsplat::cli
