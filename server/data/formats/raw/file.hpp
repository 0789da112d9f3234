// Raw files described by JSON (docs/user/formats.md). Files -> description -> arrays of cf.
#pragma once

#include <memory>
#include <string_view>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/files/files.hpp"

namespace windsplat::data::raw {

// Whether a text that begins so is a JSON object with our key near its beginning.
bool looks_like(std::string_view head);

// Whether it begins as any JSON object does.
bool is_json(std::string_view head);

// Errors: bad_data; not_found for files that the description names.
Result<std::unique_ptr<cf::ArrayFile>> open(const std::shared_ptr<Files>& files,
                                            std::shared_ptr<const InputFile> description);

}  // namespace windsplat::data::raw
