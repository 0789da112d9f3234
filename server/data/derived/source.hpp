// A source of a dataset -> the same with the fields that can be computed from it.
#pragma once

#include <memory>

#include "server/data/model/source.hpp"

namespace windsplat::data::derived {

// Appends derived fields (rules.hpp) to those of the source; one is computed when it is read, from
// the inputs read for it, which are then freed: a vector of the whole grid at most, and heights, or
// temperature, pressure and humidity. `fill` needs a source of files, `read` any source.
std::unique_ptr<FileSource> with_derived_fields(std::unique_ptr<Source> source);

}  // namespace windsplat::data::derived
