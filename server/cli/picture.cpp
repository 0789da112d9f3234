// Parses the arguments of a picture: view, format and dataset.
#include "server/cli/picture.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <utility>

#include "protocol/limits.hpp"
#include "server/base/whole_file.hpp"
#include "server/cli/command.hpp"
#include "server/cli/open_store.hpp"
#include "server/scene/difference/difference.hpp"

namespace windsplat::cli {
void add_view_options(CLI::App& command, ViewArguments& arguments) {
  command.add_option("dataset", arguments.dataset, "A sample's name or a file")
      ->required()
      ->type_name("DATASET");
  command.add_option("--view", arguments.view_file, "A view as JSON; DATASET replaces its dataset")
      ->type_name("FILE");
  command.add_option("--size", arguments.size, "Pixels, for example 1280x720")->type_name("WxH");
  command.add_flag("--figure", arguments.figure,
                   "Draw box, axes, north arrow, scale bar, legend, title and time, and lines in "
                   "the colours of the legend");
  command
      .add_option("--minus", arguments.minus,
                  "Draw the fields minus those of another dataset on the same grid")
      ->type_name("DATASET");
  command
      .add_option("--minus-step", arguments.minus_step,
                  "Draw the fields minus those of this step, from 0")
      ->type_name("N");
  command
      .add_option("--beside", arguments.beside,
                  "Draw another dataset on the right, with the same camera and ranges")
      ->type_name("DATASET");
  command
      .add_option("--beside-step", arguments.beside_step,
                  "Draw this step on the right, from 0; default: the same")
      ->type_name("N");
  command
      .add_option("--beside-set", arguments.beside_settings,
                  "Change one key of the view on the right; may be repeated")
      ->allow_extra_args(false)
      ->type_name("/json/pointer=value");
  command.add_option("--set", arguments.settings, "Change one key of the view; may be repeated")
      ->allow_extra_args(false)
      ->type_name("/json/pointer=value");
  command.add_option("--quality", arguments.quality, "JPEG quality, 1 (smallest) to 100 (best)")
      ->check(CLI::Range(1, 100))
      ->type_name("N")
      ->capture_default_str();
  command
      .add_option("--dpi", arguments.dots_per_inch,
                  "Pixels to the inch of .pdf and .svg (300), and of .png if given")
      ->check(between(frame::dots_per_inch_min, frame::dots_per_inch_max))
      ->type_name("N");
  add_memory_option(command, arguments.memory);
  add_data_host_options(command, arguments.data_hosts);
  add_verbosity_options(command);
}

Result<protocol::ViewDocument> assemble_view(const ViewArguments& arguments) {
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
  if (arguments.figure) {
    for (const char* shown :
         {"box", "axes", "north", "scaleBar", "legend", "title", "stepTime", "contourLabels"}) {
      changes.emplace_back(std::string("/annotations/") + shown, "true");
    }
    changes.emplace_back("/vector/color/trueColors", "true");
  }
  if (!arguments.minus_step.empty()) changes.emplace_back("/difference/step", arguments.minus_step);
  if (arguments.is_pair()) {
    for (const char* shown : {"title", "stepTime"}) {
      changes.emplace_back(std::string("/annotations/") + shown, "true");
    }
  }
  for (const std::string& setting : arguments.settings) {
    auto change = parse_setting("--set", setting);
    if (!change) return change.error();
    if (change->first == "/dataset") {
      return make_error_at(ErrorKind::invalid, "/dataset",
                           "--set: the dataset is that of the argument DATASET, which would "
                           "replace it");
    }
    changes.push_back(std::move(*change));
  }
  if (!document || changes.empty()) return document;
  return protocol::set_all(*document, changes);
}

Result<std::pair<std::string, std::string>> parse_setting(const char* option,
                                                          const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals != std::string::npos) {
    return std::pair(text.substr(0, equals), text.substr(equals + 1));
  }
  return make_error(ErrorKind::malformed, std::string(option) + " '" + printable(text) +
                                              "' is not of the form /json/pointer=value");
}

Result<frame::Format> format_of(const std::string& output) {
  const std::size_t dot = output.find_last_of("./");
  std::string extension = dot == std::string::npos ? "" : output.substr(dot);
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".png") return frame::Format::png;
  if (extension == ".jpg" || extension == ".jpeg") return frame::Format::jpeg;
  if (extension == ".npy") return frame::Format::npy;
  if (extension == ".pdf") return frame::Format::pdf;
  if (extension == ".svg") return frame::Format::svg;
  if (is_stream(output)) return frame::Format::png;  // as "-"
  return make_error(ErrorKind::invalid,
                    "-o '" + printable(output) +
                        "': the file name must end in .png, .jpg, .npy, .pdf or "
                        ".svg");
}

frame::Encoding file_encoding(frame::Format format, const ViewArguments& arguments) {
  frame::Encoding encoding;
  encoding.format = format;
  encoding.quality = arguments.quality;
  encoding.dots_per_inch = arguments.dots_per_inch;
  encoding.allow_reference = true;
  return encoding;
}

Result<OpenedDatasets> open_datasets(const ViewArguments& arguments) {
  const auto limit = memory_limit(arguments.memory);
  if (!limit) return limit.error();
  auto fetcher = open_fetcher(arguments.data_hosts);
  if (!fetcher) return fetcher.error();
  // Datasets do not depend on the store.
  data::Store store(store_options(*limit, std::move(*fetcher)));
  OpenedDatasets out;
  for (const auto& [name, dataset] :
       {std::pair(&arguments.dataset, &out.first), std::pair(&arguments.minus, &out.minus),
        std::pair(&arguments.beside, &out.beside)}) {
    if (name->empty()) continue;
    auto opened = store.add(*name);
    if (!opened) return opened.error();
    *dataset = std::move(*opened);
  }
  return out;
}

Result<std::shared_ptr<data::Dataset>> shown_dataset(protocol::View& view,
                                                     const std::shared_ptr<data::Dataset>& dataset,
                                                     const std::shared_ptr<data::Dataset>& minus) {
  view.dataset = dataset->info().id;
  if (minus) {
    if (!view.difference) view.difference.emplace();
    view.difference->dataset = minus->info().id;
  } else if (view.difference && view.difference->dataset) {
    return make_error_at(ErrorKind::invalid, "/difference/dataset",
                         "is " + in_quotes(*view.difference->dataset) +
                             " of a server: name the file or sample here, by --minus");
  }
  auto shown = scene::with_difference(view, *dataset, minus.get());
  if (!shown) return shown.error();
  return std::make_shared<data::Dataset>(std::move(*shown));
}

}  // namespace windsplat::cli
