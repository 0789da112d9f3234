// windsplat render: draws one picture to a file or stdout, with an optional report.
#include <unistd.h>

#include <cstdint>
#include <memory>
#include <string>

#include "server/base/cancel.hpp"
#include "server/base/thread_pool.hpp"
#include "server/cli/command.hpp"
#include "server/cli/limited_picture.hpp"
#include "server/cli/picture.hpp"

namespace windsplat::cli {
namespace {

struct RenderArguments {
  ViewArguments view;
  std::string output;
  std::string report;  // empty: no report
  unsigned threads = 0;
};

Result<void> write_report(const std::string& path, const Picture& picture) {
  const std::string text = report_line(picture);
  return write_output(path, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

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
  const auto document = assemble_view(arguments.view);
  if (!document) return document.error();
  protocol::View view = document->view();
  const auto dataset = open_dataset(arguments.view, view);
  if (!dataset) return dataset.error();

  ThreadPool pool(arguments.threads);
  frame::Encoding encoding = file_encoding(*format, arguments.view);
  encoding.measure = !arguments.report.empty();
  encoding.measure_change = encoding.measure;
  const auto picture = LimitedPictures(**dataset, encoding, pool).draw(view, CancelToken());
  if (!picture) return picture.error();
  if (const std::string text = exceeded_limits(*picture); !text.empty()) complain(text);
  if (!picture->frame.empty.empty()) complain(empty_text(*picture));
  auto written = write_output(arguments.output, picture->frame.bytes);
  if (!written || arguments.report.empty()) return written;
  return write_report(arguments.report, *picture);
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
