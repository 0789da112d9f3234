// Raw files described by JSON (docs/user/formats.md). Files -> description -> arrays of cf.
#pragma once

#include <memory>
#include <string_view>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/files/files.hpp"

namespace windsplat::data::raw {

// Whether the first bytes are a JSON object with the key of the format near its beginning.
bool looks_like(std::string_view head);

// Whether the first bytes are those of a JSON object.
bool is_json(std::string_view head);

// Errors: bad_data; not_found for files that the description names.
Result<std::unique_ptr<cf::ArrayFile>> open(const std::shared_ptr<Files>& files,
                                            std::shared_ptr<const InputFile> description);

}  // namespace windsplat::data::raw
