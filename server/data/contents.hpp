// What a netCDF file's header says, as plain data: the reader fills it, the cf_* files judge it.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace windsplat::data {

struct FileDimension {
  std::string name;
  std::size_t length = 0;
  bool unlimited = false;
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
  std::string vector_mark;   // our writer's own: "<vector's name> <component index>"
  bool packed = false;       // has scale_factor or add_offset
  bool is_unsigned = false;  // _Unsigned = "true" on a signed integer type
};

struct FileContents {
  std::string title;
  std::vector<FileDimension> dimensions;
  std::vector<FileVariable> variables;  // of the root group; the index is the library's variable id
  std::vector<std::string> groups;      // names of groups below the root, not looked into
};

}  // namespace windsplat::data
