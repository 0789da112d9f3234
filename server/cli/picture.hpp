// What the commands that draw pictures share: the view they are told, where pictures go.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "protocol/codec.hpp"
#include "server/base/error.hpp"
#include "server/data/open/open.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/frame/frame.hpp"

namespace windsplat::cli {

struct ViewArguments {
  std::string dataset;
  std::string view_file;
  std::string step;
  std::string size;
  std::vector<std::string> settings;  // "/json/pointer=value"
  std::string memory = "8G";
  int quality = 95;  // JPEG: a file is kept, so it costs bytes rather than detail
};

// DATASET, --view, --size, --set, --quality and --memory-limit; `arguments` outlives the command.
void add_view_options(CLI::App& command, ViewArguments& arguments);

// The view file, then --step, --size and --set on top of it, in this order.
Result<protocol::ViewDocument> assemble_view(const ViewArguments& arguments);

// By the extension of a file's name. Errors: invalid.
Result<frame::Format> format_of(const std::string& output);

// How a kept picture is encoded, `quality` 1..100 for a JPEG; the reference is allowed.
frame::Encoding file_encoding(frame::Format format, int quality);

// A dataset of its own for this command. Errors: malformed for a limit that is no number.
Result<std::shared_ptr<data::Dataset>> open_dataset(const ViewArguments& arguments);

}  // namespace windsplat::cli
