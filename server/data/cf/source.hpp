// Arrays with CF conventions -> a dataset: roles of dimensions -> grid -> fields -> volumes.
#pragma once

#include <memory>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/model/source.hpp"

namespace windsplat::data::cf {

// The dataset of a file's arrays. Errors: bad_data.
Result<std::unique_ptr<FileSource>> make_source(std::unique_ptr<ArrayFile> file);

}  // namespace windsplat::data::cf
