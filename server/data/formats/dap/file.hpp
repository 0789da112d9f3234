// A dataset of an OPeNDAP service: its descriptions and the values of blocks are files of the
// location, named NAME.dds, NAME.das and NAME.dods?CONSTRAINT.
#pragma once

#include <memory>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/files/files.hpp"

namespace windsplat::data::dap {

// DAP 2.0 (ESE-RFC-004.1.2). `files`: of a location with `Location::service`. Structures and
// sequences are left out, so are texts. Errors: bad_data for an answer that is malformed, or is
// that of another request.
Result<std::unique_ptr<cf::ArrayFile>> open(const std::shared_ptr<Files>& files);

}  // namespace windsplat::data::dap
