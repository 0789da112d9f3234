// windsplat render: dataset + view -> one picture in a file or on stdout.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "protocol/codec.hpp"
#include "protocol/limits.hpp"
#include "server/base/cancel.hpp"
#include "server/base/thread_pool.hpp"
#include "server/cli/command.hpp"
#include "server/data/store.hpp"
#include "server/frame/frame.hpp"

namespace windsplat::cli {
namespace {

constexpr std::uint64_t resident_bytes_max = 8ULL << 30;
constexpr int file_quality = 95;  // JPEG: a file is kept, so it costs bytes rather than detail

struct Arguments {
  std::string dataset;
  std::string view_file;
  std::string step;
  std::string size;
  std::vector<std::string> settings;  // "/json/pointer=value"
  std::string output;
  unsigned threads = 0;
};

Result<frame::Format> format_of(const std::string& output) {
  if (output == "-") return frame::Format::png;
  const std::size_t dot = output.find_last_of("./");
  std::string extension = dot == std::string::npos ? "" : output.substr(dot);
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".png") return frame::Format::png;
  if (extension == ".jpg" || extension == ".jpeg") return frame::Format::jpeg;
  if (extension == ".npy") return frame::Format::npy;
  return make_error(ErrorKind::invalid, "-o '" + printable(output) +
                                            "': its name must end in .png, .jpg or .npy, or be -");
}

// The view file, then --step, --size and --set on top of it, in this order.
Result<protocol::ViewDocument> assemble_view(const Arguments& arguments) {
  std::string text = "{}";
  if (!arguments.view_file.empty()) {
    auto file = read_text_file(arguments.view_file, protocol::limits::message_bytes_max);
    if (!file) return file.error();
    text = std::move(*file);
  }
  auto document = protocol::ViewDocument::parse(text);

  std::vector<std::pair<std::string, std::string>> changes;
  if (!arguments.step.empty()) changes.emplace_back("/step", arguments.step);
  if (!arguments.size.empty()) {
    const auto size = parse_extent(arguments.size, 2);
    if (!size) {
      return make_error(ErrorKind::malformed,
                        "--size '" + printable(arguments.size) + "' is not of the form 1280x720");
    }
    changes.emplace_back("/image/width", std::to_string((*size)[0]));
    changes.emplace_back("/image/height", std::to_string((*size)[1]));
  }
  for (const std::string& setting : arguments.settings) {
    const std::size_t equals = setting.find('=');
    if (equals == std::string::npos) {
      return make_error(ErrorKind::malformed, "--set '" + printable(setting) +
                                                  "' is not of the form /json/pointer=value");
    }
    changes.emplace_back(setting.substr(0, equals), setting.substr(equals + 1));
  }
  for (const auto& [pointer, value] : changes) {
    if (!document) break;
    document = protocol::set_at(*document, pointer, value);
  }
  return document;
}

Result<void> render(const Arguments& arguments) {
  const auto format = format_of(arguments.output);
  if (!format) return format.error();
  if (arguments.output == "-" && isatty(STDOUT_FILENO) == 1) {
    return make_error(ErrorKind::invalid,
                      "-o -: stdout is a terminal; send it to a file or a pipe");
  }
  const auto document = assemble_view(arguments);
  if (!document) return document.error();

  data::Store store(resident_bytes_max);
  const auto dataset = store.add(arguments.dataset);
  if (!dataset) return dataset.error();
  protocol::View view = document->view();
  view.dataset = (*dataset)->info().id;

  frame::Encoding encoding;
  encoding.format = *format;
  encoding.quality = file_quality;
  encoding.allow_reference = true;
  ThreadPool pool(arguments.threads);
  const auto picture = frame::produce(view, **dataset, encoding, pool, CancelToken());
  if (!picture) return picture.error();
  return write_output(arguments.output, picture->bytes);
}

}  // namespace

void add_render(CLI::App& app, Action& chosen) {
  CLI::App* command = app.add_subcommand("render", "Draw one picture");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("dataset", arguments->dataset, "A sample's name or a file")
      ->required()
      ->type_name("DATASET");
  command
      ->add_option("--view", arguments->view_file, "A view as JSON; DATASET replaces its dataset")
      ->type_name("F");
  command->add_option("--step", arguments->step, "Time step, from 0")->type_name("N");
  command->add_option("--size", arguments->size, "Pixels, for example 1280x720")->type_name("WxH");
  command->add_option("--set", arguments->settings, "Change one key of the view; may be repeated")
      ->allow_extra_args(false)
      ->type_name("/json/pointer=value");
  command->add_option("-o", arguments->output, "out.png, .jpg or .npy; - writes a PNG to stdout")
      ->required()
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
