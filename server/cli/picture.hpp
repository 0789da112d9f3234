// Common parts of the commands that draw pictures: view arguments and output files.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocol/codec.hpp"
#include "server/base/error.hpp"
#include "server/cli/data_hosts.hpp"
#include "server/data/open/open.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/frame/frame.hpp"

namespace windsplat::cli {

struct ViewArguments {
  std::string dataset;
  std::string view_file;
  std::string step;
  std::string size;
  std::string minus;                  // a dataset; empty: none
  std::string minus_step;             // empty: none
  std::vector<std::string> settings;  // "/json/pointer=value"
  bool figure = false;
  std::string memory = "8G";
  DataHostArguments data_hosts;
  int quality = 95;  // JPEG: files favour detail over size
  std::optional<double> dots_per_inch;
};

// DATASET, --view, --size, --figure, --minus, --minus-step, --set, --quality, --dpi, --memory-limit
// and the options of data hosts; `arguments` must outlive the command.
void add_view_options(CLI::App& command, ViewArguments& arguments);

// The view file, overridden by --step, --size, --figure, --minus-step and --set in this order.
Result<protocol::ViewDocument> assemble_view(const ViewArguments& arguments);

// The format that the extension of a file name denotes. Errors: invalid.
Result<frame::Format> format_of(const std::string& output);

// Encoding of a picture file; the reference is allowed.
frame::Encoding file_encoding(frame::Format format, const ViewArguments& arguments);

// Opens the dataset for this command, and the one of --minus, and names them in the view. The
// result is the handle that yields the fields of the view. Errors: malformed for an invalid limit;
// those of open_fetcher() and scene::with_difference(); invalid at /difference/dataset for one that
// only the view file names.
Result<std::shared_ptr<data::Dataset>> open_dataset(const ViewArguments& arguments,
                                                    protocol::View& view);

}  // namespace windsplat::cli
