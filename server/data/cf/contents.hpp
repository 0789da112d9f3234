// The header of a file of arrays as plain data, filled by its reader.
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
  bool is_time = false;  // time whatever its name: lead or reference times of forecasts
  // Of faces of cells, if the reader knows: the dimension of their centers, and the face before the
  // first center (cf/staggered).
  int centers = -1;
  int first_face = 0;
  bool other = false;    // neither space nor time
  double spacing_m = 0;  // metres between samples without coordinates, in a plane; 0: not known
  bool is_list = false;  // of cells of a mesh, as the reader knows
  // The UUID of the horizontal grid that the entries of a list belong to: 32 hexadecimal digits in
  // lower case; empty if unknown.
  std::string grid_uuid = {};
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
  std::string cf_role;
  std::string mesh;  // UGRID: the mesh that the variable lies on
  // "<name of the vector> <component index>": attribute of the netCDF writer; also set by readers
  // of formats with vectors.
  std::string vector_mark;
  // A statistic that distinguishes the variable from others of the quantity: the components of a
  // vector have the same.
  std::string process;
  std::string unread;         // why a variable cannot be read; `numeric` is then false
  bool packed = false;        // has scale_factor or add_offset
  bool is_unsigned = false;   // _Unsigned = "true" on a signed integer type
  bool is_date_text = false;  // the file has the times as text
  bool preferred = false;     // its grid is shown, whatever others the file has
  bool layers_apart = true;   // some of its layers are read at the cost of their share of all
  bool in_use = false;        // a coordinate that named an entry or gave the times: not omitted
  std::string level;  // the coordinate of the vertical dimension of which one entry was chosen
};

struct FileContents {
  std::string title;
  std::vector<FileDimension> dimensions;
  std::vector<FileVariable> variables;   // variables of the root group; readers address a variable
                                         // by its index
  std::vector<std::string> groups;       // names of groups below the root, which are not searched
  std::vector<LeftOut> left_out;         // variables that cannot be read
  std::vector<DimensionChoice> choices;  // dimensions of which one entry was chosen
  bool has_selection = false;            // entries or a field were chosen by the user
  std::vector<std::string> notes;        // assumptions and conversions of the reader, for users
};

}  // namespace windsplat::data
