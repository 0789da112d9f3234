// Common parts of the commands that draw pictures: view arguments and output files.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "protocol/codec.hpp"
#include "server/base/error.hpp"
#include "server/cli/data_hosts.hpp"
#include "server/data/open/open.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/frame/frame.hpp"

namespace CLI {
class App;
}

namespace windsplat::cli {

struct ViewArguments {
  std::string dataset;
  std::string view_file;
  std::string step;
  std::string size;
  std::string minus;        // a dataset; empty: none
  std::string minus_step;   // empty: none
  std::string beside;       // a dataset; empty: none
  std::string beside_step;  // empty: none
  std::vector<std::string> beside_settings;
  std::vector<std::string> settings;  // "/json/pointer=value"
  bool figure = false;
  std::string memory = "8G";
  DataHostArguments data_hosts;
  int quality = 95;  // JPEG: files favour detail over size
  std::optional<double> dots_per_inch;

  // Whether a second picture is drawn beside the first.
  [[nodiscard]] bool is_pair() const {
    return !beside.empty() || !beside_step.empty() || !beside_settings.empty();
  }
};

// DATASET, --view, --size, --figure, --minus, --minus-step, --beside, --beside-step, --beside-set,
// --set, --quality, --dpi, --memory-limit and the options of data hosts; `arguments` must outlive
// the command.
void add_view_options(CLI::App& command, ViewArguments& arguments);

// The view file, overridden by --step, --size, --figure, --minus-step, what a picture beside
// another shows, and --set in this order.
Result<protocol::ViewDocument> assemble_view(const ViewArguments& arguments);

// "/json/pointer=value" of an option -> pointer and value. Errors: malformed.
Result<std::pair<std::string, std::string>> parse_setting(const char* option,
                                                          const std::string& text);

// The format that the extension of a file name denotes. Errors: invalid.
Result<frame::Format> format_of(const std::string& output);

// Encoding of a picture file; the reference is allowed.
frame::Encoding file_encoding(frame::Format format, const ViewArguments& arguments);

// Those of DATASET, --beside and --minus; null: not given.
struct OpenedDatasets {
  std::shared_ptr<data::Dataset> first, beside, minus;
};
// Errors: malformed for an invalid limit; those of open_fetcher() and Store::add().
Result<OpenedDatasets> open_datasets(const ViewArguments& arguments);

// Names `dataset` and `minus` in the view, and yields the handle of its fields. Errors: those of
// scene::with_difference(); invalid at /difference/dataset for one that only the view file names.
Result<std::shared_ptr<data::Dataset>> shown_dataset(protocol::View& view,
                                                     const std::shared_ptr<data::Dataset>& dataset,
                                                     const std::shared_ptr<data::Dataset>& minus);

}  // namespace windsplat::cli
