// The text of a NRRD header (format of teem, versions 1 to 5) -> plain data; checks syntax only.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/bytes/scalar.hpp"
#include "server/data/files/input_file.hpp"

namespace windsplat::data::nrrd {

constexpr double not_given = std::numeric_limits<double>::quiet_NaN();

struct HeaderAxis {
  std::uint64_t size = 0;
  double spacing = not_given;
  double min = not_given;
  double max = not_given;
  bool node_centered = false;
  std::string kind;  // lower case; empty if not given
  std::string label;
  std::string units;
  std::vector<double> direction;  // empty: none
};

struct Header {
  std::vector<HeaderAxis> axes;  // fastest first, as in the file
  bytes::Scalar type = bytes::Scalar::float32;
  std::string encoding = "raw";
  bool big_endian = false;
  std::string content;
  std::string sample_units;
  std::string space;  // lower case; empty if not given
  std::size_t space_dimension = 0;
  std::vector<double> origin;  // empty if not given
  std::vector<std::string> space_units;
  bool measurement_frame = false;
  std::int64_t line_skip = 0;
  std::int64_t byte_skip = 0;
  std::vector<std::string> data_files;  // data files of a detached header
  std::size_t file_dimension = 0;       // dimensions of a data file; 0: default
  std::uint64_t end = 0;                // offset of the data after an attached header
  std::vector<std::string> notes;
};

// Errors: bad_data with the line.
Result<Header> parse_header(const InputFile& file);

}  // namespace windsplat::data::nrrd
