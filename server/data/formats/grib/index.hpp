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

// One field: a whole message, or the sections of one that holds several (edition 2).
struct FieldPlace {
  int edition = 0;
  std::vector<Part> parts;  // without section 0 and the end marker where it is `split`
  bool split = false;
};

// Errors: bad_data for messages cut short, or of a length the file cannot hold.
Result<std::vector<FieldPlace>> find_fields(const InputFile& input);

// The field as a message of its own.
Result<std::vector<unsigned char>> read_message(const InputFile& input, const FieldPlace& field);

}  // namespace windsplat::data::grib
