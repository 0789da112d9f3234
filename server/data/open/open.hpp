// Opens a dataset: format detection by content, then the reader of that format.
#pragma once

#include <memory>
#include <string>

#include "server/base/error.hpp"
#include "server/data/model/source.hpp"

namespace windsplat::data {

class Files;

// Opens a dataset by the content of its files, whatever their names, in this process.
// Errors: not_found, bad_data, out_of_memory.
Result<std::unique_ptr<FileSource>> open_dataset(const std::shared_ptr<Files>& files);
// The same for a path or pattern (see locate()).
Result<std::unique_ptr<Source>> open_file(const std::string& path);

}  // namespace windsplat::data
