// A dataset's description as lines that a person reads.
#pragma once

#include <string>

#include "protocol/messages.hpp"

namespace windsplat::cli {

std::string inspect_text(const protocol::DatasetDescription& dataset);

}  // namespace windsplat::cli
