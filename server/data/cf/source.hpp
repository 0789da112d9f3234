// Arrays with CF conventions -> a dataset: roles of dimensions -> grid -> fields -> volumes.
#pragma once

#include <memory>
#include <string>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/model/source.hpp"

namespace windsplat::data::cf {

// The dataset of a file's arrays. `title`: its title; empty: that of the file. Errors: bad_data.
Result<std::unique_ptr<FileSource>> make_source(std::unique_ptr<ArrayFile> file,
                                                const std::string& title = "");

}  // namespace windsplat::data::cf
