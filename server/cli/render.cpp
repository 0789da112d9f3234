// windsplat render: draws one picture to a file or stdout, with an optional report.
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "server/base/cancel.hpp"
#include "server/base/elapsed.hpp"
#include "server/base/thread_pool.hpp"
#include "server/base/whole_file.hpp"
#include "server/cli/beside/panels.hpp"
#include "server/cli/beside/sheets.hpp"
#include "server/cli/command.hpp"
#include "server/cli/picture.hpp"
#include "server/cli/progress.hpp"

namespace windsplat::cli {
namespace {

struct RenderArguments {
  ViewArguments view;
  std::string output;
  std::string format;  // empty: by the name of the output
  std::string report;  // empty: no report
  unsigned threads = 0;
};

// By the name of the output, or --format, or for stdout PNG.
Result<frame::Format> output_format(const RenderArguments& arguments) {
  const bool is_pipe = is_stdout(arguments.output) || is_stream(arguments.output);
  if (!arguments.format.empty() && !is_pipe) {
    return make_error(ErrorKind::invalid, "-o '" + printable(arguments.output) +
                                              "': its name tells the format; --format is for - "
                                              "and pipes");
  }
  if (!arguments.format.empty()) return format_of("." + arguments.format);
  if (is_stdout(arguments.output)) return frame::Format::png;
  return format_of(arguments.output);
}

Result<void> render(const RenderArguments& arguments) {
  const auto format = output_format(arguments);
  if (!format) return format.error();
  if (auto free = check_streams({{"--view", arguments.view.view_file}},
                                {{"-o", arguments.output}, {"--report", arguments.report}});
      !free) {
    return free.error();
  }
  Progress progress;
  progress.show(0, "reading");
  auto panels = open_panels(arguments.view);
  if (!panels) return panels.error();

  ThreadPool pool(arguments.threads);
  frame::Encoding encoding = file_encoding(*format, arguments.view);
  encoding.measure = !arguments.report.empty();
  encoding.measure_change = encoding.measure;
  auto sheets = Sheets::of(*panels, encoding, pool);
  if (!sheets) return sheets.error();
  const auto start = std::chrono::steady_clock::now();
  const auto sheet = sheets->draw(
      CancelToken(), [&](double done, std::string_view doing) { progress.show(done, doing); });
  progress.clear();
  if (!sheet) return sheet.error();
  detail(std::to_string(sheet->width) + " x " + std::to_string(sheet->height) + " pixels in " +
         seconds_text(seconds_since(start)) + " to " + in_quotes(arguments.output));
  if (!sheet->exceeded.empty()) note(sheet->exceeded);
  if (!sheet->coarser.empty()) note(sheet->coarser);
  if (!sheet->empty.empty()) note("the picture shows nothing of the data: " + sheet->empty);
  if (!sheet->empty_surfaces.empty()) note("a surface is empty: " + sheet->empty_surfaces);
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
      ->add_option("-o,--output", arguments->output,
                   "out.png, .jpg, .npy, .pdf or .svg; - writes a PNG to stdout")
      ->required()
      ->type_name("FILE");
  command
      ->add_option("--format", arguments->format,
                   "Kind of picture that is written to - or a pipe; default: png")
      ->check(CLI::IsMember({"png", "jpg", "npy", "pdf", "svg"}));
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
