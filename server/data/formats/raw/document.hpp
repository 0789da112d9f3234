// The JSON text that describes raw files (docs/user/formats.md) -> plain data.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/bytes/scalar.hpp"
#include "server/data/files/input_file.hpp"

namespace windsplat::data::raw {

// Files of one or more fields: names, or a pattern with %d.
struct FileNames {
  std::vector<std::string> names;  // as written; a pattern is expanded by the steps
  bool pattern = false;
};

struct Field {
  std::string name;
  std::vector<std::string> components;  // empty: a scalar
  std::string units;
  bool planar = false;
  std::vector<double> missing;
  bytes::Scalar type = bytes::Scalar::float32;
  bool big_endian = false;
  FileNames files;  // empty: those of the document
  std::uint64_t offset = 0;
};

struct AxisText {
  std::string units;
  std::string positive;
  bytes::Spaced places;  // count 0: by index
};

struct Document {
  std::string title;
  FileNames files;
  std::int64_t first_number = 0;
  std::int64_t number_step = 1;
  std::size_t steps_per_file = 0;  // 0: steps divided by files; for a pattern 1
  std::array<std::size_t, 3> dims{1, 1, 1};
  std::array<bool, 3> has{false, false, false};
  std::string order;  // "zyx": slowest first
  std::uint64_t offset = 0;
  bytes::Spaced times;     // one per step
  std::string time_units;  // empty: steps are numbered
  std::string calendar;
  std::array<AxisText, 3> axes;
  std::vector<Field> fields;
};

// Errors: bad_data with the JSON pointer of the invalid value.
Result<Document> parse_document(const InputFile& file);

}  // namespace windsplat::data::raw
