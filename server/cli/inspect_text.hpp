// Formats a dataset's description as text.
#pragma once

#include <string>

#include "protocol/messages.hpp"

namespace windsplat::cli {

std::string inspect_text(const protocol::DatasetDescription& dataset);

}  // namespace windsplat::cli
