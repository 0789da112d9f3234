// Byte offsets of the fields of a GRIB file, found by one pass over the headers.
#pragma once

#include <cstdint>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/files/input_file.hpp"

namespace windsplat::data::grib {

struct Part {
  std::uint64_t offset = 0;
  std::uint64_t bytes = 0;
};

// One field: a whole message, or sections of a message with several fields (edition 2).
struct FieldPlace {
  int edition = 0;
  std::vector<Part> parts;  // if `split`, without section 0 and the end marker
  bool split = false;
  Part head;  // bytes for HeaderCache; none if `split`, or if the sections are not as usual
};

// Errors: bad_data for truncated messages, or lengths beyond the end of the file.
Result<std::vector<FieldPlace>> find_fields(const InputFile& input);

Result<std::vector<unsigned char>> read_head(const InputFile& input, const FieldPlace& field);

// The field as a separate message.
Result<std::vector<unsigned char>> read_message(const InputFile& input, const FieldPlace& field);

}  // namespace windsplat::data::grib
