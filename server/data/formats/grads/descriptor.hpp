// The text of a GrADS descriptor (.ctl) -> plain data.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/bytes/scalar.hpp"
#include "server/data/files/input_file.hpp"
#include "server/data/formats/grads/dates.hpp"

namespace windsplat::data::grads {

struct Variable {
  std::string name;
  std::size_t levels = 0;  // 0: not on a level
  std::string description;
  std::string units;  // from the description or attributes; may be empty
  bytes::Scalar type = bytes::Scalar::float32;
  bool times_inside = false;  // -1,20: all times of this variable, then the next variable
  bool transposed = false;    // -1,30: y fastest
};

struct Descriptor {
  std::string dset;  // relative to the folder of the descriptor
  std::string title;
  double undef = 0;
  bool has_undef = false;
  bool yrev = false;
  bool zrev = false;
  bool big_endian = false;
  bool sequential = false;
  bool is_template = false;
  bool pascals = false;
  std::uint64_t file_header = 0;  // bytes of the headers and trailers of a file,
  std::uint64_t time_header = 0;  // a time and a grid
  std::uint64_t time_trailer = 0;
  std::uint64_t grid_header = 0;
  std::uint64_t grid_trailer = 0;
  bytes::Spaced x;  // as in xdef, ydef, zdef
  bytes::Spaced y;
  bytes::Spaced z;
  std::size_t times = 0;
  Clock clock;
  std::vector<Variable> variables;
  std::vector<std::string> notes;
};

// Errors: bad_data with the line.
Result<Descriptor> parse_descriptor(const InputFile& file);

}  // namespace windsplat::data::grads
