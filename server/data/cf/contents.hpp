// What the header of a file of arrays says, as plain data: its reader fills it, the files beside
// this one judge it.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "server/data/model/dataset_info.hpp"

namespace windsplat::data {

struct FileDimension {
  std::string name;
  std::size_t length = 0;
  bool unlimited = false;
  bool falls = false;  // indices run against the direction that the grid's vectors count
};

struct FileVariable {
  std::string name;
  std::string type;           // "float32", "int16", ...; "text" or "compound" if not plain numbers
  bool numeric = false;       // one of the ten number types
  std::vector<int> dims;      // indices into FileContents::dimensions, slowest first
  std::string standard_name;  // attributes, trimmed; empty if absent
  std::string long_name;
  std::string units;
  std::string axis;
  std::string positive;
  std::string calendar;
  std::string coordinates;
  std::string bounds;  // `bounds` or `climatology`
  std::string grid_mapping;
  // "<vector's name> <component index>": our writer's own attribute, and how readers of formats
  // that have vectors tell them.
  std::string vector_mark;
  std::string unread;        // why it cannot be read although it is there; not `numeric` then
  bool packed = false;       // has scale_factor or add_offset
  bool is_unsigned = false;  // _Unsigned = "true" on a signed integer type
};

struct FileContents {
  std::string title;
  std::vector<FileDimension> dimensions;
  std::vector<FileVariable>
      variables;                    // of the root group; readers address a variable by its index
  std::vector<std::string> groups;  // names of groups below the root, not looked into
  std::vector<LeftOut> left_out;    // what the reader could not offer
  std::vector<std::string> notes;   // what the reader did that a user should know
};

}  // namespace windsplat::data
